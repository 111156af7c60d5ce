//! Maps are marked with `ogr2ogr`, changed as users change them, and verified with `meshmark
//! verify`.

use gdal::spatial_ref::SpatialRef;
use geo::CoordsIter;
use meshmark_core::message::Message;
use meshmark_host_tests::{
    attacks::{Map, deformation, features, outlines::Outline, reproject, similarity},
    plugin::{Host, library},
};
use serde_json::{Value, json};

/// Returns a host with a map and its copy for ACME GmbH.
fn marked(fixture: &str, options: &[&str]) -> Host {
    let host = Host::new();
    host.copy(fixture, "map.gpkg");
    let mut with_record = vec!["-oo", "RECORD=acme.json"];
    with_record.extend(options);
    host.mark("GPKG", "marked.gpkg", "map.gpkg", &with_record).succeeds();
    host
}

#[test]
fn the_message_is_read_without_a_record() {
    let host =
        marked("helsinki.gpkg", &["-oo", "PATCH_SIZE=600", "-oo", "CHIP_RATE=2", "-oo", "AMPLITUDE=0.08"]);
    let how = ["--patch-size", "600", "--chip-rate", "2", "--amplitude", "0.08"];
    host.matches("map.gpkg", &[&how[..], &["--recipient", "ACME GmbH", "marked.gpkg"]].concat());
    let message = host.key().recipient_message("ACME GmbH").to_hex();
    let report = host.matches("map.gpkg", &[&how[..], &["--message", &message, "marked.gpkg"]].concat());
    assert_eq!(report["message"], message.as_str());

    // Without an expected message, the message is decoded nevertheless, and nobody is accused.
    let (run, report) = host.verify("map.gpkg", &[&how[..], &["marked.gpkg"]].concat());
    assert_eq!((run.code, &report["verdict"]), (Some(3), &Value::from("inconclusive")));
    assert_eq!(report["message"], message.as_str());
    assert!(report["bit_errors"].is_null() && report["p_value_log10"].is_null());
}

/// Makes a copy as before the introduction of whitening: the key whitens its message to these bits,
/// and its record has no field for whitening.
fn mark_unwhitened(host: &Host, bits: &str, name: &str) {
    let message = host.key().unwhitened(&Message::from_hex(bits).unwrap()).to_hex();
    let (copy, path) = (format!("{name}.gpkg"), format!("{name}.json"));
    let options = ["KEY=key.json", &format!("MESSAGE={message}"), &format!("RECORD={path}")];
    let options = options.map(|option| ["-oo", option]);
    host.run("ogr2ogr", &[&["-f", "GPKG", &copy, "MESHMARK:map.gpkg"][..], options.as_flattened()].concat())
        .succeeds();
    let text = std::fs::read(host.path(&path)).unwrap();
    let mut record: Value = serde_json::from_slice(&text).unwrap();
    assert_eq!(record["whitened"].take(), true);
    let fields = record.as_object_mut().unwrap();
    fields.remove("whitened");
    fields.insert("message".into(), bits.into());
    std::fs::write(host.path(&path), record.to_string()).unwrap();
}

#[test]
fn a_serial_number_names_its_own_copy_alone() {
    for digits in [16, 32] {
        for whitened in [true, false] {
            let host = Host::new();
            host.copy("helsinki.gpkg", "map.gpkg");
            std::fs::create_dir(host.path("records")).unwrap();
            for number in 1..=3 {
                let (message, name) = (format!("{number:0digits$x}"), format!("records/{number}"));
                if !whitened {
                    mark_unwhitened(&host, &message, &name);
                    continue;
                }
                let options =
                    ["KEY=key.json".to_string(), format!("MESSAGE={message}"), format!("RECORD={name}.json")];
                let options = options.each_ref().map(|option| ["-oo", option.as_str()]);
                let copy = format!("{name}.gpkg");
                let command = ["-f", "GPKG", copy.as_str(), "MESHMARK:map.gpkg"];
                host.run("ogr2ogr", &[&command[..], options.as_flattened()].concat()).succeeds();
            }
            let suspect = "records/1.gpkg";
            let of = |how: &[&str]| host.verify("map.gpkg", &[how, &[suspect]].concat());
            let own = host.matches("map.gpkg", &["--record", "records/1.json", suspect]);
            assert_eq!(own["message"], format!("{:0digits$x}", 1).as_str());
            let null = if whitened { "random-message" } else { "any-other-message" };
            assert_eq!(own["null_hypothesis"], null);
            for other in ["records/2.json", "records/3.json"] {
                let (run, report) = of(&["--record", other]);
                assert_eq!((run.code, &report["verdict"]), (Some(1), &Value::from("no-match")), "{report}");
                assert!(report["p_value_log10"].as_f64().unwrap() > -3.0, "{report}");
            }
            let (_, report) = of(&["--records", "records"]);
            let p = |entry: &Value| entry["p_value_log10"].as_f64().unwrap();
            let list = report["candidates"]["list"].as_array().unwrap();
            assert_eq!(list[0]["record"], "1.json");
            assert!(p(&list[0]) < -6.0 && list[1..].iter().all(|entry| p(entry) > -3.0), "{list:?}");
            // Without a record, the message may be of either kind.
            let own = host.matches("map.gpkg", &["--message", &format!("{:0digits$x}", 1), suspect]);
            assert_eq!(own["null_hypothesis"], null);
            let (run, _) = of(&["--message", &format!("{:0digits$x}", 2)]);
            assert_eq!(run.code, Some(1));
        }
    }
}

