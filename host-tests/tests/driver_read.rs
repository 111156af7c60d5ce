//! The results of reading MESHMARK with GDAL's own programs.

use gdal::Dataset;
use meshmark_core::{
    carrier::Carrier, code::Code, demodulation, fingerprint::COEFFICIENTS,
    fingerprint_record::FingerprintRecord, ground::Ground, patches::Patches, record::Record,
    vertices::VertexTable,
};
use meshmark_dataset::{Selection, Survey, survey};
use meshmark_host_tests::{
    contents::{self, LayerContents, lengths, moves},
    plugin::{Host, Run, fixture},
};
use std::{fs, path::Path};

const TOLERANCE_M: f64 = 0.75;

fn source(name: &str) -> String {
    fixture(name).display().to_string()
}

fn survey_of(path: &Path) -> Survey {
    survey(&Dataset::open(path).unwrap(), &Selection::default()).unwrap()
}

/// Runs `ogrinfo` on a map through MESHMARK.
fn ogrinfo(host: &Host, source: &str, more: &[&str]) -> Run {
    let source = format!("MESHMARK:{source}");
    let mut arguments = vec![source.as_str(), "-oo", "KEY=key.json", "-oo", "RECIPIENT=ACME GmbH"];
    arguments.extend(more);
    host.run("ogrinfo", &arguments)
}

fn marked_with(host: &Host, name: &str, options: &[&str]) -> Vec<LayerContents> {
    host.mark("GPKG", "marked.gpkg", &source(name), options).succeeds();
    contents::read(&host.path("marked.gpkg"))
}

#[test]
fn every_vertex_moves_a_little_and_nothing_else_changes() {
    let host = Host::new();
    let marked = marked_with(&host, "helsinki.gpkg", &[]);
    let moves = moves(&contents::read(&fixture("helsinki.gpkg")), &marked);
    let (rms, max) = lengths(&moves);
    assert_eq!(moves.len(), 4719, "shared vertices move together and every layer takes part");
    assert!((0.05..0.15).contains(&rms) && max <= TOLERANCE_M, "rms {rms} m, max {max} m");
}

#[test]
fn all_geometry_types_are_marked_and_z_m_null_and_empty_ones_stay() {
    let host = Host::new();
    let marked = marked_with(&host, "shapes.gpkg", &[]);
    let moves = moves(&contents::read(&fixture("shapes.gpkg")), &marked);
    let (rms, max) = lengths(&moves);
    assert_eq!(moves.len(), 1620);
    assert!(moves.iter().all(|(from, to)| from != to), "no geometry type is left out");
    assert!((0.05..0.2).contains(&rms) && max <= TOLERANCE_M, "rms {rms} m, max {max} m");
}

#[test]
fn the_message_can_be_read_from_what_ogr2ogr_wrote() {
    let host = Host::new();
    let options = ["-oo", "CODE=LDPC", "-oo", "RECORD=acme.json"];
    host.mark("GPKG", "marked.gpkg", &source("kotka.gpkg"), &options).succeeds();
    let record = Record::from_json(&fs::read_to_string(host.path("acme.json")).unwrap()).unwrap();
    let moves = moves(&contents::read(&fixture("kotka.gpkg")), &contents::read(&host.path("marked.gpkg")));

    let reference = survey_of(&fixture("kotka.gpkg"));
    let (table, ground) = (&reference.data.vertices, reference.measure().unwrap());
    let patches = Patches::new(&reference.map(&record.parameters).unwrap(), &record.parameters).unwrap();
    let mut observed = vec![None; table.len()];
    for (from, to) in moves {
        observed[table.index_of(from).unwrap()] = Some(ground.metres_between(from, to));
    }
    let message = record.message().unwrap();
    let parameters = record.parameters;
    let carrier = Carrier::new(&host.key());
    let found =
        demodulation::paper(&patches, &carrier, &observed, message.len(), &parameters, &|_| ()).unwrap();
    assert_eq!(found.message(), message);
    assert_eq!(message, host.key().recipient_message("ACME GmbH"));
}

