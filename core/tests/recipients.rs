//! The names of recipients: which a new mark may have, which look alike, and that copies keep theirs.

use meshmark_core::{
    options::{Options, RecipientFault, check_recipients, composed, recipient_fault},
    recorded::Recorded,
};

#[test]
fn a_name_has_no_line_break_and_no_blanks_around_it() {
    for name in ["ACME\nGmbH", "ACME\r", "AC\u{2028}ME", "AC\0ME"] {
        assert_eq!(recipient_fault(name), Some(RecipientFault::Control), "{name:?}");
    }
    for name in [" ACME", "ACME ", "\u{a0}ACME", "ACME\u{3000}"] {
        assert_eq!(recipient_fault(name), Some(RecipientFault::Blanks), "{name:?}");
    }
    for name in ["ACME GmbH", "Öster & Söhne", "宮城県", "AC\u{200b}ME"] {
        assert_eq!(recipient_fault(name), None, "{name:?}");
    }
}

#[test]
fn copies_that_were_marked_with_another_name_are_still_verified() {
    let vectors = concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/vectors");
    for name in [" ACME", "ACME\nGmbH"] {
        assert!(Options::parse([("RECIPIENT", name)]).is_ok(), "{name:?}");
        assert!(Options::parse_for_marking([("RECIPIENT", name)]).is_err(), "{name:?}");
        let changed = |file: &str| {
            let text = std::fs::read_to_string(format!("{vectors}/{file}")).unwrap();
            let changed = text.replace("\"ACME GmbH\"", &serde_json::to_string(name).unwrap());
            Recorded::from_json(&changed).unwrap().options().unwrap().text_of("RECIPIENT")
        };
        for file in ["record.json", "fingerprint/record.json"] {
            assert_eq!(changed(file).as_deref(), Some(name), "{file}");
        }
    }
}

#[test]
fn two_spellings_of_one_name_are_noticed_and_one_name_twice_is_not() {
    let [one, two] = ["Caf\u{e9}", "Cafe\u{301}"];
    assert_eq!([composed(one), composed(two)], [one, one]);
    assert!(check_recipients(&[one, "Cafe", one]).is_ok() && check_recipients(&[two]).is_ok());
    let alike = check_recipients(&[one, two]).unwrap_err().to_string();
    assert!(alike.contains("is there in two spellings"), "{alike}");
    let blank = check_recipients(&["ACME "]).unwrap_err().to_string();
    assert_eq!(blank, "RECIPIENT=ACME  begins or ends with a blank: remove it");
}