/// Returns the code and the chip rate of a report or a record.
fn code_of(document: &Value) -> (&str, u64) {
    (document["code"].as_str().unwrap(), document["chip_rate"].as_u64().unwrap())
}

fn record(host: &Host) -> Value {
    serde_json::from_slice(&std::fs::read(host.path("acme.json")).unwrap()).unwrap()
}

#[test]
fn the_message_of_a_recipient_is_read_with_a_record_and_without() {
    let host = marked("kotka.gpkg", &["-oo", "CODE=LDPC"]);
    assert_eq!(code_of(&record(&host)), ("ldpc", 1));
    let message = host.key().recipient_message("ACME GmbH").to_hex();
    let of_recipient = ["--code", "ldpc", "--recipient", "ACME GmbH"];
    for how in [&["--record", "acme.json"][..], &of_recipient, &["--message", &message]] {
        let report = host.matches("map.gpkg", &[how, &["marked.gpkg"]].concat());
        assert_eq!(code_of(&report["parameters"]), ("ldpc", 1));
        assert_eq!(report["code"]["parity_holds"], true);
        assert_eq!(report["code"]["decoder"], "belief-propagation");
        assert_eq!(report["bits"].as_array().unwrap().len(), 128);
    }
    // Under another code the mark of the key shows, but its bits make no whole message.
    let repeated = ["--code", "repetition", "--recipient", "ACME GmbH", "marked.gpkg"];
    let (run, report) = host.verify("map.gpkg", &repeated);
    assert_eq!((run.code, &report["verdict"]), (Some(3), &Value::from("inconclusive")));
    assert!(report["reason"].as_str().unwrap().contains("made with another code"), "{}", report["reason"]);
}

#[test]
fn a_message_of_another_length_is_repeated_by_default() {
    let host = Host::new();
    host.copy("kotka.gpkg", "map.gpkg");
    let options =
        ["KEY=key.json", "RECORD=acme.json", "MESSAGE=0123456789abcdef"].map(|option| ["-oo", option]);
    let arguments =
        [&["-f", "GPKG", "marked.gpkg", "MESHMARK:map.gpkg"][..], options.as_flattened()].concat();
    host.run("ogr2ogr", &arguments).succeeds();
    assert_eq!(code_of(&record(&host)), ("repetition", 2));
    for how in [["--record", "acme.json"], ["--message", "0123456789abcdef"]] {
        let report = host.matches("map.gpkg", &[&how[..], &["marked.gpkg"]].concat());
        assert_eq!(code_of(&report["parameters"]), ("repetition", 2));
    }
}

#[test]
fn a_code_that_is_given_is_the_one_of_the_mark() {
    let host = marked("helsinki.gpkg", &["-oo", "CODE=REPETITION"]);
    assert_eq!(code_of(&record(&host)), ("repetition", 2));
    let how = ["--code", "repetition", "--recipient", "ACME GmbH"];
    for how in [&["--record", "acme.json"][..], &how] {
        let report = host.matches("map.gpkg", &[how, &["marked.gpkg"]].concat());
        assert_eq!(code_of(&report["parameters"]), ("repetition", 2));
    }
}