#[test]
fn the_record_says_what_was_done_and_keeps_the_secret() {
    let host = Host::new();
    host.copy("helsinki.gpkg", "map.gpkg");
    let options = ["-oo", "RECORD=acme.json", "-oo", "AMPLITUDE=0.2", "-oo", "LAYERS=roads,buildings"];
    let run = host.mark("GPKG", "marked.gpkg", "map.gpkg", &options).succeeds();
    let text = fs::read_to_string(host.path("acme.json")).unwrap();
    let record = FingerprintRecord::from_json(&text).unwrap();

    let named = |path: &Path| -> Vec<LayerContents> {
        contents::read(path)
            .into_iter()
            .filter(|l| ["roads", "buildings"].contains(&l.name.as_str()))
            .collect()
    };
    let (before, after) = (named(&host.path("map.gpkg")), named(&host.path("marked.gpkg")));
    let table = VertexTable::new(before.iter().flat_map(|layer| layer.coords()).collect()).unwrap();
    assert_eq!(record.reference.vertices, table.len());
    assert_eq!(record.reference.vertices_sha256, table.digest());
    assert_eq!(record.reference.crs.as_deref(), Some("EPSG:3067"));
    assert_eq!((record.mark.amplitude_m, record.mark.patch_size), (0.2, 480));
    assert_eq!((record.mark.coefficients, record.recipient.as_str()), (COEFFICIENTS, "ACME GmbH"));
    assert!(record.is_of(&host.key()));
    assert_eq!(record.layers, Some(vec!["roads".into(), "buildings".into()]));
    let (rms, max) = lengths(&moves(&before, &after));
    let recorded = record.distortion.displacement;
    assert!((recorded.rms_m / rms - 1.0).abs() < 0.001 && (recorded.max_m / max - 1.0).abs() < 0.001);
    assert!(recorded.rms_m < recorded.p99_m && recorded.p99_m < recorded.max_m);
    for seen in [&text, &run.stdout, &run.stderr] {
        assert!(!seen.contains(&host.secret()));
    }
}

#[test]
fn a_message_instead_of_a_recipient_is_recorded_as_it_is() {
    let host = Host::new();
    let arguments = [
        "-f",
        "GPKG",
        "marked.gpkg",
        &format!("MESHMARK:{}", source("helsinki.gpkg")),
        "-oo",
        "KEY=key.json",
        "-oo",
        "MESSAGE=C0FFEE11",
        "-oo",
        "RECORD=record.json",
    ];
    host.run("ogr2ogr", &arguments).succeeds();
    let record = Record::from_json(&fs::read_to_string(host.path("record.json")).unwrap()).unwrap();
    assert_eq!((record.message.as_str(), record.recipient), ("c0ffee11", None));
    assert_eq!((record.parameters.code, record.parameters.chip_rate), (Code::Repetition, 2));
}

#[test]
fn marking_again_finds_its_own_record_and_makes_the_same_map() {
    let host = Host::new();
    let options = ["-oo", "RECORD=acme.json"];
    host.mark("GPKG", "a.gpkg", &source("kotka.gpkg"), &options).succeeds();
    let record = fs::read(host.path("acme.json")).unwrap();
    host.mark("GPKG", "b.gpkg", &source("kotka.gpkg"), &options).succeeds();
    assert_eq!(fs::read(host.path("acme.json")).unwrap(), record);
    assert!(contents::read(&host.path("a.gpkg")) == contents::read(&host.path("b.gpkg")));
    assert!(host.files().iter().all(|(name, _)| !name.starts_with('.')), "no temporary is left");
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let host = Host::new();
    let read = |threads: &str| {
        let source = format!("MESHMARK:{}", source("helsinki.gpkg"));
        let output = format!("marked{threads}.gpkg");
        let arguments = ["-f", "GPKG", &output, &source, "-oo", "KEY=key.json", "-oo", "RECIPIENT=ACME GmbH"];
        host.run_with("ogr2ogr", &arguments, &[("GDAL_NUM_THREADS", threads)]).succeeds();
        contents::read(&host.path(&output))
    };
    let one = read("1");
    assert!(one == read("2"));
    assert!(one == read("8"));
    assert!(one == read("ALL_CPUS"));
}

#[test]
fn layers_that_are_not_named_pass_bit_by_bit() {
    let host = Host::new();
    let before = contents::read(&fixture("helsinki.gpkg"));
    let after = marked_with(&host, "helsinki.gpkg", &["-oo", "LAYERS=buildings, roads"]);
    for (before, after) in before.iter().zip(&after) {
        let marked = ["buildings", "roads"].contains(&before.name.as_str());
        assert_eq!(before != after, marked, "{}", before.name);
    }
}

