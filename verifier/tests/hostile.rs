//! Suspects that are made to mislead, to stall or to fetch: each gets an answer or a refusal, and
//! nothing else is read.

mod common;

use common::{assert_answer, fixture, verify, write};
use gdal::{
    Dataset, DatasetOptions, DriverManager, GdalOpenFlags,
    spatial_ref::SpatialRef,
    vector::{Geometry, LayerAccess, LayerOptions, OGRwkbGeometryType::wkbPoint, sql::Dialect},
};
use meshmark_dataset::{Selection, survey};
use std::{
    fs,
    net::TcpListener,
    path::{Path, PathBuf},
    process::Command,
};
use tempfile::TempDir;

/// The vertices of the marked map.
fn marked() -> Vec<[f64; 2]> {
    let map = survey(&Dataset::open(fixture("vectors/marked.gpkg")).unwrap(), &Selection::default()).unwrap();
    map.data.vertices.coords().to_vec()
}

/// Points in EPSG:3067 as GeoJSON, with `crs` in the place of the CRS.
fn points(coords: &[[f64; 2]], crs: &str) -> String {
    let feature = |[x, y]: &[f64; 2]| {
        format!(
            r#"{{"type":"Feature","properties":{{}},"geometry":{{"type":"Point","coordinates":[{x},{y}]}}}}"#
        )
    };
    let features: Vec<String> = coords.iter().map(feature).collect();
    format!(r#"{{"type":"FeatureCollection","crs":{crs},"features":[{}]}}"#, features.join(","))
}

const EPSG_3067: &str = r#"{"type":"name","properties":{"name":"EPSG:3067"}}"#;

#[test]
fn the_vertices_alone_as_points_are_a_match() {
    let folder = TempDir::new().unwrap();
    assert_answer(&write(&folder, "points.geojson", &points(&marked(), EPSG_3067)), 0, "MATCH");
}

#[test]
fn ten_times_as_many_vertices_do_not_hide_the_mark() {
    let folder = TempDir::new().unwrap();
    let mut coords = marked();
    let count = coords.len() as u64;
    let noise = |i: u64| (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64 / 2f64.powi(24);
    let ([left, bottom], [width, height]) = ([496_888.0, 6_710_500.0], [1068.0, 1058.0]);
    coords.extend((0..9 * count).map(|i| [left + width * noise(i), bottom + height * noise(i + 1_000_003)]));
    assert_answer(&write(&folder, "crowded.geojson", &points(&coords, EPSG_3067)), 0, "MATCH");
}

#[test]
fn a_suspect_in_gml_is_read_and_nothing_is_left_beside_it() {
    let folder = TempDir::new().unwrap();
    let converted = Command::new("ogr2ogr")
        .args(["-f", "GML", "-dsco", "XSISCHEMA=OFF", "suspect.gml"])
        .arg(fixture("vectors/marked.gpkg"))
        .current_dir(&folder)
        .output();
    assert!(converted.unwrap().status.success());
    assert_answer(&folder.path().join("suspect.gml"), 0, "MATCH");
    let files: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(files, ["suspect.gml"]);
}

#[test]
fn nothing_few_points_and_other_points_elsewhere_are_inconclusive() {
    let folder = TempDir::new().unwrap();
    let random = |i: u64| 1000.0 * (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64 / 2f64.powi(24);
    let elsewhere: Vec<[f64; 2]> =
        (0..3000).map(|i| [6e5 + random(i), 6.5e6 + random(i + 1_000_003)]).collect();
    for (name, coords, part) in [
        ("empty.geojson", &[][..], "has no vertices"),
        ("few.geojson", &marked()[..20], "only 20 of 3833 reference vertices match, where 30 are needed"),
        ("elsewhere.geojson", &elsewhere, "another map"),
    ] {
        assert_answer(&write(&folder, name, &points(coords, EPSG_3067)), 3, part);
    }
}

#[test]
fn the_vertices_as_points_elsewhere_are_a_match_by_their_arrangement() {
    let folder = TempDir::new().unwrap();
    let elsewhere: Vec<[f64; 2]> = marked().iter().map(|[x, y]| [x + 1e5, y - 2e5]).collect();
    let suspect = write(&folder, "elsewhere.geojson", &points(&elsewhere, EPSG_3067));
    assert_answer(&suspect, 0, "registration: geometry");
}

#[test]
fn no_address_in_a_suspect_is_visited() {
    let folder = TempDir::new().unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.set_nonblocking(true).unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let link = format!(r#"{{"type":"link","properties":{{"href":"{url}/crs","type":"ogcwkt"}}}}"#);
    let name = format!(r#"{{"type":"name","properties":{{"name":"{url}/crs"}}}}"#);
    let gml = format!(
        r#"<?xml version="1.0"?><!DOCTYPE x [<!ENTITY e SYSTEM "{url}/entity">]>
<ogr:FeatureCollection xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
 xsi:schemaLocation="http://ogr.maptools.org/ {url}/wfs?SERVICE=WFS&amp;REQUEST=DescribeFeatureType&amp;TYPENAME=a"
 xmlns:ogr="http://ogr.maptools.org/" xmlns:gml="http://www.opengis.net/gml" xmlns:xlink="http://www.w3.org/1999/xlink">
<gml:featureMember><ogr:a fid="a.0"><ogr:geometryProperty><gml:Point srsName="{url}/srs"><gml:coordinates>1,2</gml:coordinates></gml:Point></ogr:geometryProperty></ogr:a></gml:featureMember>
<gml:featureMember><ogr:a fid="a.1"><ogr:geometryProperty xlink:href="{url}/map#b"/></ogr:a></gml:featureMember>
</ogr:FeatureCollection>"#
    );
    let kml = format!(
        r#"<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document>
<NetworkLink><Link><href>{url}/more.kml</href></Link></NetworkLink>
<Placemark><styleUrl>{url}/style.kml#a</styleUrl><Point><coordinates>1,2</coordinates></Point></Placemark>
</Document></kml>"#
    );
    let gpx = format!(
        r#"<?xml version="1.0"?><!DOCTYPE gpx [<!ENTITY e SYSTEM "{url}/entity">]>
<gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
 xsi:schemaLocation="http://www.topografix.com/GPX/1/1 {url}/gpx.xsd"><wpt lat="1" lon="2"><link href="{url}/wpt"/></wpt></gpx>"#
    );
    let svg = format!(
        r##"<?xml-stylesheet href="{url}/style.css"?><!DOCTYPE svg PUBLIC "svg" "{url}/svg.dtd"><svg
 xmlns:xlink="http://www.w3.org/1999/xlink"><use href="{url}/a.svg#a"/><image xlink:href="{url}/a.png"/>
<path d="M0 0 1 1"/></svg>"##
    );
    for (file, text) in [
        ("link.gpx", gpx),
        ("link.svg", svg),
        ("link.geojson", points(&marked(), &link)),
        ("name.geojson", points(&marked(), &name)),
        ("schema.gml", gml),
        ("link.kml", kml),
    ] {
        let (code, text) = verify(&write(&folder, file, &text));
        assert!(listener.accept().is_err(), "{file}: somebody called");
        // The GeoJSON files have the marked vertices, the CRS they do not tell is found without it.
        let expected: &[Option<i32>] =
            if file.ends_with("geojson") { &[Some(0)] } else { &[Some(3), Some(5)] };
        assert!(expected.contains(&code), "{file}: {code:?} {text}");
    }
}

#[test]
fn no_address_in_the_metadata_of_tiles_is_visited() {
    let folder = TempDir::new().unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.set_nonblocking(true).unwrap();
    let url = format!("http://{}/crs", listener.local_addr().unwrap());
    let tiled = Command::new("ogr2ogr")
        .args(["-f", "MVT", "-dsco", "MINZOOM=16", "-dsco", "MAXZOOM=16", "tiles"])
        .arg(fixture("vectors/marked.gpkg"))
        .current_dir(&folder)
        .status();
    assert!(tiled.unwrap().success());
    let path = folder.path().join("tiles/metadata.json");
    let scheme = r#""tile_origin_upper_left_x":0,"tile_origin_upper_left_y":0,"tile_dimension_zoom_0":1"#;
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replacen('{', &format!(r#"{{"crs":"{url}",{scheme},"#), 1)).unwrap();
    let (code, text) = verify(&folder.path().join("tiles"));
    assert!(listener.accept().is_err(), "somebody called");
    assert!([Some(0), Some(3), Some(5)].contains(&code), "{code:?} {text}");
}

/// The marked vertices as points in a database, whose schema may have one more entry.
fn database(folder: &TempDir, name: &str, driver: &str, entry: Option<&str>) -> PathBuf {
    let path = folder.path().join(name);
    let driver = DriverManager::get_driver_by_name(driver).unwrap();
    let mut dataset = driver.create_vector_only(&path).unwrap();
    let srs = SpatialRef::from_epsg(3067).unwrap();
    let mut transaction = dataset.start_transaction().unwrap();
    let mut layer = transaction
        .create_layer(LayerOptions { name: "points", srs: Some(&srs), ty: wkbPoint, options: None })
        .unwrap();
    for [x, y] in marked() {
        let mut point = Geometry::empty(wkbPoint).unwrap();
        point.add_point_2d((x, y));
        layer.create_feature(point).unwrap();
    }
    transaction.commit().unwrap();
    drop(dataset);
    let Some(entry) = entry else { return path };
    let open_flags = GdalOpenFlags::GDAL_OF_UPDATE | GdalOpenFlags::GDAL_OF_VECTOR;
    let copy = Dataset::open_ex(&path, DatasetOptions { open_flags, ..Default::default() }).unwrap();
    let run = |sql: &str| drop(copy.execute_sql(sql, None, Dialect::DEFAULT).unwrap());
    run("PRAGMA writable_schema = 1");
    run(&format!(
        "INSERT INTO sqlite_master (type, name, tbl_name, rootpage, sql) VALUES ('table', 'x', 'x', 0, '{entry}')"
    ));
    path
}

#[test]
fn a_database_with_tables_of_its_own_is_read_and_one_that_points_at_files_is_refused() {
    let folder = TempDir::new().unwrap();
    for (driver, extension) in [("GPKG", "gpkg"), ("SQLite", "sqlite")] {
        let plain = database(&folder, &format!("plain.{extension}"), driver, None);
        assert_answer(&plain, 0, "MATCH");
        for (i, entry) in [
            "CREATE VIRTUAL TABLE x USING VirtualOGR(''/etc/passwd'')",
            "CREATE VIRTUAL TABLE x USING VirtualText(''/etc/passwd'', ''UTF-8'')",
            "create/**/virtual/**/table x /* using rtree */ using/**/VirtualShape(''/tmp/a'', ''UTF-8'', 1)",
        ]
        .iter()
        .enumerate()
        {
            let path = database(&folder, &format!("{i}.{extension}"), driver, Some(entry));
            assert_answer(&path, 5, "may point at other files");
        }
    }
}

#[test]
fn what_is_no_plain_map_is_refused() {
    let folder = TempDir::new().unwrap();
    assert_answer(Path::new("MESHMARK:marked.gpkg"), 5, "is not a file here");
    assert_answer(Path::new("/dev/null"), 5, "is not a file here");
    assert_answer(Path::new("/vsicurl/http://127.0.0.1/a.gpkg"), 5, "is not a file here");
    for (file, text) in [
        ("map.vrt", "<OGRVRTDataSource/>"),
        ("map.xml", "<OGRWFSDataSource><URL>http://127.0.0.1</URL></OGRWFSDataSource>"),
        ("map.json", "{}"),
        ("empty.shp", ""),
        ("empty.gpkg", ""),
    ] {
        assert_answer(&write(&folder, file, text), 5, "cannot be opened");
    }
    assert_answer(folder.path(), 5, "");
}

#[test]
fn a_table_that_is_made_of_other_tables_is_refused() {
    let folder = TempDir::new().unwrap();
    let header = "!table\n!version 100\n!charset Neutral\n\nDefinition Table\n";
    for rest in [
        "  Type NATIVE Charset \"Neutral\"\n  Fields 1\n    a Char (254) ;\n\
         begin_metadata\n\"\\IsSeamless\" = \"TRUE\"\nend_metadata\n",
        "create view both as\nSelect a\nFrom one, two\nWhere one.a=two.a\n",
    ] {
        let path = write(&folder, "many.tab", &format!("{header}{rest}"));
        assert_answer(&path, 5, "is made of other tables");
    }
}
