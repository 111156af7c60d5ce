//! Marking through the driver preserves the quality of real maps, and the message is read from
//! every kind of mark.

use meshmark_core::options::{Laplacian, Rigidity};
use meshmark_host_tests::plugin::{Host, library};
use serde_json::Value;

/// Returns the JSON output of the command.
fn meshmark(host: &Host, arguments: &[&str]) -> Value {
    let run = host.run(library().with_file_name("meshmark").to_str().unwrap(), arguments).succeeds();
    serde_json::from_str(&run.stdout).unwrap()
}

fn number(document: &Value, pointer: &str) -> f64 {
    document.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("{pointer} of {document:#}"))
}

#[test]
fn no_polygon_becomes_invalid_and_record_and_comparison_give_the_same_figures() {
    for fixture in ["helsinki.gpkg", "kotka.gpkg", "astana.gpkg", "europe_deg.gpkg", "shapes.gpkg"] {
        for (shape, basis) in Rigidity::NAMES.iter().zip(Laplacian::NAMES) {
            let host = Host::new();
            host.copy(fixture, "map.gpkg");
            let (shape, basis) = (format!("SHAPE={shape}"), format!("BASIS={basis}"));
            let options = ["-oo", "RECORD=record.json", "-oo", &shape, "-oo", &basis];
            host.mark("GPKG", "marked.gpkg", "map.gpkg", &options).succeeds();
            let compared = meshmark(&host, &["compare", "--json", "map.gpkg", "marked.gpkg"]);
            for pointer in [
                "/compared/torn_vertices",
                "/validity/newly_invalid",
                "/overlaps/new",
                "/crossings/new",
                "/crossings/lost",
            ] {
                assert_eq!(number(&compared, pointer), 0.0, "{fixture} {shape} {basis}: {pointer}");
            }
            let record: Value =
                serde_json::from_slice(&std::fs::read(host.path("record.json")).unwrap()).unwrap();
            for (figures, count) in [
                ("displacement", 3),
                ("angles", 5),
                ("areas", 4),
                ("hausdorff", 2),
                ("validity", 3),
                ("overlaps", 5),
            ] {
                assert_eq!(record[figures].as_object().unwrap().len(), count);
                for figure in record[figures].as_object().unwrap().keys() {
                    let pointer = format!("/{figures}/{figure}");
                    let difference = number(&record, &pointer) - number(&compared, &pointer);
                    assert!(difference.abs() < 1e-9, "{fixture} {shape} {basis}: {pointer}");
                }
            }
        }
    }
}

#[test]
fn right_angles_stay_right_when_shapes_are_rigid_and_the_recipient_is_named() {
    for basis in Laplacian::NAMES {
        let host = Host::new();
        host.copy("kotka.gpkg", "map.gpkg");
        let basis = format!("BASIS={basis}");
        let options = ["-oo", "RECORD=record.json", "-oo", "SHAPE=RIGID", "-oo", &basis];
        host.mark("GPKG", "marked.gpkg", "map.gpkg", &options).succeeds();
        let compared =
            meshmark(&host, &["compare", "--json", "--layers", "buildings", "map.gpkg", "marked.gpkg"]);
        assert_eq!(number(&compared, "/angles/right_angles_kept"), 1.0, "{compared:#}");
        assert!(number(&compared, "/displacement/rms_m") > 0.08);
        let verify =
            ["verify", "--json", "--key", "key.json", "--reference", "map.gpkg", "--record", "record.json"];
        let report = meshmark(&host, &[&verify[..], &["marked.gpkg"]].concat());
        assert_eq!(report["verdict"], "match");
    }
}