#[test]
fn degrees_move_by_metres_on_the_ground() {
    let host = Host::new();
    let marked = marked_with(&host, "europe_deg.gpkg", &["-oo", "AMPLITUDE=0.3"]);
    let moves = moves(&contents::read(&fixture("europe_deg.gpkg")), &marked);
    let metres = moves.iter().map(|(from, to)| {
        let [x, y] = Ground::WGS84.metres_between(*from, *to);
        x.hypot(y)
    });
    let (sum, max) = metres.fold((0.0, 0f64), |(sum, max), d| (sum + d * d, max.max(d)));
    let rms = (sum / moves.len() as f64).sqrt();
    assert!((0.15..0.45).contains(&rms) && max <= TOLERANCE_M + 1e-6, "rms {rms} m, max {max} m");
}

#[test]
fn a_precision_puts_coordinates_on_a_grid() {
    let host = Host::new();
    let marked = marked_with(&host, "helsinki.gpkg", &["-oo", "PRECISION=0.01"]);
    for [x, y] in marked.iter().flat_map(|layer| layer.coords()) {
        assert_eq!([x, y], [(x * 100.0).round() / 100.0, (y * 100.0).round() / 100.0]);
    }
}

#[test]
fn ogrinfo_says_the_same_of_everything_but_coordinates() {
    let host = Host::new();
    for name in ["shapes.gpkg", "helsinki.gpkg"] {
        let about = ["-al", "-geom=NO"];
        let plain = host.run("ogrinfo", &[&[source(name).as_str()], &about[..]].concat()).succeeds();
        let marked = ogrinfo(&host, &source(name), &about).succeeds();
        let lines = |run: &Run| -> Vec<String> {
            let lines = run.stdout.lines().skip(2).filter(|line| !line.starts_with("Extent"));
            lines.map(String::from).collect()
        };
        assert!(plain.stdout.contains("FID Column = fid") && plain.stdout.lines().count() > 500);
        assert_eq!(lines(&plain), lines(&marked));
    }
}

#[test]
fn metadata_of_dataset_and_layers_is_the_sources() {
    let host = Host::new();
    let copy = ["-f", "GPKG", "map.gpkg", &source("kotka.gpkg"), "roads"];
    let metadata = ["-mo", "ORDER=4711", "-lco", "DESCRIPTION=Streets of the town"];
    host.run("ogr2ogr", &[&copy[..], &metadata[..]].concat()).succeeds();
    let marked = ogrinfo(&host, "map.gpkg", &["-al", "-so", "-oo", "PATCH_SIZE=300"]).succeeds().stdout;
    assert!(marked.contains("ORDER=4711") && marked.contains("DESCRIPTION=Streets of the town"), "{marked}");
}

#[test]
fn field_domains_reach_the_output() {
    let host = Host::new();
    let plain = host.run("ogrinfo", &["-fielddomain", "rakennuslaji", &source("shapes.gpkg")]).succeeds();
    let through = ogrinfo(&host, &source("shapes.gpkg"), &["-fielddomain", "rakennuslaji"]).succeeds();
    let domain = |run: &Run| run.stdout.lines().skip(2).map(String::from).collect::<Vec<_>>();
    assert!(plain.stdout.contains("Coded values"), "{}", plain.stdout);
    assert_eq!(domain(&plain), domain(&through));
    host.mark("GPKG", "marked.gpkg", &source("shapes.gpkg"), &[]).succeeds();
    let written = host.run("ogrinfo", &["-fielddomain", "rakennuslaji", "marked.gpkg"]).succeeds();
    assert_eq!(domain(&plain), domain(&written));
}

#[test]
fn styles_of_features_are_kept() {
    let host = Host::new();
    let select = "SELECT *, 'BRUSH(fc:#00FF00)' AS OGR_STYLE FROM buildings";
    host.run("ogr2ogr", &["-f", "MapInfo File", "map.tab", &source("kotka.gpkg"), "-sql", select]).succeeds();
    let marked = ogrinfo(&host, "map.tab", &["-al", "-geom=NO"]).succeeds().stdout;
    let plain = host.run("ogrinfo", &["map.tab", "-al", "-geom=NO"]).succeeds().stdout;
    let styles = |text: &str| -> Vec<String> {
        text.lines().filter(|l| l.contains("Style =")).map(String::from).collect()
    };
    assert!(styles(&plain).len() > 600);
    assert_eq!(styles(&plain), styles(&marked));
}

