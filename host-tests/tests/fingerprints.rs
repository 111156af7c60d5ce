//! Copies for recipients as the driver makes them: each names its own recipient, and a mixture names
//! all of them.

use meshmark_host_tests::{
    attacks::{Map, collusion::Mixture},
    plugin::Host,
};
use serde_json::Value;

const RECIPIENTS: [&str; 4] = ["ACME GmbH", "Other Ltd", "Third SARL", "Österreich & Söhne"];

/// A map, and a copy and a record of each recipient.
fn copies() -> Host {
    let host = Host::new();
    host.copy("kotka.gpkg", "map.gpkg");
    std::fs::create_dir(host.path("records")).unwrap();
    for (number, recipient) in RECIPIENTS.iter().enumerate() {
        let options = [
            "KEY=key.json".to_string(),
            format!("RECIPIENT={recipient}"),
            format!("RECORD=records/{number}.json"),
        ];
        let options = options.each_ref().map(|option| ["-oo", option.as_str()]);
        let copy = format!("{number}.gpkg");
        let command = ["-f", "GPKG", copy.as_str(), "MESHMARK:map.gpkg"];
        host.run("ogr2ogr", &[&command[..], options.as_flattened()].concat()).succeeds();
    }
    host
}

fn matching(report: &Value) -> Vec<&str> {
    let significance = report["parameters"]["significance"].as_f64().unwrap().log10();
    let list = report["candidates"]["list"].as_array().unwrap().iter();
    let matching = list.filter(|entry| entry["p_value_log10"].as_f64().unwrap() < significance);
    let mut names: Vec<&str> = matching.map(|entry| entry["recipient"].as_str().unwrap()).collect();
    names.sort_unstable();
    names
}

#[test]
fn a_copy_names_its_recipient_and_an_average_all_members() {
    let host = copies();
    for (record, code) in [("records/0.json", 0), ("records/1.json", 1)] {
        let (run, report) = host.verify("map.gpkg", &["--record", record, "0.gpkg"]);
        assert_eq!(run.code, Some(code), "{}", run.stdout);
        assert!(report["message"].is_null() && report["fingerprint"]["key"]["signs"].as_u64().unwrap() > 0);
    }
    let (run, report) = host.verify("map.gpkg", &["--records", "records", "0.gpkg"]);
    assert_eq!((run.code, matching(&report)), (Some(0), vec!["ACME GmbH"]), "{}", run.stdout);
    let members: Vec<Map> = (0..3).map(|n| Map::read(&host.path(&format!("{n}.gpkg"))).unwrap()).collect();
    Mixture::Average.mix(&members, 1).unwrap().write(&host.path("average.gpkg")).unwrap();
    let (run, report) = host.verify("map.gpkg", &["--records", "records", "average.gpkg"]);
    assert_eq!((run.code, matching(&report)), (Some(0), RECIPIENTS[..3].to_vec()), "{}", run.stdout);
    assert_eq!(report["candidates"]["tried"], 4);
}

/// The middle of the places along x.
fn middle(places: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    (low + high) / 2.0
}

#[test]
fn a_mosaic_is_drawn_by_whose_copy_each_part_comes_from() {
    let host = copies();
    let [west, east] = ["0.gpkg", "1.gpkg"].map(|name| Map::read(&host.path(name)).unwrap());
    let border = middle(west.coords().map(|[x, _]| x));
    let mut of_east = east.coords();
    let mosaic = west.map_coords(|own| {
        let other = of_east.next().unwrap();
        if own[0] < border { own } else { other }
    });
    mosaic.write(&host.path("mosaic.gpkg")).unwrap();
    let files = ["--report", "report.json", "--evidence-map", "evidence.gpkg", "mosaic.gpkg"];
    host.matches("map.gpkg", &[&["--records", "records"], &files[..]].concat());
    let report: Value = serde_json::from_slice(&std::fs::read(host.path("report.json")).unwrap()).unwrap();
    let evidence = &report["evidence"];
    let members: Vec<&str> =
        evidence["members"].as_array().unwrap().iter().map(|m| m["recipient"].as_str().unwrap()).collect();
    assert_eq!(members, RECIPIENTS[..2]);
    let patches = evidence["patches"].as_array().unwrap().iter();
    let mut sides = [0; 2];
    for (patch, owner) in patches.zip(evidence["patch_members"].as_array().unwrap()) {
        let xs = || patch["outline"].as_array().unwrap().iter().map(|place| place[0].as_f64().unwrap());
        let side = usize::from(middle(xs()) > border);
        let is_crossed = xs().any(|x| x < border) && xs().any(|x| x > border);
        assert!(is_crossed || owner.as_u64() == Some(side as u64), "{patch} {owner}");
        sides[side] += usize::from(!is_crossed);
    }
    assert!(sides[0] > 0 && sides[1] > 0, "{sides:?}");

    let query = "SELECT recipient FROM patches ORDER BY patch";
    let run = host.run("ogrinfo", &["-q", "-sql", query, "evidence.gpkg"]).succeeds();
    let named = |name: &str| run.stdout.matches(&format!("= {name}")).count();
    let owned = |number: u64| {
        let owners = evidence["patch_members"].as_array().unwrap().iter();
        owners.filter(|owner| owner.as_u64() == Some(number)).count()
    };
    assert_eq!([named(RECIPIENTS[0]), named(RECIPIENTS[1])], [owned(0), owned(1)], "{}", run.stdout);

    let page = ["--records", "records", "--report", "report.html", "mosaic.gpkg"];
    host.matches("map.gpkg", &page);
    let page = std::fs::read_to_string(host.path("report.html")).unwrap();
    assert!(page.contains("Whose copies were mixed.") && page.contains("<b>B</b>"));
    // A single copy has one member and nothing to tell apart.
    host.matches("map.gpkg", &["--records", "records", "--report", "single.html", "0.gpkg"]);
    let page = std::fs::read_to_string(host.path("single.html")).unwrap();
    assert!(!page.contains("Whose copies were mixed."));
}