#[test]
fn a_person_reads_how_the_message_was_decoded() {
    let host = marked("kotka.gpkg", &["-oo", "CODE=LDPC"]);
    let command = library().with_file_name("meshmark");
    let arguments =
        ["verify", "--explain", "--key", "key.json", "--reference", "map.gpkg", "--record", "acme.json"];
    let text_of =
        |suspect| host.run(command.to_str().unwrap(), &[&arguments[..], &[suspect]].concat()).stdout;
    let text = text_of("marked.gpkg");
    let decoded = "0 of 256 code bits were wrong; read by belief propagation, all parity checks hold";
    assert!(text.contains("(0 of 128 bits differ from the expected message)\ncode:         "), "{text}");
    assert!(text.contains(&format!("code:         {decoded}\n")), "{text}");
    assert!(text.contains(&format!("How it was decoded: {decoded}.\n")), "{text}");
    // Without a mark, there is nothing to decode.
    let text = text_of("map.gpkg");
    assert!(text.contains("NO MATCH") && !text.contains("code bits"), "{text}");
}

#[test]
fn one_layer_of_many_can_be_marked_and_verified() {
    let host = marked("helsinki.gpkg", &["-oo", "LAYERS=buildings,roads"]);
    let report = host.matches("map.gpkg", &["--record", "acme.json", "marked.gpkg"]);
    assert_eq!(report["parameters"]["layers"], serde_json::json!(["buildings", "roads"]));
}

#[test]
fn a_map_in_degrees_is_marked_and_read_in_metres() {
    let host = marked("europe_deg.gpkg", &[]);
    let report = host.matches("map.gpkg", &["--record", "acme.json", "marked.gpkg"]);
    let rms_m = report["registration"]["rms_m"].as_f64().unwrap();
    assert!((0.05..0.15).contains(&rms_m), "{rms_m}");
}

#[test]
fn points_z_m_curves_and_surfaces_carry_a_message() {
    let host = marked("shapes.gpkg", &[]);
    host.matches("map.gpkg", &["--record", "acme.json", "marked.gpkg"]);
}

#[test]
fn shuffled_features_carry_the_message() {
    let host = marked("helsinki.gpkg", &[]);
    let map = Map::read(&host.path("marked.gpkg")).unwrap();
    features::scramble(&map, 5).write(&host.path("shuffled.gpkg")).unwrap();
    host.matches("map.gpkg", &["--record", "acme.json", "shuffled.gpkg"]);
}

#[test]
fn a_translated_rotated_scaled_copy_is_found_by_its_landmarks() {
    let host = marked("helsinki.gpkg", &[]);
    let map = Map::read(&host.path("marked.gpkg")).unwrap();
    let turned = similarity::linear(&map, similarity::rotation(45.0), similarity::About::Corner).unwrap();
    let scaled =
        similarity::linear(&turned, similarity::scaling(5.5, 5.5), similarity::About::Corner).unwrap();
    similarity::translate(&scaled, [1000.0, -500.0]).write(&host.path("moved.gpkg")).unwrap();
    for landmark in [&[][..], &["--landmark", "name", "--landmark", "osm_id"][..]] {
        let report = host.matches("map.gpkg", &[landmark, &["--record", "acme.json", "moved.gpkg"]].concat());
        assert_eq!(report["registration"]["method"], "landmarks");
        assert!(report["registration"]["landmarks"].as_u64().unwrap() > 50);
        assert!(report["registration"]["rms_m"].as_f64().unwrap() < 0.12);
    }
}

#[test]
fn landmarks_are_fields_of_the_reference_and_match_any_field_of_the_suspect_by_value() {
    let host = marked("helsinki.gpkg", &[]);
    let map = Map::read(&host.path("marked.gpkg")).unwrap();
    similarity::translate(&map, [1000.0, -500.0]).write(&host.path("moved.gpkg")).unwrap();
    let renamed = "SELECT osm_id AS objectnumber FROM buildings"; // and then cut to ten characters
    host.run("ogr2ogr", &["renamed.shp", "moved.gpkg", "-dialect", "OGRSQL", "-sql", renamed]).succeeds();
    let more =
        ["--landmark", "osm_id", "--registration", "landmarks", "--record", "acme.json", "renamed.shp"];
    let report = host.matches("map.gpkg", &more);
    assert!(report["registration"]["landmarks"].as_u64().unwrap() > 50);
}

#[test]
fn the_paper_counts_only_the_vertices_within_the_radius() {
    let host = marked("helsinki.gpkg", &["-oo", "CODE=LDPC"]);
    let map = Map::read(&host.path("marked.gpkg")).unwrap();
    let bent = deformation::deform(&map, deformation::Cell::Share(4), 1.0, deformation::Side::Cell).unwrap();
    bent.write(&host.path("bent.gpkg")).unwrap();
    let matched = |demodulator: &str| {
        let how = ["--record", "acme.json", "--demodulator", demodulator, "bent.gpkg"];
        host.verify("map.gpkg", &how).1["vertices"]["matched"].as_u64().unwrap()
    };
    let (paper, joint) = (matched("paper"), matched("joint"));
    assert!(0 < paper && paper < joint, "{paper} {joint}: the joint demodulator follows the deformation");
}