#[test]
fn other_formats_are_marked_as_well() {
    let host = Host::new();
    for (format, map, marked) in [
        ("ESRI Shapefile", "map.shp", "marked.shp"),
        ("GeoJSON", "map.geojson", "marked.geojson"),
        ("FlatGeobuf", "map.fgb", "marked.fgb"),
        ("GML", "map.gml", "marked.gml"),
        ("SQLite", "map.sqlite", "marked.sqlite"),
        ("ESRI Shapefile", "zipped.shz", "marked.shz"),
    ] {
        let write = ["-f", format, map, &source("kotka.gpkg"), "buildings", "-nln", "map"];
        host.run("ogr2ogr", &write).succeeds();
        let gpkg = format!("{map}.gpkg");
        host.mark("GPKG", &gpkg, map, &["-nln", "map"]).succeeds();
        let (before, after) = (contents::read(&host.path(map)), contents::read(&host.path(&gpkg)));
        let moved = without_ids(&before, &after);
        let degrees = before[0].coords()[0][0].abs() <= 180.0;
        let unit = if degrees { 60_000.0 } else { 1.0 };
        let (rms, max) = lengths(&moved);
        assert!(moved.len() > 1500 && rms * unit > 0.02 && max * unit <= 1.0, "{format}: {rms}, {max}");
        host.mark(format, marked, map, &[]).succeeds();
        assert_eq!(
            contents::read(&host.path(marked))[0].features.len(),
            before[0].features.len(),
            "{format}"
        );
    }
}

/// Returns moves between maps whose feature ids, names and attribute types differ by format.
fn without_ids(before: &[LayerContents], after: &[LayerContents]) -> Vec<([f64; 2], [f64; 2])> {
    let strip = |layers: &[LayerContents]| {
        let mut layers = layers.to_vec();
        for layer in &mut layers {
            layer.name.clear();
            layer.features.iter_mut().for_each(|f| (f.fid, f.attributes) = (None, String::new()));
        }
        layers
    };
    moves(&strip(before), &strip(after))
}

#[test]
fn extents_are_those_of_the_marked_geometry() {
    let host = Host::new();
    for name in ["helsinki.gpkg", "shapes.gpkg"] {
        let file = format!("marked_{name}");
        host.mark("GPKG", &file, &source(name), &[]).succeeds();
        let extents = |run: Run| -> Vec<String> {
            run.succeeds()
                .stdout
                .lines()
                .filter(|line| line.starts_with("Extent"))
                .map(String::from)
                .collect()
        };
        let of_view = extents(ogrinfo(&host, &source(name), &["-al", "-so"]));
        let of_file = extents(host.run("ogrinfo", &["-al", "-so", &file]));
        let of_source = extents(host.run("ogrinfo", &["-al", "-so", &source(name)]));
        assert!(of_view.len() >= 5);
        assert_eq!(of_view, of_file);
        assert_ne!(of_view, of_source);
    }
}

#[test]
fn a_spatial_filter_finds_points_where_they_are_and_not_where_they_were() {
    let host = Host::new();
    let before = contents::read(&fixture("helsinki.gpkg"));
    let after = marked_with(&host, "helsinki.gpkg", &[]);
    let layer = before.iter().position(|layer| layer.name == "amenities").unwrap();
    let points = before[layer].coords().into_iter().zip(after[layer].coords());
    let count = |[x, y]: [f64; 2]| {
        let rectangle = [x - 0.001, y - 0.001, x + 0.001, y + 0.001].map(|v| v.to_string());
        let spat = ["-so", "amenities", "-spat", &rectangle[0], &rectangle[1], &rectangle[2], &rectangle[3]];
        let text = ogrinfo(&host, &source("helsinki.gpkg"), &spat).succeeds().stdout;
        text.lines().find(|line| line.starts_with("Feature Count")).unwrap().to_string()
    };
    for (was, is) in points.step_by(60) {
        assert_eq!((count(is), count(was)), ("Feature Count: 1".into(), "Feature Count: 0".into()));
    }
}

