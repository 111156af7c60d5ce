//! `verify --deposit`: since when what a verification uses is fixed, and what is not.

mod common;

use common::{
    authority::{Authority, Certificate},
    deposits::Vendor,
    fixture,
};
use serde_json::Value;
use std::fs;

/// A leak, and a vendor whose deposit an authority has stamped.
struct Case {
    vendor: Vendor,
    suspect: String,
    root: String,
    _authority: Authority,
}

const RECORD: [&str; 2] = ["--record", "records/acme.json"];

impl Case {
    fn new() -> Self {
        let (vendor, authority) = (Vendor::new(), Authority::new(Certificate::Right));
        authority.answer(&vendor.path("series.tsq"), &vendor.path("series.tsr"));
        Case {
            vendor,
            suspect: fixture("vectors/fingerprint/marked.gpkg").display().to_string(),
            root: authority.root().display().to_string(),
            _authority: authority,
        }
    }

    /// Verifies with the deposit and its time stamp.
    fn verify(&self, more: &[&str]) -> (Option<i32>, String) {
        let stamped =
            ["--public-key", "key.public.pem", "--time-stamp", "series.tsr", "--authorities", &self.root];
        self.verify_without_stamp(&[&stamped[..], more].concat())
    }

    fn verify_without_stamp(&self, more: &[&str]) -> (Option<i32>, String) {
        let arguments =
            ["verify", "--key", "key.json", "--reference", "map.gpkg", "--deposit", "series.deposit"];
        self.vendor.run(&[&arguments[..], more, &[&self.suspect]].concat())
    }
}

fn assert_answer((code, text): (Option<i32>, String), expected: i32, words: &[&str]) {
    assert!(code == Some(expected), "{code:?} {text}");
    words.iter().for_each(|words| assert!(text.contains(words), "{words:?} is not in {text}"));
}

#[test]
fn what_was_deposited_is_fixed_since_the_time_of_the_stamp() {
    let case = Case::new();
    let fixed =
        "fixed:        key, vertices of the reference map.gpkg, file of the reference map.gpkg, record";
    let since = " UTC, as CN=Authority states";
    assert_answer(case.verify(&RECORD), 0, &[fixed, since, "signed with the public key that was given"]);
    assert_answer(case.verify(&["--records", "records"]), 0, &[fixed, "record acme.json", since]);
    assert_answer(
        case.verify_without_stamp(&RECORD),
        0,
        &[fixed, "no time stamp", "nothing here vouches for"],
    );
}

#[test]
fn the_report_says_what_is_fixed_in_every_format() {
    let case = Case::new();
    let text = "number = \"7/26 </style>\"\ncustody = [\"from A\", \"to B\"]\n";
    fs::write(case.vendor.path("case.toml"), text).unwrap();
    let report = |name: &str| {
        assert_answer(
            case.verify(&[
                "--record",
                "records/acme.json",
                "--explain",
                "--report",
                name,
                "--case",
                "case.toml",
            ]),
            0,
            &[
                "rules that out for what it holds, since 20",
                "The deposit holds: key, vertices of the reference map.gpkg",
            ],
        );
        fs::read_to_string(case.vendor.path(name)).unwrap()
    };
    let json: Value = serde_json::from_str(&report("report.json")).unwrap();
    let schema = fs::read_to_string(fixture("../docs/report.schema.json")).unwrap();
    let validator = jsonschema::draft202012::new(&serde_json::from_str(&schema).unwrap()).unwrap();
    assert!(validator.is_valid(&json));
    assert_eq!(json["deposit"]["authority"], "CN=Authority");
    assert_eq!(json["deposit"]["public_key_given"], true);
    assert_eq!(json["case"]["number"], "7/26 </style>");
    let page = report("report.html");
    assert!(page.contains("rules that out for what it holds, since 20"));
    assert!(
        page.contains("<li>to B</li>") && page.contains("Case 7\\00002f26 \\00003c\\00002fstyle"),
        "{page}"
    );
    assert_eq!(page.matches("</style").count(), 1);
    assert_eq!(page.matches("class=\"blank\"").count(), 2, "examiner and date are left to write in");
    assert!(page.contains("When the mark was made.") && !page.contains("older than the suspect"));
}

#[test]
fn what_was_changed_after_the_deposit_is_found_out() {
    let case = Case::new();
    let copy = |from: &str, to: &str| {
        fs::copy(case.vendor.path(from), case.vendor.path(to)).unwrap();
    };
    copy("records/acme.json", "later.json");
    case.vendor.change("later.json", "ACME GmbH", "Innocent Ltd");
    let found_out = |words: &str, more: &[&str]| {
        let report = [more, &["--report", "report.html"]].concat();
        assert_answer(case.verify(&report), 4, &[words]);
        assert!(!case.vendor.path("report.html").exists());
    };
    found_out("record later.json is not in the deposit", &["--record", "later.json"]);
    found_out("recipient \"Innocent Ltd\" is not in the deposit", &["--recipient", "Innocent Ltd"]);
    fs::create_dir(case.vendor.path("found")).unwrap();
    copy("records/acme.json", "found/acme.json");
    case.vendor.change("found/acme.json", "{", "{ ");
    found_out("record acme.json is not in the deposit", &["--records", "found"]);
    case.vendor.change_statement("\"vertices\":3833", "\"vertices\":3834");
    found_out("was changed after it was signed", &RECORD);
}

#[test]
fn without_a_record_the_recipient_is_fixed_and_the_parameters_are_not() {
    let case = Case::new();
    let words = ["recipient \"ACME GmbH\"", "not fixed:    how the map was marked"];
    assert_answer(case.verify(&["--recipient", "ACME GmbH"]), 0, &words);
}

#[test]
fn a_stamp_without_authorities_or_without_a_deposit_is_a_usage_error() {
    let case = Case::new();
    assert_answer(case.verify_without_stamp(&["--time-stamp", "series.tsr"]), 2, &["--authorities"]);
    let arguments =
        ["verify", "--key", "key.json", "--reference", "map.gpkg", "--public-key", "key.public.pem"];
    let refused = case.vendor.run(&[&arguments[..], &[&case.suspect]].concat());
    assert_answer(refused, 2, &["--deposit"]);
}