#[test]
fn a_suspect_in_another_crs_is_reprojected() {
    let host = marked("helsinki.gpkg", &[]);
    for srs in ["EPSG:4326", "EPSG:3857", "EPSG:2393"] {
        host.run("ogr2ogr", &["-t_srs", srs, "other.gpkg", "marked.gpkg", "-overwrite"]);
        host.matches("map.gpkg", &["--record", "acme.json", "other.gpkg"]);
    }
}

/// Writes the marked map in an EPSG CRS, perhaps with y before x, and labels it with another CRS or
/// none.
fn mislabelled(host: &Host, epsg: u32, swapped: bool, label: Option<u32>) {
    let mut map = reproject::reproject(&Map::read(&host.path("marked.gpkg")).unwrap(), epsg, None).unwrap();
    if swapped {
        map = map.map_coords(|[x, y]| [y, x]);
    }
    let label = label.map(|epsg| SpatialRef::from_epsg(epsg).unwrap().to_wkt().unwrap());
    map.layers.iter_mut().for_each(|layer| layer.crs = label.clone());
    let _ = std::fs::remove_file(host.path("suspect.gpkg"));
    map.write(&host.path("suspect.gpkg")).unwrap();
}

/// Returns the entry of the report for these coordinates. EPSG:3067, the CRS of the reference, is
/// UTM zone 35 by another name.
fn read_as(epsg: u32, swapped: bool) -> Value {
    let epsg = if epsg == 32635 { 3067 } else { epsg };
    json!({ "crs": format!("EPSG:{epsg}"), "axes_swapped": swapped })
}

#[test]
fn a_missing_crs_is_found_among_the_likely_ones() {
    let host = marked("kotka.gpkg", &[]);
    // These are degrees, web maps, UTM, and Finland's older grid and GK27 grid.
    for epsg in [4326, 3857, 32635, 2393, 3881] {
        for swapped in [false, true] {
            mislabelled(&host, epsg, swapped, None);
            let report = host.matches("map.gpkg", &["--record", "acme.json", "suspect.gpkg"]);
            assert_eq!(report["registration"]["read_as"], read_as(epsg, swapped));
            assert_eq!(report["registration"]["method"], "identity");
        }
    }
    mislabelled(&host, 3067, false, None);
    let report = host.matches("map.gpkg", &["--record", "acme.json", "suspect.gpkg"]);
    assert_eq!(report["registration"]["read_as"]["crs"], "EPSG:3067");
}

#[test]
fn a_wrong_crs_is_seen_and_the_right_one_found() {
    let host = marked("kotka.gpkg", &[]);
    for (epsg, swapped, label) in [
        (3067, false, 4326),
        (4326, false, 3857),
        (3857, false, 3067),
        (32635, false, 32636),
        (4326, true, 4326),
        (2393, false, 3067),
    ] {
        mislabelled(&host, epsg, swapped, Some(label));
        let report = host.matches("map.gpkg", &["--record", "acme.json", "suspect.gpkg"]);
        assert_eq!(report["registration"]["read_as"], read_as(epsg, swapped), "labelled EPSG:{label}");
    }
}

#[test]
fn the_assumed_crs_is_told_to_people_too() {
    let host = marked("kotka.gpkg", &[]);
    mislabelled(&host, 4326, true, None);
    let command = library().with_file_name("meshmark");
    let arguments = ["verify", "--explain", "--key", "key.json", "--reference", "map.gpkg", "suspect.gpkg"];
    let text = host.run(command.to_str().unwrap(), &arguments).stdout;
    assert!(text.contains("registration: identity, read as EPSG:4326 with x and y exchanged"), "{text}");
    let sentence = "The suspect has no CRS; its coordinates were read as EPSG:4326 with x and y exchanged.";
    assert!(text.contains(sentence), "{text}");
}