#[test]
fn a_spatial_filter_reads_what_it_reads_of_the_marked_map() {
    let host = Host::new();
    let boxes = |name: &str| match name {
        "europe_deg.gpkg" => [["24", "56.5", "24.5", "57"], ["13", "45", "15", "50"]],
        "shapes.gpkg" => {
            [["300300", "6700300", "300310", "6700340"], ["300000", "6700000", "300500", "6700500"]]
        }
        _ => [["385700", "6671900", "385720", "6671910"], ["385500", "6671800", "385900", "6672000"]],
    };
    for name in ["helsinki.gpkg", "europe_deg.gpkg", "shapes.gpkg"] {
        let marked = format!("marked_{name}");
        host.mark("GPKG", &marked, &source(name), &[]).succeeds();
        for (number, rectangle) in boxes(name).iter().enumerate() {
            let spat = [&["-spat"], &rectangle[..]].concat();
            let (view, file) = (format!("view{number}_{name}"), format!("file{number}_{name}"));
            let of_view = host.mark("GPKG", &view, &source(name), &spat);
            // Through Arrow, GDAL 3.10 reads a whole table without geometry, and nothing of it
            // otherwise.
            let arguments = [&["-f", "GPKG", &file, &marked], &spat[..]].concat();
            let of_file = host.run_with("ogr2ogr", &arguments, &[("OGR2OGR_USE_ARROW_API", "NO")]);
            assert_eq!((of_view.code, of_file.code), (Some(0), Some(0)), "{}", of_view.stderr);
            // GDAL 3.12 warns of a table without geometry.
            assert_eq!(of_view.errors(), of_file.errors());
            let (view, file) = (contents::read(&host.path(&view)), contents::read(&host.path(&file)));
            assert!(view.iter().any(|layer| !layer.features.is_empty()), "{name}: the test finds something");
            assert!(by_fid(view) == by_fid(file), "{name}, {rectangle:?}");
        }
    }
}

fn by_fid(mut layers: Vec<LayerContents>) -> Vec<LayerContents> {
    layers.iter_mut().for_each(|layer| layer.features.sort_by_key(|feature| feature.fid));
    layers
}

#[test]
fn attribute_filters_work_and_those_on_geometry_see_the_marked_one() {
    let host = Host::new();
    let count = |run: Run| -> usize {
        let stdout = run.succeeds().stdout;
        let line = stdout.lines().find(|line| line.starts_with("Feature Count: ")).unwrap();
        line["Feature Count: ".len()..].parse().unwrap()
    };
    let after = marked_with(&host, "helsinki.gpkg", &[]);
    let ask = |filter: &str| {
        count(ogrinfo(&host, &source("helsinki.gpkg"), &["-so", "amenities", "-where", filter]))
    };
    let plain =
        |filter: &str| count(host.run("ogrinfo", &["-so", "marked.gpkg", "amenities", "-where", filter]));
    for filter in ["kind = 'restaurant'", "upper(kind) LIKE 'REST%'", "fid < 20"] {
        assert!(ask(filter) > 0, "{filter} finds something");
        assert_eq!(ask(filter), plain(filter), "{filter}");
    }
    let amenities = after.iter().find(|layer| layer.name == "amenities").unwrap();
    let exact = |wkt: &str| ask(&format!("OGR_GEOM_WKT = '{wkt}'"));
    let wkt = |wkb: &[u8]| gdal::vector::Geometry::from_wkb(wkb).unwrap().wkt().unwrap();
    let before = contents::read(&fixture("helsinki.gpkg"));
    let unmarked = before.iter().find(|layer| layer.name == "amenities").unwrap();
    assert_eq!(exact(&wkt(amenities.features[7].geometries[0].as_ref().unwrap())), 1);
    assert_eq!(exact(&wkt(unmarked.features[7].geometries[0].as_ref().unwrap())), 0);
    let native =
        ogrinfo(&host, &source("helsinki.gpkg"), &["-so", "amenities", "-where", "ST_MinX(geom) > 0"]);
    // The exit code of ogrinfo is 0 nevertheless in GDAL 3.12.
    let refused = native.stderr.contains("depends on geometry") && !native.stdout.contains("Feature Count");
    assert!(refused, "SQL of the source's own on its unmarked geometry is refused: {}", native.stderr);
}

#[test]
fn sql_of_any_dialect_sees_marked_geometry() {
    let host = Host::new();
    let after = marked_with(&host, "helsinki.gpkg", &[]);
    let roads = after.iter().find(|layer| layer.name == "roads").unwrap();
    for dialect in ["OGRSQL", "SQLITE"] {
        let sql = ["-overwrite", "-dialect", dialect, "-sql", "SELECT * FROM roads", "-nln", "roads"];
        host.mark("GPKG", "sql.gpkg", &source("helsinki.gpkg"), &sql).succeeds();
        assert_eq!(contents::read(&host.path("sql.gpkg"))[0].coords(), roads.coords(), "{dialect}");
    }
}

