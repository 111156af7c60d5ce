//! References that have lost their CRS or have another one than the record of their marking.

use meshmark_host_tests::plugin::Host;
use serde_json::Value;

/// The CRS of the tests: a unit of EPSG:3857 is half a metre there.
const CRS: &str = "EPSG:3857";

/// Returns a host with a map and its copy for ACME GmbH, and the map without a CRS (`bare.fgb`) and with
/// a wrong one (`wrong.fgb`).
fn marked(options: &[&str]) -> Host {
    let host = Host::new();
    host.copy("kotka.gpkg", "source.gpkg");
    host.run("ogr2ogr", &["-t_srs", CRS, "map.gpkg", "source.gpkg", "buildings"]).succeeds();
    let options = [&["-oo", "RECORD=acme.json"], options].concat();
    host.mark("GPKG", "marked.gpkg", "map.gpkg", &options).succeeds();
    host.run("ogr2ogr", &["-a_srs", "None", "bare.fgb", "map.gpkg"]).succeeds();
    host.run("ogr2ogr", &["-a_srs", "EPSG:3067", "wrong.fgb", "map.gpkg"]).succeeds();
    host.run("ogr2ogr", &["-a_srs", "EPSG:4326", "degrees.gpkg", "map.gpkg"]).succeeds();
    host
}

/// Returns exit code, verdict figures and parameters of a verification with the record.
fn verified(host: &Host, reference: &str, more: &[&str]) -> (Option<i32>, Value, String) {
    let arguments = [&["--record", "acme.json"], more, &["marked.gpkg"]].concat();
    let (run, report) = host.verify(reference, &arguments);
    (run.code, report, run.stderr)
}

#[test]
fn a_reference_that_lost_its_crs_has_that_of_its_record() {
    for options in [&[][..], &["-oo", "CODE=LDPC"]] {
        let host = marked(options);
        let (_, expected, _) = verified(&host, "map.gpkg", &[]);
        assert_eq!(expected["parameters"]["crs_source"], "reference");
        for more in [&[][..], &["--srs", CRS], &["--srs", "EPSG:900913"]] {
            let (code, report, warnings) = verified(&host, "bare.fgb", more);
            assert_eq!((code, &report["p_value_log10"]), (Some(0), &expected["p_value_log10"]), "{more:?}");
            let parameters = &report["parameters"];
            assert_eq!(parameters["crs"], CRS);
            assert_eq!(parameters["crs_source"], "record");
            assert_eq!(parameters["crs_of_reference"], Value::Null);
            assert!(!warnings.contains("meshmark: "), "{warnings}");
        }
        let (code, _, message) = verified(&host, "bare.fgb", &["--srs", "EPSG:3067"]);
        assert_eq!(code, Some(2));
        assert!(message.contains("--srs EPSG:3067 contradicts the record"), "{message}");
    }
}

#[test]
fn a_reference_with_another_crs_than_its_record_is_noticed() {
    let host = marked(&[]);
    let (_, expected, _) = verified(&host, "map.gpkg", &[]);
    std::fs::create_dir(host.path("records")).unwrap();
    std::fs::copy(host.path("acme.json"), host.path("records/acme.json")).unwrap();
    for (reference, own) in [("wrong.fgb", "EPSG:3067"), ("degrees.gpkg", "EPSG:4326")] {
        let by_records = host.verify(reference, &["--records", "records", "marked.gpkg"]);
        let (run, report) = by_records;
        for (code, report, warnings) in [verified(&host, reference, &[]), (run.code, report, run.stderr)] {
            assert_eq!((code, &report["p_value_log10"]), (Some(0), &expected["p_value_log10"]));
            assert_eq!(report["parameters"]["crs_source"], "record");
            assert_eq!(report["parameters"]["crs_of_reference"], own);
            let sentence =
                format!("the reference states {own}, and its record {CRS}, in which it was marked");
            assert!(warnings.contains(&format!("meshmark: {sentence}")), "{warnings}");
        }
    }
    let page = ["--record", "acme.json", "--report", "report.html", "--explain", "marked.gpkg"];
    let command = host.meshmark();
    let arguments = [&["verify", "--key", "key.json", "--reference", "wrong.fgb"][..], &page].concat();
    let run = host.run(command.to_str().unwrap(), &arguments);
    let html = std::fs::read_to_string(host.path("report.html")).unwrap();
    for text in [&run.stdout, &html] {
        assert!(text.contains("The reference states EPSG:3067, and its record EPSG:3857"), "{text}");
    }
}

#[test]
fn records_of_another_map_in_degrees_do_not_hinder_those_of_this_reference() {
    let host = marked(&[]);
    host.run("ogr2ogr", &["-t_srs", "EPSG:4326", "other.gpkg", "source.gpkg", "buildings"]).succeeds();
    host.mark("GPKG", "other_copy.gpkg", "other.gpkg", &["-oo", "RECORD=other.json"]).succeeds();
    std::fs::create_dir(host.path("records")).unwrap();
    for name in ["acme.json", "other.json"] {
        std::fs::copy(host.path(name), host.path("records").join(name)).unwrap();
    }
    let (run, report) = host.verify("map.gpkg", &["--records", "records", "marked.gpkg"]);
    assert_eq!(
        (run.code, &report["parameters"]["recipient"]),
        (Some(0), &"ACME GmbH".into()),
        "{}",
        run.stderr
    );
    let (run, _) = host.verify("map.gpkg", &["--record", "other.json", "marked.gpkg"]);
    assert!(run.code == Some(4) && run.stderr.contains("reference"), "{:?} {}", run.code, run.stderr);
}
