//! Suspects as they come: each format is read, or refused with the command that converts it.
//!
//! A format whose driver this GDAL lacks is tested by its refusal.

mod common;

use common::{assert_answer, fixture, verify, write};
use gdal::{
    Dataset, DriverManager, Metadata,
    vector::{Geometry, LayerAccess},
};
use std::{fmt::Write as _, fs, path::Path, process::Command};
use tempfile::TempDir;

/// Copies the marked map with ogr2ogr.
fn convert(folder: &TempDir, name: &str, arguments: &[&str]) {
    let output = Command::new("ogr2ogr")
        .args(arguments)
        .arg(name)
        .arg(fixture("vectors/marked.gpkg"))
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Whether GDAL has the driver, for reading and for writing.
fn capabilities(driver: &str) -> (bool, bool) {
    let Ok(driver) = DriverManager::get_driver_by_name(driver) else { return (false, false) };
    let has = |name: &str| driver.metadata_item(name, "").is_some_and(|yes| yes == "YES");
    (has("DCAP_OPEN"), has("DCAP_CREATE"))
}

#[test]
fn a_copy_in_each_format_is_a_match_or_is_refused_with_the_conversion() {
    let mvt = [
        "-nlt",
        "PROMOTE_TO_MULTI",
        "-dsco",
        "MINZOOM=15",
        "-dsco",
        "MAXZOOM=16",
        "-dsco",
        "SIMPLIFICATION=0",
    ];
    let gpx = ["-t_srs", "EPSG:4326", "-nlt", "MULTILINESTRING", "-dsco", "GPX_USE_EXTENSIONS=YES"];
    for (driver, name, arguments) in [
        ("OpenFileGDB", "suspect.gdb", &[][..]),
        ("GPX", "suspect.gpx", &gpx),
        ("MVT", "tiles", &mvt),
        ("MBTiles", "suspect.mbtiles", &mvt),
        ("PMTiles", "suspect.pmtiles", &mvt),
        ("Parquet", "suspect.parquet", &["-sql", "SELECT geom FROM buildings"]),
        ("PDF", "suspect.pdf", &[]),
    ] {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join(name);
        let (reads, writes) = capabilities(driver);
        if writes {
            convert(&folder, name, &[&["-f", driver], arguments].concat());
        } else {
            fs::write(&path, "a file of this format").unwrap();
        }
        match (reads, writes) {
            (true, true) => {
                let files = fs::read_dir(&folder).unwrap().count();
                assert_answer(&path, 0, "verdict:      MATCH");
                assert_eq!(fs::read_dir(&folder).unwrap().count(), files, "{name}: a file was left");
            }
            (true, false) => assert_answer(&path, 5, "cannot be opened"),
            (false, _) => {
                assert_answer(
                    &path,
                    5,
                    &format!("and this GDAL has no {driver} driver: convert it with \"ogr2ogr "),
                );
                assert_answer(&path, 5, "on a machine whose GDAL has this driver, and verify the copy");
            }
        }
    }
}

#[test]
fn a_zipped_geodatabase_and_the_tiles_of_one_zoom_are_read() {
    let folder = TempDir::new().unwrap();
    if !capabilities("OpenFileGDB").1 {
        return assert_answer(&write(&folder, "suspect.gdb.zip", "PK"), 5, "convert it with");
    }
    convert(&folder, "suspect.gdb", &["-f", "OpenFileGDB"]);
    let zipped = Command::new("python3")
        .args(["-c", "import shutil; shutil.make_archive('suspect.gdb', 'zip', '.', 'suspect.gdb')"])
        .current_dir(&folder)
        .status();
    assert!(zipped.unwrap().success());
    assert_answer(&folder.path().join("suspect.gdb.zip"), 0, "verdict:      MATCH");
    fs::rename(folder.path().join("suspect.gdb.zip"), folder.path().join("suspect.zip")).unwrap();
    assert_answer(&folder.path().join("suspect.zip"), 5, "convert it with \"unzip ");
}

#[test]
fn a_folder_of_tiles_is_read_at_its_highest_zoom_and_a_tile_alone_too() {
    let folder = TempDir::new().unwrap();
    let zooms = ["-dsco", "MINZOOM=9", "-dsco", "MAXZOOM=16", "-dsco", "SIMPLIFICATION=0"];
    convert(&folder, "tiles", &[&["-f", "MVT"], &zooms[..]].concat());
    convert(&folder, "others", &[&["-f", "MVT", "-dsco", "TILE_EXTENSION=mvt"], &zooms[..]].concat());
    assert_answer(&folder.path().join("others"), 0, "verdict:      MATCH");
    assert_answer(&folder.path().join("tiles"), 0, "verdict:      MATCH");
    assert_answer(&folder.path().join("tiles/16"), 0, "verdict:      MATCH");
    let column = fs::read_dir(folder.path().join("tiles/9")).unwrap().next().unwrap().unwrap().path();
    let tile = fs::read_dir(column).unwrap().next().unwrap().unwrap().path();
    assert_answer(&tile, 3, "INCONCLUSIVE"); // 19 m wide grid
}

#[test]
fn tiles_in_a_database_that_points_at_files_are_refused() {
    let folder = TempDir::new().unwrap();
    convert(&folder, "tiles.mbtiles", &["-f", "MBTiles", "-dsco", "MAXZOOM=16", "-dsco", "MINZOOM=16"]);
    let path = folder.path().join("tiles.mbtiles");
    let database = rusqlite::Connection::open(&path).unwrap();
    let entry = "PRAGMA writable_schema = 1; INSERT INTO sqlite_master (type, name, tbl_name, rootpage, sql) VALUES \
                 ('table', 'x', 'x', 0, 'CREATE VIRTUAL TABLE x USING VirtualOGR(''/etc/passwd'')')";
    database.execute_batch(entry).unwrap();
    drop(database);
    assert_answer(&path, 5, "may point at other files");
}

#[test]
fn tables_with_coordinates_in_columns_are_read() {
    for (x, y, delimiter, srs) in [
        ("x", "y", ',', None),
        ("X", "Y", ';', None),
        ("Easting", "Northing", '\t', None),
        ("lon", "lat", ',', Some(4326)),
        ("Longitude", "Latitude", ';', Some(4326)),
        ("POINT_X", "POINT_Y", ',', None),
    ] {
        let folder = TempDir::new().unwrap();
        let mut table = format!("id{delimiter}{y}{delimiter}{x}\n");
        for (id, [east, north]) in marked(srs).into_iter().enumerate() {
            writeln!(table, "{id}{delimiter}{north}{delimiter}{east}").unwrap();
        }
        assert_answer(&write(&folder, "points.csv", &table), 0, "verdict:      MATCH");
    }
}

#[test]
fn tables_with_geometries_as_text_are_read_whatever_their_column() {
    for name in ["WKT", "geom", "geometry", "wkt_geom"] {
        let folder = TempDir::new().unwrap();
        // The columns x and y of a table with geometries are attributes.
        let mut table = format!("x,y,{name}\n");
        for [x, y] in marked(None) {
            writeln!(table, "1,2,POINT ({x} {y})").unwrap();
        }
        assert_answer(&write(&folder, "points.csv", &table), 0, "verdict:      MATCH");
    }
}

#[test]
fn a_table_without_known_columns_is_refused_with_the_options_to_convert_it() {
    let folder = TempDir::new().unwrap();
    let path = write(&folder, "my points.csv", "this,that\n1,2\n");
    let copy = folder.path().join("my points.gpkg");
    let command = format!(
        "convert it with \"ogr2ogr '{}' '{}' -oo X_POSSIBLE_NAMES=column -oo Y_POSSIBLE_NAMES=column\"",
        copy.display(),
        path.display()
    );
    assert_answer(&path, 5, &command);
}

#[test]
fn only_a_map_that_is_found_is_said_to_be_read_as_a_crs() {
    let folder = TempDir::new().unwrap();
    let table = |of: fn([f64; 2]) -> [f64; 2]| {
        let rows = marked(None).into_iter().map(of).map(|[x, y]| format!("{x},{y}\n"));
        format!("x,y\n{}", rows.collect::<String>())
    };
    assert_answer(&write(&folder, "marked.csv", &table(|point| point)), 0, "read as EPSG:3067");
    // Every vertex moves in its own direction, so that nothing of the map remains.
    let foreign = |[x, y]: [f64; 2]| [x + 500.0 * (x * 7.0).sin(), y + 500.0 * (y * 7.0).cos()];
    let (code, text) = verify(&write(&folder, "foreign.csv", &table(foreign)));
    assert!(code == Some(3) && !text.contains("read as"), "{text}");
}

/// The vertices of the marked map, perhaps in another CRS.
fn marked(epsg: Option<u32>) -> Vec<[f64; 2]> {
    let mut all: Vec<[f64; 2]> = outlines(epsg).into_iter().flatten().collect();
    all.sort_by(|a, b| a.partial_cmp(b).unwrap());
    all.dedup();
    all
}

/// The rings and lines of the marked map, perhaps in another CRS.
fn outlines(epsg: Option<u32>) -> Vec<Vec<[f64; 2]>> {
    use gdal::spatial_ref::{AxisMappingStrategy::TraditionalGisOrder, CoordTransform, SpatialRef};
    let dataset = Dataset::open(fixture("vectors/marked.gpkg")).unwrap();
    let mut lines = Vec::new();
    for mut layer in dataset.layers() {
        let transform = epsg.map(|epsg| {
            let mut both = [layer.spatial_ref().unwrap(), SpatialRef::from_epsg(epsg).unwrap()];
            both.iter_mut().for_each(|srs| srs.set_axis_mapping_strategy(TraditionalGisOrder));
            let [from, to] = both;
            CoordTransform::new(&from, &to).unwrap()
        });
        for feature in layer.features() {
            let geometry = feature.geometry().unwrap();
            let geometry = transform.as_ref().map_or(geometry.clone(), |t| geometry.transform(t).unwrap());
            collect(&geometry, &mut lines);
        }
    }
    lines
}

fn collect(geometry: &Geometry, lines: &mut Vec<Vec<[f64; 2]>>) {
    if geometry.point_count() > 0 {
        let mut points = Vec::new();
        geometry.get_points(&mut points);
        lines.push(points.into_iter().map(|(x, y, _)| [x, y]).collect());
    }
    let parts = geometry.geometry_count();
    (0..parts).for_each(|part| collect(&geometry.get_geometry(part), lines));
}

/// A drawing of the marked map, `wide` pixels wide, with y downwards.
fn drawing(wide: f64, decimals: usize, element: impl Fn(&str) -> String) -> String {
    let [left, top, east] = [496_888.0, 6_711_600.0, 1068.0];
    let scale = wide / east;
    let mut text = format!(
        "<?xml version=\"1.0\"?>\n<!DOCTYPE svg PUBLIC \"-//W3C//DTD SVG 1.1//EN\" \
         \"http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd\">\n\
         <svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" \
         width=\"{wide}\" height=\"{wide}\"><defs><path id=\"star\" d=\"M0,0 1,1\"/></defs>\n"
    );
    for outline in outlines(None) {
        let point =
            |[x, y]: &[f64; 2]| format!("{:.decimals$},{:.decimals$}", (x - left) * scale, (top - y) * scale);
        let points: Vec<String> = outline.iter().map(point).collect();
        text += &element(&points.join(" "));
        text.push('\n');
    }
    text + "</svg>\n"
}

#[test]
fn drawings_are_read_under_their_transforms() {
    let path = |points: &str| format!("<path fill=\"none\" d=\"M {points}\"/>");
    let polyline = |points: &str| {
        format!(
            "<g transform=\"rotate(30) scale(2 3)\"><polyline transform=\"translate(7,-9)\" points=\"{points}\"/></g>"
        )
    };
    let curves = |points: &str| {
        // Straight lines as cubic curves: the control points lie at their ends.
        let mut points = points.split(' ');
        let first = points.next().unwrap();
        let mut data = format!("M{first}");
        let mut last = first;
        for point in points {
            write!(data, "C{last} {point} {point}").unwrap();
            last = point;
        }
        format!("<path d=\"{data}\"/>")
    };
    let folder = TempDir::new().unwrap();
    for (name, text) in [
        ("path.svg", drawing(16_000.0, 3, path)),
        ("polyline.SVG", drawing(16_000.0, 3, polyline)),
        ("curves.svg", drawing(1600.0, 6, curves)),
        ("small.svg", drawing(1600.0, 2, path)),
    ] {
        assert_answer(&write(&folder, name, &text), 0, "verdict:      MATCH");
    }
}

#[test]
fn a_drawing_with_its_lines_in_definitions_is_read_where_they_are_used() {
    let mut body = String::new();
    let plain = drawing(16_000.0, 3, |points| format!("<path d=\"M {points}\"/>"));
    for (id, line) in plain.lines().filter(|line| line.starts_with("<path")).enumerate() {
        let path = line.replace("<path", &format!("<path id=\"a{id}\""));
        write!(body, "<defs>{path}</defs><use x=\"5\" xlink:href=\"#a{id}\"/>").unwrap();
    }
    let folder = TempDir::new().unwrap();
    let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\">";
    assert_answer(&write(&folder, "uses.svg", &format!("{svg}{body}</svg>")), 0, "verdict:      MATCH");
}

#[test]
fn drawings_that_are_none_or_have_no_end_are_refused() {
    let folder = TempDir::new().unwrap();
    let svg = |body: &str| format!("<svg xmlns=\"http://www.w3.org/2000/svg\">{body}</svg>");
    let bomb: String = (0..16)
        .map(|i| format!("<g id=\"b{i}\">{}</g>", format!("<use href=\"#b{}\"/>", i + 1).repeat(10)))
        .collect();
    let namespaces: String = (0..1000).map(|i| format!(" xmlns:n{i}=\"{i}\"")).collect();
    let attributes: String = (0..20_000).map(|i| format!(" a{i}=\"\"")).collect();
    for (name, text, part) in [
        ("text.svg", "no drawing".to_string(), "is no valid XML"),
        ("cut.svg", "<svg><path d=\"M0 0 1 1\"/>".into(), "is no valid XML"),
        ("page.svg", "<html/>".into(), "is no SVG drawing"),
        ("bomb.svg", svg(&format!("{bomb}<g id=\"b16\"/>")), "draws more than 10000000 elements"),
        ("circle.svg", svg("<g id=\"a\"><use href=\"#a\"/></g>"), "uses inside each other"),
        ("wide.svg", svg("<path d=\"M0 0C1e300 0 0 1e300 1 1\"/>"), "more than 10000000 points"),
        (
            "far.svg",
            svg("<g transform=\"scale(1e300)\"><path d=\"M0 0L1e300 1\"/></g>"),
            "coordinate that is too large",
        ),
        (
            "spaces.svg",
            svg(&format!("<g{}/>", namespaces.replace(" xmlns", "/><g xmlns"))),
            "has more than 100 namespaces",
        ),
        ("names.svg", svg(&format!("<g{attributes}/>")), "has an element of more than 256 attributes"),
        (
            "entity.svg",
            format!("<!DOCTYPE svg [<!ENTITY e SYSTEM \"/etc/passwd\">]>{}", svg("&e;")),
            "declares entities",
        ),
    ] {
        let path = write(&folder, name, &text);
        assert_answer(&path, 5, part);
        assert_answer(&path, 5, "convert it with \"inkscape --export-plain-svg --export-filename=");
    }
    let huge = folder.path().join("huge.svg");
    fs::File::create(&huge).unwrap().set_len(100_000_001).unwrap();
    assert_answer(&huge, 5, "has 100000001 bytes, where an SVG file may have 100000000");
    assert_answer(
        &write(&folder, "deep.svg", &svg(&format!("{}{}", "<g>".repeat(500_000), "</g>".repeat(500_000)))),
        3,
        "",
    );
    assert_answer(&write(&folder, "empty.svg", &svg("")), 3, "has no vertices");
    assert_answer(&write(&folder, "small.svgz", "x"), 5, "convert it with \"gunzip -c ");
}

#[test]
fn formats_that_are_not_read_name_the_command_that_converts_them() {
    let folder = TempDir::new().unwrap();
    for name in ["map.osm", "map.osm.pbf", "map.xlsx", "map.dgn", "map.txt"] {
        let path = write(&folder, name, "text");
        let copy = Path::new(name).with_extension("gpkg");
        let command =
            format!("convert it with \"ogr2ogr {} {}\"", folder.path().join(copy).display(), path.display());
        assert_answer(&path, 5, &command);
    }
}