#[test]
fn every_mixture_of_copies_names_its_members_and_nobody_else() {
    let host = copies();
    let members: Vec<Map> = (0..3).map(|n| Map::read(&host.path(&format!("{n}.gpkg"))).unwrap()).collect();
    for (mixture, name) in Mixture::ALL {
        let suspect = format!("{name}.gpkg");
        mixture.mix(&members, 1).unwrap().write(&host.path(&suspect)).unwrap();
        let (run, report) = host.verify("map.gpkg", &["--records", "records", &suspect]);
        assert_eq!(
            (run.code, matching(&report)),
            (Some(0), RECIPIENTS[..3].to_vec()),
            "{name}: {}",
            run.stdout
        );
    }
}

#[test]
fn records_of_both_versions_are_tried_together() {
    let host = copies();
    let options = ["-oo", "CODE=LDPC", "-oo", "RECORD=records/message.json"];
    host.mark("GPKG", "message.gpkg", "map.gpkg", &options).succeeds();
    for (suspect, record) in [("message.gpkg", "message.json"), ("3.gpkg", "3.json")] {
        let (run, report) = host.verify("map.gpkg", &["--records", "records", suspect]);
        assert_eq!(run.code, Some(0), "{}", run.stdout);
        assert_eq!(report["candidates"]["tried"], 5);
        assert_eq!(report["candidates"]["list"][0]["record"], record);
        assert_eq!(report["fingerprint"].is_object(), suspect == "3.gpkg");
    }
}

#[test]
fn the_record_of_an_export_has_the_digests_of_reference_and_copy() {
    let host = Host::new();
    host.copy("kotka.gpkg", "map.gpkg");
    host.create("out.gpkg", "map.gpkg", &[]).succeeds();
    let record: Value = serde_json::from_slice(&std::fs::read(host.path("record.json")).unwrap()).unwrap();
    let digest = |file: &str| host.run("sha256sum", &[file]).succeeds().stdout[..64].to_string();
    assert_eq!(record["meshmark_record"], 2);
    assert_eq!(record["reference"]["file_sha256"], digest("ref.gpkg").as_str());
    assert_eq!(record["copy"]["file_sha256"], digest("out.gpkg").as_str());
    host.matches("ref.gpkg", &["--record", "record.json", "out.gpkg"]);
}

#[test]
fn every_owner_is_found_in_a_map_that_was_taken_and_marked_again_three_times() {
    let host = Host::new();
    host.copy("kotka.gpkg", "0.gpkg");
    let owners = ["the first", "a thief", "a second thief", "a third thief"];
    let command = host.meshmark();
    let command = command.to_str().unwrap();
    for (number, owner) in owners.iter().enumerate() {
        host.run(command, &["keygen", &format!("{number}.json")]).succeeds();
        let options = [
            format!("KEY={number}.json"),
            format!("RECIPIENT=the customer of {owner}"),
            format!("RECORD={number}-record.json"),
        ];
        let options = options.each_ref().map(|option| ["-oo", option.as_str()]);
        let (source, copy) = (format!("MESHMARK:{number}.gpkg"), format!("{}.gpkg", number + 1));
        let files = ["-f", "GPKG", copy.as_str(), source.as_str()];
        host.run("ogr2ogr", &[&files[..], options.as_flattened()].concat()).succeeds();
    }
    for (number, owner) in owners.iter().enumerate() {
        let [key, record] = [format!("{number}.json"), format!("{number}-record.json")];
        let reference = format!("{number}.gpkg");
        let of_owner = ["--key", &key, "--reference", &reference, "--record", &record, "4.gpkg"];
        let run = host.run(command, &[&["verify", "--json"][..], &of_owner].concat());
        let report: Value = serde_json::from_str(&run.stdout).unwrap();
        assert_eq!(run.code, Some(0), "{owner}: {}", run.stdout);
        assert!(report["p_value_log10"].as_f64().unwrap() < -12.0, "{owner}: {}", report["p_value_log10"]);
    }
}