#[test]
fn the_key_may_come_from_the_configuration() {
    let host = Host::new();
    let source = format!("MESHMARK:{}", source("kotka.gpkg"));
    let arguments = ["-f", "GPKG", "marked.gpkg", &source, "-oo", "RECIPIENT=ACME GmbH"];
    host.run_with("ogr2ogr", &arguments, &[("MESHMARK_KEY", "key.json")]).succeeds();
    let configured = contents::read(&host.path("marked.gpkg"));
    host.mark("GPKG", "option.gpkg", &self::source("kotka.gpkg"), &[]).succeeds();
    assert!(configured == contents::read(&host.path("option.gpkg")));
}

#[test]
fn an_amplitude_far_above_the_tolerance_is_marked_with_one_warning() {
    let host = Host::new();
    let said = |amplitude: &str| {
        let options = ["-oo", amplitude];
        host.mark("GPKG", "marked.gpkg", &source("kotka.gpkg"), &options).succeeds().warnings().concat()
    };
    assert_eq!(said("AMPLITUDE=0.6"), "");
    let said = said("AMPLITUDE=6");
    assert!(said.contains("AMPLITUDE=6 would move") && said.contains("TOLERANCE=0.75"), "{said}");
}

#[test]
fn a_map_without_crs_is_marked_in_metres_with_one_warning() {
    let host = Host::new();
    host.run("ogr2ogr", &["-f", "ESRI Shapefile", "bare.shp", &source("kotka.gpkg"), "buildings"]).succeeds();
    fs::remove_file(host.path("bare.prj")).unwrap();
    let run = host.mark("GPKG", "marked.gpkg", "bare.shp", &["-oo", "RECORD=record.json"]).succeeds();
    let ours: Vec<_> = run.warnings().into_iter().filter(|line| line.contains("MESHMARK")).collect();
    assert!(matches!(ours[..], [only] if only.contains("no CRS") && only.contains("SRS=")), "{}", run.stderr);
    let record =
        FingerprintRecord::from_json(&fs::read_to_string(host.path("record.json")).unwrap()).unwrap();
    assert_eq!(record.reference.crs, None);
    let given = host.mark("GPKG", "given.gpkg", "bare.shp", &["-oo", "SRS=EPSG:3067"]).succeeds();
    assert!(!given.stderr.contains("MESHMARK"), "{}", given.stderr);
}

#[test]
fn output_options_of_the_real_driver_work() {
    let host = Host::new();
    host.mark("GPKG", "town.gpkg", &source("kotka.gpkg"), &["-lco", "FID=number", "roads"]).succeeds();
    host.mark("GPKG", "town.gpkg", &source("kotka.gpkg"), &["-append", "roads"]).succeeds();
    host.mark("GPKG", "town.gpkg", &source("kotka.gpkg"), &["-update", "buildings", "-nln", "houses"])
        .succeeds();
    let town = contents::read(&host.path("town.gpkg"));
    let counts: Vec<_> = town.iter().map(|layer| (layer.name.as_str(), layer.features.len())).collect();
    assert_eq!(counts, [("roads", 220), ("houses", 643)]);
    assert!(host.run("ogrinfo", &["-so", "town.gpkg", "roads"]).stdout.contains("FID Column = number"));
}

#[test]
fn gdal_lists_the_driver_and_its_options() {
    let host = Host::new();
    let formats = host.run("ogrinfo", &["--formats"]).succeeds().stdout;
    assert!(formats.contains("MESHMARK -vector- (rw+v):"), "reads, also from virtual files, and creates");
    let details = host.run("ogrinfo", &["--format", "MESHMARK"]).succeeds().stdout;
    let (create, open) = details.split_once("<OpenOptionList>").unwrap();
    for option in meshmark_core::options::OPTIONS {
        assert!(open.contains(&format!("name=\"{}\"", option.name)), "{}", option.name);
        assert!(create.contains(&format!("name=\"{}\"", option.name)), "{}", option.name);
    }
    for option in meshmark_core::options::CREATION_OPTIONS {
        assert!(create.contains(&format!("name=\"{}\"", option.name)), "{}", option.name);
    }
    assert!(details.contains("Connection prefix: MESHMARK:"));
    let identified = host.run("ogrinfo", &["-so", &source("helsinki.gpkg")]).succeeds().stdout;
    assert!(identified.contains("using driver `GPKG'"), "a bare name stays with its own driver");
}
