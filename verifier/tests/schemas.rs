//! docs/*.schema.json describe what the programs write, and nothing else.

mod common;

use meshmark_core::{
    code::Code,
    distortion::{AngleChange, Areas, Corner, Displacement, Hausdorff, Overlaps, Validity},
    fingerprint_record::FingerprintRecord,
    options::{Kind, OPTIONS, Parameters},
    record::{Record, Reference, TopologyEntry},
};
use serde_json::{Value, json};
use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn schema(name: &str) -> Value {
    let path = root().join(format!("docs/{name}.schema.json"));
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// What the schema finds wrong with a document.
fn errors(name: &str, document: &Value) -> Vec<String> {
    let schema = schema(name);
    jsonschema::meta::validate(&schema).expect("the schema is one");
    let validator = jsonschema::draft202012::new(&schema).unwrap();
    validator.iter_errors(document).map(|e| format!("{}: {e}", e.instance_path())).collect()
}

fn assert_valid(name: &str, document: &Value) {
    let errors = errors(name, document);
    assert!(errors.is_empty(), "{errors:#?}\n{document:#}");
}

/// `document` with the value at `pointer` replaced.
fn with(document: &Value, pointer: &str, value: Value) -> Value {
    let mut changed = document.clone();
    *changed.pointer_mut(pointer).unwrap_or_else(|| panic!("{pointer} of {document:#}")) = value;
    changed
}

fn without(document: &Value, object: &str, field: &str) -> Value {
    let mut changed = document.clone();
    changed.pointer_mut(object).unwrap().as_object_mut().unwrap().remove(field).expect("it was there");
    changed
}

fn assert_refused(name: &str, document: &Value, changes: &[(&str, Value)]) {
    for (pointer, value) in changes {
        let changed = with(document, pointer, value.clone());
        assert!(!errors(name, &changed).is_empty(), "{pointer} = {value} is not refused");
    }
}

/// Every object of a document, as its schema sees it, has all its fields and no other.
fn assert_closed(name: &str, document: &Value, objects: &[&str]) {
    for object in objects {
        let fields = document.pointer(object).unwrap().as_object().unwrap().clone();
        for field in fields.keys() {
            let missing = without(document, object, field);
            assert!(!errors(name, &missing).is_empty(), "{object}/{field} may be missing");
        }
        let mut more = document.clone();
        more.pointer_mut(object).unwrap()["colour"] = json!("red");
        assert!(!errors(name, &more).is_empty(), "{object} takes any field");
    }
}

fn record() -> Record {
    Record {
        meshmark_record: meshmark_core::record::VERSION,
        software: "meshmark 0.1.0".into(),
        key_id: "434471506306423b".into(),
        recipient: None,
        message: "095abfcd9510d386660bcc7d0e7b8760".into(),
        whitened: false,
        parameters: Parameters { chip_rate: 2, code: Code::Repetition, ..Parameters::default() },
        layers: None,
        srs: None,
        reference: Reference { vertices: 3833, patches: 7, vertices_sha256: "0f".repeat(32), crs: None },
        displacement: Displacement { rms_m: 0.1, p99_m: 0.2, max_m: 0.3 },
        angles: AngleChange::at(&[
            Corner { at: [0.0; 2], before_deg: 90.0, after_deg: 91.0 },
            Corner { at: [0.0; 2], before_deg: 200.0, after_deg: 190.0 },
        ]),
        areas: Areas { polygons: 1, mean_change: 0.01, p99_change: 0.01, max_change: 0.01 },
        hausdorff: Hausdorff { p99_m: 0.2, max_m: 0.3 },
        validity: Validity { invalid_before: 1, invalid_after: 1, newly_invalid: 0 },
        overlaps: Overlaps { before: 2, after: 2, new: 0, new_area_m2: 0.0, new_slivers: 1 },
        topology: TopologyEntry { t_junctions: 12, attenuated_vertices: 0 },
    }
}

fn json_of(record: &Record) -> Value {
    serde_json::from_str(&record.to_json()).unwrap()
}

#[test]
fn records_are_valid_with_every_field_given_and_with_none() {
    assert_valid("record", &json_of(&record()));
    let full = Record {
        recipient: Some("ACME GmbH".into()),
        parameters: Parameters { precision_crs_units: Some(0.01), ..Parameters::default() },
        layers: Some(vec!["buildings".into(), "roads".into()]),
        srs: Some("EPSG:3067".into()),
        reference: Reference { crs: Some("EPSG:3067".into()), ..record().reference },
        ..record()
    };
    assert_valid("record", &json_of(&full));
}

#[test]
fn the_record_that_the_driver_wrote_is_valid() {
    let text = fs::read_to_string(root().join("fixtures/vectors/record.json")).unwrap();
    assert_valid("record", &serde_json::from_str(&text).unwrap());
}

#[test]
fn the_statement_of_a_deposit_is_valid_and_its_schema_says_what_is_read() {
    let statement = common::deposits::Vendor::new().statement();
    assert_valid("deposit", &statement);
    let objects = [
        "",
        "/subject/0",
        "/subject/0/digest",
        "/predicate",
        "/predicate/references/0",
        "/predicate/marks/0",
        "/predicate/records",
        "/predicate/recipients",
    ];
    assert_closed("deposit", &statement, &objects);
    let changes = [
        ("/predicateType", json!("urn:meshmark:deposit:2")),
        ("/subject", json!([])),
        ("/predicate/key_commitment", json!("434471506306423b")),
        ("/predicate/references/0/vertices", json!(0)),
        ("/predicate/records/merkle_root", json!("F".repeat(64))),
    ];
    assert_refused("deposit", &statement, &changes);
}

#[test]
fn the_record_of_a_fingerprint_is_valid_and_its_schema_says_what_is_read() {
    let text = fs::read_to_string(root().join("fixtures/vectors/fingerprint/record.json")).unwrap();
    let record: Value = serde_json::from_str(&text).unwrap();
    assert_valid("record-2", &record);
    let objects = ["/mark", "/reference", "/copy", "/parts/0", "/angles"];
    assert_closed("record-2", &record, &objects);
    for field in record.as_object().unwrap().keys() {
        assert!(!errors("record-2", &without(&record, "", field)).is_empty(), "{field} may be missing");
    }
    let mut signed = record.clone();
    signed["signature"] = json!({ "ed25519": "00" });
    assert_valid("record-2", &signed);
    assert!(FingerprintRecord::from_json(&signed.to_string()).is_ok());
    let whole = record.clone();
    let mut record = record;
    let first = json!({ "vertices_sha256": "ab".repeat(32), "layers": null, "srs": null, "bases": [] });
    let mut second = first.clone();
    second["vertices_sha256"] = json!("cd".repeat(32));
    second["bases"] = json!(["ab".repeat(32)]);
    second["layers"] = json!(["roads"]);
    second["anchors"] = json!("3");
    record["bases"] = json!([first, second]);
    record["anchors"] = json!("0 3");
    record["census"] = json!({ "standing": 1, "anchored": 2, "attached": 0, "free": 9 });
    assert_valid("record-2", &record);
    assert!(FingerprintRecord::from_json(&record.to_string()).is_ok());
    assert_closed("record-2", &record, &["/bases/0", "/census"]);
    let changes = [
        ("/meshmark_record", json!(1)),
        ("/bases/0/vertices_sha256", json!("00")),
        ("/bases/1/bases", json!(["AB"])),
        ("/bases/1/anchors", json!("3,4")),
        ("/anchors", json!("-1")),
        ("/census/free", json!(-1)),
        ("/recipient", json!(" ")),
        ("/key_commitment", json!("434471506306423b")),
        ("/mark/amplitude_m", json!(0)),
        ("/mark/coefficients", json!(4096)),
        ("/mark/patch_size", json!(15)),
        ("/mark/shape", json!("round")),
        ("/layers", json!([])),
        ("/reference/vertices_sha256", json!("00")),
        ("/copy/file_sha256", json!("00")),
        ("/parts", json!([])),
        ("/parts/0/sha256", json!("00")),
    ];
    assert_refused("record-2", &record, &changes);
    for (pointer, value) in changes {
        let changed = with(&record, pointer, value.clone()).to_string();
        assert!(FingerprintRecord::from_json(&changed).is_err(), "{pointer} = {value} is read");
    }
    let with_parts = |record: &Value, pointer: &str, part_size: u32| {
        let mut changed = record.clone();
        changed.pointer_mut(pointer).unwrap()["part_size"] = json!(part_size);
        assert_eq!(errors("record-2", &changed).is_empty(), part_size > 0);
        FingerprintRecord::from_json(&changed.to_string())
    };
    assert!(with_parts(&whole, "/mark", 90_000).is_ok() && with_parts(&record, "/bases/0", 90_000).is_ok());
    assert!(with_parts(&whole, "/mark", 0).is_err() && with_parts(&record, "/bases/0", 0).is_err());
    let beside = with_parts(&record, "/mark", 90_000).unwrap_err().to_string();
    assert!(beside.contains("cuts into parts a map that rests on others"), "{beside}");
}

/// What `--report` writes, run in the fixtures.
fn report_file(arguments: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.json");
    let mut command = Command::new(env!("CARGO_BIN_EXE_meshmark"));
    command.current_dir(root().join("fixtures")).args(arguments).arg("--report").arg(&path);
    command.output().unwrap();
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn report_files_are_valid_whatever_the_verdict() {
    let key = common::key().display().to_string();
    let verify = ["verify", "--key", &key, "--reference", "kotka.gpkg"];
    let record = ["--record", "vectors/record.json"];
    for arguments in [
        vec![record[0], record[1], "vectors/marked.gpkg"],
        vec![record[0], record[1], "--demodulator", "paper", "vectors/marked.gpkg"],
        vec![record[0], record[1], "kotka.gpkg"],
        vec![record[0], record[1], "helsinki.gpkg"],
        vec![record[0], record[1], "--exact-displacements", "vectors/marked.gpkg"],
        vec!["--records", "vectors", "vectors/marked.gpkg"],
        vec!["--records", "vectors/fingerprint", "vectors/fingerprint/marked.gpkg"],
        vec!["--layers", "buildings,landuse,roads", "--precision", "0.001", "vectors/marked.gpkg"],
    ] {
        let report = report_file(&[&verify[..], &arguments].concat());
        assert_valid("report", &report);
        assert_eq!(report["seconds"], Value::Null);
        let sample = &report["evidence"]["sample"];
        let exact = sample["displacements_m"].as_array().map(Vec::len);
        let matched = sample["matched"].as_array().map(Vec::len);
        let is_asked_for = arguments.contains(&"--exact-displacements");
        assert_eq!(exact, matched.filter(|_| is_asked_for), "{arguments:?}");
        assert_closed(
            "report",
            &report,
            &["/provenance", "/provenance/key", "/evidence", "/evidence/sample"],
        );
    }
}

#[test]
fn the_report_file_of_a_comparison_is_valid() {
    let compare = ["compare", "kotka.gpkg", "vectors/marked.gpkg"];
    let exact = report_file(&[&compare[..], &["--exact-displacements"]].concat());
    assert_valid("compare", &exact);
    assert!(exact["detail"]["moved"].is_array());
    let report = report_file(&compare);
    assert_valid("compare", &report);
    assert_eq!(report["detail"]["moved"], Value::Null);
    assert_closed(
        "compare",
        &report,
        &["/detail", "/detail/provenance", "/detail/topology", "/detail/extent"],
    );
}

/// What the command prints of the test vectors.
fn comparison() -> Value {
    let mut command = Command::new(env!("CARGO_BIN_EXE_meshmark"));
    command.args(["compare", "--json"]);
    command.args(["fixtures/kotka.gpkg", "fixtures/vectors/marked.gpkg"].map(|file| root().join(file)));
    serde_json::from_slice(&command.output().unwrap().stdout).unwrap()
}

#[test]
fn a_comparison_is_valid_and_wrong_ones_are_refused() {
    let comparison = comparison();
    assert_valid("compare", &comparison);
    let objects = comparison.as_object().unwrap().iter().filter(|(_, value)| value.is_object());
    let objects: Vec<String> = objects.map(|(name, _)| format!("/{name}")).collect();
    assert_eq!(objects.len(), 8);
    for object in &objects {
        let fields = comparison.pointer(object).unwrap().as_object().unwrap();
        let negative: Vec<(String, Value)> =
            fields.keys().map(|field| (format!("{object}/{field}"), json!(-1))).collect();
        let negative: Vec<(&str, Value)> = negative.iter().map(|(p, v)| (p.as_str(), v.clone())).collect();
        assert_refused("compare", &comparison, &negative);
    }
    let mut closed = vec![""];
    closed.extend(objects.iter().map(String::as_str));
    assert_closed("compare", &comparison, &closed);
}

#[test]
fn wrong_records_are_refused() {
    let record = json_of(&record());
    let objects = [
        "/reference",
        "/displacement",
        "/angles",
        "/areas",
        "/hausdorff",
        "/validity",
        "/overlaps",
        "/topology",
    ];
    assert_closed("record", &record, &[&[""], &objects[..]].concat());
    let changes = [
        ("/meshmark_record", json!(2)),
        ("/key_id", json!("434471506306423")),
        ("/recipient", json!(" ")),
        ("/message", json!("0")),
        ("/message", json!("xy")),
        ("/message", Value::Null),
        ("/code", Value::Null),
        ("/layers", json!([])),
        ("/layers", json!([""])),
        ("/srs", json!("")),
        ("/reference/vertices", json!(15)),
        ("/reference/patches", json!(0)),
        ("/reference/vertices_sha256", json!("0F".repeat(32))),
        ("/displacement/rms_m", json!(-0.1)),
        ("/displacement/max_m", Value::Null),
        ("/angles/right_angles_kept", json!(1.1)),
        ("/areas/max_change", json!(-0.1)),
        ("/hausdorff/p99_m", Value::Null),
        ("/validity/newly_invalid", json!(0.5)),
        ("/overlaps/new_area_m2", json!(-1)),
        ("/topology/t_junctions", json!(-1)),
        ("/topology/attenuated_vertices", json!(0.5)),
    ];
    assert_refused("record", &record, &changes);
}

/// The ranges are written once more in the schemas, and must be those of the table.
#[test]
fn the_ranges_are_those_of_the_options() {
    let of_message = report("unmarked map", &["--code", "LDPC"]);
    let documents = [("record", "", json_of(&record())), ("report", "/parameters", of_message)];
    // Messages have no parts.
    let of_messages = OPTIONS.iter().filter(|option| option.shapes_mark && option.name != "PART_SIZE");
    for (name, object, document) in documents {
        for option in of_messages.clone() {
            let unit = match option.name {
                "AMPLITUDE" | "TOLERANCE" => "_m",
                "PRECISION" => "_crs_units",
                _ => "",
            };
            let pointer = format!("{object}/{}{unit}", option.name.to_lowercase());
            let (legal, illegal): (Vec<Value>, _) = match option.kind {
                Kind::Text => continue,
                Kind::Choice(words) => {
                    let legal = words.iter().map(|word| json!(word.to_lowercase())).collect();
                    (legal, [json!(words[0]), json!("morse")])
                }
                Kind::Number(above, most) => {
                    (vec![json!(above + 1e-9), json!(most)], [json!(above), json!(most * 1.01)])
                }
                Kind::Integer(least, most) => {
                    (vec![json!(least), json!(most)], [json!(least - 1), json!(most + 1)])
                }
            };
            legal.into_iter().for_each(|value| assert_valid(name, &with(&document, &pointer, value)));
            illegal.into_iter().for_each(|value| assert_refused(name, &document, &[(&pointer, value)]));
        }
    }
}

/// The report of the real program on a suspect, by what it is.
fn report(suspect: &str, flags: &[&str]) -> Value {
    let (report, warnings) = report_and_warnings(suspect, flags);
    assert_eq!(warnings, "");
    report
}

fn report_and_warnings(suspect: &str, flags: &[&str]) -> (Value, String) {
    let file = match suspect {
        "marked map" => "vectors/marked.gpkg",
        "unmarked map" => "kotka.gpkg",
        "another map" => "helsinki.gpkg",
        "map with a fingerprint" => "vectors/fingerprint/marked.gpkg",
        other => panic!("no {other} among the fixtures"),
    };
    let output = Command::new(env!("CARGO_BIN_EXE_meshmark"))
        .current_dir(root().join("fixtures"))
        .args(["verify", "--json", "--reference", "kotka.gpkg", "--key"])
        .arg(common::key())
        .args(flags)
        .arg(file)
        .output()
        .unwrap();
    let warnings = String::from_utf8(output.stderr).unwrap();
    (serde_json::from_slice(&output.stdout).unwrap(), warnings)
}

#[test]
fn reports_are_valid_for_every_verdict_and_both_demodulators() {
    let record = ["--record", "vectors/record.json"];
    for (suspect, flags, verdict) in [
        ("marked map", record.to_vec(), "match"),
        ("marked map", [&record[..], &["--demodulator", "paper"]].concat(), "match"),
        ("unmarked map", record.to_vec(), "no-match"),
        ("another map", record.to_vec(), "inconclusive"),
        ("marked map", vec!["--layers", "buildings,landuse,roads", "--precision", "0.001"], "inconclusive"),
    ] {
        let report = report(suspect, &flags);
        assert_eq!(report["verdict"], verdict, "{suspect} {flags:?}");
        assert_valid("report", &report);
    }
}

#[test]
fn reports_on_fingerprints_are_valid_for_every_verdict_and_hold_no_bits() {
    let record = ["--record", "vectors/fingerprint/record.json"];
    for (suspect, verdict) in
        [("map with a fingerprint", "match"), ("unmarked map", "no-match"), ("another map", "inconclusive")]
    {
        let report = report(suspect, &record);
        assert_eq!(report["verdict"], verdict, "{suspect}");
        assert_valid("report", &report);
        assert_eq!(
            (&report["message"], &report["code"], &report["bits"]),
            (&Value::Null, &Value::Null, &json!([]))
        );
        assert_eq!(report["fingerprint"].is_null(), verdict == "inconclusive");
    }
    let report = report("map with a fingerprint", &record);
    let objects = ["", "/recipient", "/patches", "/recipient_decoys", "/key_decoys"];
    let objects = objects.map(|object| format!("/fingerprint{object}"));
    assert_closed("report", &report, &objects.each_ref().map(String::as_str));
    let changes = [
        ("/fingerprint/recipient/signs", json!(-1)),
        ("/fingerprint/key/p_log10", json!(0.5)),
        ("/fingerprint/patches/clear", json!(0.5)),
        ("/parameters/coefficients", json!(0)),
    ];
    assert_refused("report", &report, &changes);
    assert!(!errors("report", &without(&report, "/parameters", "coefficients")).is_empty());
}

/// vectors/ has one record, and two files that are none.
#[test]
fn reports_on_many_records_are_valid_and_name_others_on_request_alone() {
    let cases = [("marked map", "match"), ("unmarked map", "no-match"), ("another map", "inconclusive")];
    for ((suspect, verdict), is_shown) in cases.into_iter().zip([false, true, false]) {
        let flags: &[&str] = if is_shown { &["--show-recipients"] } else { &[] };
        let (report, warnings) = report_and_warnings(suspect, &[&["--records", "vectors"], flags].concat());
        let Value::Object(candidates) = &report["candidates"] else { panic!("{report}") };
        assert_eq!((&report["verdict"], &candidates["tried"]), (&json!(verdict), &json!(1)));
        assert_eq!((&candidates["skipped"], warnings.lines().count()), (&json!(2), 2), "{warnings}");
        assert_eq!(report.to_string().contains("ACME GmbH"), verdict == "match" || is_shown);
        assert_valid("report", &report);
    }
}

#[test]
fn equal_input_makes_equal_decoys() {
    let decoys = || report("marked map", &["--record", "vectors/record.json"])["decoys"].clone();
    assert_eq!(decoys(), decoys());
    assert!(decoys()["tested"].as_f64().unwrap() > 10.0 * decoys()["largest"].as_f64().unwrap());
}

#[test]
fn wrong_reports_are_refused() {
    let report = report_and_warnings("marked map", &["--records", "vectors"]).0;
    let objects =
        ["", "/code", "/registration", "/vertices", "/left_out", "/parameters", "/decoys", "/candidates"];
    assert_closed("report", &report, &objects);
    assert_closed("report", &report, &["/candidates/list/0"]);
    let changes = [
        ("/meshmark_report", json!("1")),
        ("/verdict", json!("no match")),
        ("/verdict", json!("MATCH")),
        ("/reason", json!("")),
        ("/message", json!("ABCD")),
        ("/bits/0", Value::Null),
        ("/bit_errors", json!(-1)),
        ("/code/channel_bit_errors", json!(1025)),
        ("/code/parity_holds", json!("yes")),
        ("/code/decoder", json!("guess")),
        ("/p_value_log10", json!(0.5)),
        ("/p_mark_log10", json!("-inf")),
        ("/p_any_message_log10", json!(1)),
        ("/candidates/tried", json!(0)),
        ("/candidates/list", json!([])),
        ("/candidates/list/0/p_value_log10", json!(0.5)),
        ("/decoys/count", json!(1)),
        ("/decoys/seed", json!("0F")),
        ("/decoys/standard_deviation", json!(-1)),
        ("/registration/affine", json!([1, 0, 0, 0, 1])),
        ("/registration/rms_m", json!(-0.1)),
        ("/registration/read_as", json!({ "crs": "EPSG:3857" })),
        ("/registration/read_as", json!({ "crs": "", "axes_swapped": false })),
        (
            "/registration/polynomial",
            json!({ "centre": [0, 0], "scale": 1, "x": vec![0; 9], "y": vec![0; 10] }),
        ),
        (
            "/registration/polynomial",
            json!({ "centre": [0, 0], "scale": 0, "x": vec![0; 10], "y": vec![0; 10] }),
        ),
        ("/vertices/matched", json!(1.5)),
        ("/left_out/features", json!(-1)),
        ("/left_out/named", json!([""])),
        ("/parameters/demodulator", json!("best")),
        ("/parameters/crs_source", json!("file")),
        ("/parameters/crs_of_reference", json!("")),
        ("/parameters/significance", json!(1)),
        ("/parameters/radius_m", json!(0)),
        ("/parameters/observations", json!("edges")),
        ("/seconds/reading", json!(-1)),
    ];
    assert_refused("report", &report, &changes);
    assert!(!errors("report", &with(&report, "/seconds", json!({}))).is_empty());
    let unknown_stage = with(&report, "/seconds", json!({ "painting": 1 }));
    assert!(!errors("report", &unknown_stage).is_empty());
}
