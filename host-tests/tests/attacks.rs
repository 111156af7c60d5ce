//! A map that the driver marks inside ogr2ogr is attacked, and `meshmark verify` names its
//! recipient.
//!
//! The test makes a few attacks on one map; the command `table2` makes all of them.

use meshmark_host_tests::{
    experiment::{Outcome, Plan, bit_error_percent, is_match, run},
    product::{Product, Profile},
};
use std::{path::Path, sync::OnceLock};

/// Attacks that a mark of the default strength must survive on this map.
const SURVIVED: [&str; 10] =
    ["4b", "5", "7", "9b", "10-3", "dp0.25", "vertices50", "features50", "geojson", "merge"];
/// The attacks among these that are also made on the coded message.
const CODED: [&str; 3] = ["5", "9b", "vertices50"];
const OTHERS: [&str; 4] = ["6", "unmarked", "again", "average2"];

fn outcomes() -> &'static [Outcome] {
    static OUTCOMES: OnceLock<Vec<Outcome>> = OnceLock::new();
    OUTCOMES.get_or_init(|| {
        let map = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/kotka.gpkg"));
        let plan = Plan {
            maps: vec![map.into()],
            profiles: vec![Profile::repetition(2), Profile::LDPC],
            wanted: Box::new(|case, profile| match profile {
                Profile::LDPC => CODED.contains(&case.id().as_str()),
                _ => SURVIVED.iter().chain(&OTHERS).any(|id| *id == case.id()),
            }),
            seed: 2003,
            workers: 2,
            keep: None,
        };
        run(&Product::of_this_build().unwrap(), &plan, |_| ()).unwrap()
    })
}

fn of_case(id: &str) -> impl Iterator<Item = &'static Outcome> {
    let of_case: Vec<&Outcome> =
        outcomes().iter().filter(|o| o.case == id && o.profile != Profile::LDPC).collect();
    assert!(!of_case.is_empty(), "case {id} was not run");
    of_case.into_iter()
}

#[test]
fn the_recipient_is_found_after_every_one_of_these_attacks() {
    for outcome in SURVIVED.into_iter().flat_map(of_case) {
        assert!(is_match(outcome), "{outcome:?}");
        assert!(bit_error_percent(outcome).unwrap() < 5.0, "{outcome:?}");
    }
}

#[test]
fn a_coded_message_comes_back_whole() {
    let coded: Vec<&Outcome> = outcomes().iter().filter(|o| o.profile == Profile::LDPC).collect();
    assert_eq!(coded.len(), CODED.len());
    for outcome in coded {
        assert!(is_match(outcome) && outcome.bit_errors == Some(0), "{outcome:?}");
    }
}

#[test]
fn a_local_deformation_costs_bits_but_not_the_verdict() {
    for outcome in of_case("6") {
        assert!(is_match(outcome), "{outcome:?}");
        assert!(bit_error_percent(outcome).unwrap() < 20.0, "{outcome:?}");
    }
}

#[test]
fn nobody_is_found_in_a_map_that_was_never_marked() {
    for outcome in of_case("unmarked") {
        assert_eq!(outcome.verdict.as_deref(), Some("no-match"), "{outcome:?}");
    }
}

#[test]
fn a_second_mark_hides_neither_itself_nor_the_first() {
    assert_eq!(of_case("again").count(), 4, "two questions, two demodulators");
    assert!(of_case("again").all(is_match));
}

#[test]
fn two_recipients_who_average_their_copies_are_both_found_and_nobody_else() {
    for outcome in of_case("average2") {
        assert_eq!(is_match(outcome), outcome.guilty, "{outcome:?}");
    }
}