#[test]
fn a_suspect_without_anything_or_elsewhere_is_inconclusive() {
    let host = marked("kotka.gpkg", &[]);
    let map = Map::read(&host.path("marked.gpkg")).unwrap();
    let mut empty = map.clone();
    empty.layers.iter_mut().for_each(|layer| layer.features.clear());
    let elsewhere = features::drop_attributes(&Map::read(&host.path("map.gpkg")).unwrap());
    let few =
        elsewhere.map_geometries(|geometry| geometry.coords_iter().next().map(|c| geo::Point(c).into()));
    let few = features::delete(&similarity::translate(&few, [5e4, 5e4]), 0.9, 1);
    for (suspect, file) in [(empty, "empty.gpkg"), (few, "few_points_elsewhere.gpkg")] {
        suspect.write(&host.path(file)).unwrap();
        for registration in ["auto", "landmarks", "geometry", "none"] {
            let flags = ["--record", "acme.json", "--registration", registration, file];
            let (run, report) = host.verify("map.gpkg", &flags);
            assert_eq!(
                (run.code, &report["verdict"]),
                (Some(3), &Value::from("inconclusive")),
                "{}",
                run.stderr
            );
            let reason = report["reason"].as_str().unwrap();
            assert!(reason.contains("nothing to compare") || reason.contains("another map"), "{report}");
        }
    }
}

#[test]
fn vertices_as_points_carry_the_message() {
    let host = marked("kotka.gpkg", &[]);
    let map = Map::read(&host.path("marked.gpkg")).unwrap();
    let points = |geometry: &geo::Geometry| {
        let points = geometry.coords_iter().map(geo::Point::from).collect();
        Some(geo::MultiPoint(points).into())
    };
    let turned = similarity::linear(
        &map.map_geometries(points),
        similarity::rotation(30.0),
        similarity::About::Corner,
    );
    features::drop_attributes(&turned.unwrap()).write(&host.path("points.gpkg")).unwrap();
    let report = host.matches("map.gpkg", &["--record", "acme.json", "points.gpkg"]);
    assert_eq!(report["registration"]["method"], "geometry");
}

#[test]
fn centroids_and_boxes_of_polygons_carry_the_message_wherever_and_in_whatever_crs_they_are() {
    let host = marked("helsinki.gpkg", &[]);
    host.run("ogr2ogr", &["-t_srs", "EPSG:4326", "degrees.gpkg", "marked.gpkg"]).succeeds();
    let [map, unmarked, degrees] =
        ["marked.gpkg", "map.gpkg", "degrees.gpkg"].map(|name| Map::read(&host.path(name)).unwrap());
    for (outline, observed_on) in [(Outline::Centroid, "centroids"), (Outline::BoundingBox, "boxes")] {
        let turned =
            similarity::linear(&outline.apply(&map), similarity::rotation(30.0), similarity::About::Corner);
        let turned = features::drop_attributes(&turned.unwrap());
        for suspect in [outline.apply(&map), turned, outline.apply(&degrees)] {
            suspect.write(&host.path("suspect.gpkg")).unwrap();
            let report = host.matches("map.gpkg", &["--record", "acme.json", "suspect.gpkg"]);
            assert_eq!(report["parameters"]["observations"], observed_on);
            std::fs::remove_file(host.path("suspect.gpkg")).unwrap();
        }
        outline.apply(&unmarked).write(&host.path("suspect.gpkg")).unwrap();
        let (run, report) = host.verify("map.gpkg", &["--record", "acme.json", "suspect.gpkg"]);
        assert_eq!((run.code, &report["verdict"]), (Some(1), &Value::from("no-match")));
        assert_eq!(report["parameters"]["observations"], observed_on);
        std::fs::remove_file(host.path("suspect.gpkg")).unwrap();
    }
}

#[test]
fn nobody_is_accused_by_a_wrong_key_an_unmarked_map_another_map_or_another_recipient() {
    let host = marked("helsinki.gpkg", &[]);
    let other_key = meshmark_core::key::SecretKey::from_bytes([1; 32]);
    std::fs::write(host.path("other_key.json"), other_key.to_json().as_bytes()).unwrap();
    host.copy("kotka.gpkg", "kotka.gpkg");

    let (_, report) = host.verify("map.gpkg", &["--recipient", "Somebody Else", "marked.gpkg"]);
    assert_eq!(report["verdict"], "no-match");
    let (run, report) = host.verify("map.gpkg", &["--record", "acme.json", "map.gpkg"]);
    assert_eq!((run.code, &report["verdict"]), (Some(1), &Value::from("no-match")));
    let (run, report) = host.verify("map.gpkg", &["--record", "acme.json", "kotka.gpkg"]);
    assert_eq!((run.code, &report["verdict"]), (Some(3), &Value::from("inconclusive")));

    let command = library().with_file_name("meshmark");
    let wrong_key = ["verify", "--json", "--key", "other_key.json", "--reference", "map.gpkg"];
    let arguments = [&wrong_key[..], &["--recipient", "ACME GmbH", "marked.gpkg"]].concat();
    let run = host.run(command.to_str().unwrap(), &arguments);
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!((run.code, &report["verdict"]), (Some(1), &Value::from("no-match")));
}
