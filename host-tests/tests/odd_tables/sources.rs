//! Tables with odd names and values, as files that a user may have.

use meshmark_host_tests::plugin::Host;
use rand_chacha::{ChaCha20Rng, rand_core::Rng};
use serde_json::{Map, Value, json};
use std::fs;

/// A table.
pub struct Source {
    /// The file that GDAL opens.
    pub path: String,
    /// A description for messages.
    pub what: String,
}

/// Number of houses, with four vertices each.
const HOUSES: usize = 80;

const FIELD_NAMES: &[&str] = &[
    "fid",
    "FID",
    "geom",
    "GEOM",
    "ogc_fid",
    "id",
    "ID",
    "name",
    "Name",
    "NAME",
    "a,b",
    "it's",
    "say \"x\"",
    " padded ",
    "100%",
    "%s%n",
    "select",
    "order",
    "table",
    "longer_than_ten_a",
    "longer_than_ten_b",
    "höhe",
    "HÖHE",
    "名称",
    "a.b",
    "ogr_style",
    "OGR_VALUES",
    "OGR_GEOMETRY",
    "geometry",
    "properties",
    "type",
    "rowid",
    "_ROWID_",
    "a`b",
    "[c]",
    "x\\y",
    "",
    "wkb_geometry",
    "shape",
    "MESHMARK",
    "a/b",
    "a:b",
    "#",
    "fid_2",
];

const LAYER_NAMES: &[&str] = &[
    "map",
    "gpkg_map",
    "GPKG",
    "sqlite_map",
    "rtree_map_geom",
    "a,b",
    "it's",
    "say \"x\"",
    "100%s%n",
    " padded ",
    "a.b",
    "select",
    "名称",
    "a`b",
    "[c]",
    "x\\y",
    "geometry_columns",
    "spatial_ref_sys",
    "layer_gpkg_map",
    "OGR",
];

/// OGR's types and subtypes, and values as OGR reads them from text.
const TYPES: &[(&str, &str, &[&str])] = &[
    ("Integer", "", &["0", "-1", "2147483647", "-2147483648"]),
    ("Integer", "Boolean", &["0", "1"]),
    ("Integer", "Int16", &["32767", "-32768", "7"]),
    ("Integer64", "", &["9223372036854775807", "-9223372036854775808", "9007199254740993", "0"]),
    (
        "Real",
        "",
        &[
            "0.1",
            "-0.0",
            "nan",
            "inf",
            "-inf",
            "5e-324",
            "1.7976931348623157e308",
            "123456789.12345679",
            "0",
            "1e15",
            "-1e-7",
        ],
    ),
    ("Real", "Float32", &["0.1", "-0.0", "nan", "16777217", "3.4e38"]),
    (
        "String",
        "",
        &[
            "",
            "a",
            " a ",
            "a,b;c",
            "it's \"x\"",
            "two\nlines",
            "tab\there",
            "käsi 名称",
            "100%s%n",
            "\\",
            "null",
        ],
    ),
    ("String", "JSON", &["{\"a\":[1,2]}", "[]", "\"x\"", "{ \"geometry\": 1 }"]),
    ("String", "UUID", &["00000000-0000-0000-0000-000000000000", "6f9619ff-8b86-d011-b42d-00c04fc964ff"]),
    ("Date", "", &["2024/02/29", "1970/01/01", "0001/01/01", "9999/12/31"]),
    ("Time", "", &["23:59:59", "00:00:00", "12:30:15.5"]),
    (
        "DateTime",
        "",
        &[
            "2024/02/29 12:30:15",
            "2024/02/29 12:30:15.125",
            "2024/02/29 12:30:15+00",
            "2024/02/29 12:30:15+05:30",
            "2024/02/29 12:30:15-08",
            "1899/12/31 23:59:59",
        ],
    ),
    ("IntegerList", "", &["(2:1,-2147483648)", "(1:7)", "(0:)"]),
    ("Integer64List", "", &["(2:9223372036854775807,-1)", "(1:7)"]),
    ("RealList", "", &["(3:0.1,-0.5,1e300)", "(1:7)"]),
    ("StringList", "", &["(2:a,b)", "(1:x y)", "(2:it's,\"q\")"]),
    ("Binary", "", &["abc", "7f00"]),
];

impl Source {
    /// Makes a random table.
    pub fn make(host: &Host, random: &mut ChaCha20Rng, seed: u64) -> Self {
        match seed % 3 {
            0 => virtual_table(host, random),
            1 => geojson(host, random),
            _ => shapefile(host, random),
        }
    }
}

fn below(random: &mut ChaCha20Rng, count: usize) -> usize {
    (random.next_u64() % count as u64) as usize
}

fn choice<'a, T>(random: &mut ChaCha20Rng, of: &'a [T]) -> &'a T {
    &of[below(random, of.len())]
}

/// Returns this number of different choices.
fn choices<'a, T>(random: &mut ChaCha20Rng, of: &'a [T], count: usize) -> Vec<&'a T> {
    let mut rest: Vec<&T> = of.iter().collect();
    (0..count.min(of.len())).map(|_| rest.swap_remove(below(random, rest.len()))).collect()
}

/// Returns the corners of a house in degrees, which every format accepts.
fn house(number: usize, random: &mut ChaCha20Rng) -> Vec<[f64; 2]> {
    let (x, y) = (24.9 + (number % 10) as f64 * 6e-4, 60.2 + (number / 10) as f64 * 3e-4);
    let mut jitter = || below(random, 10_000) as f64 * 1e-9;
    let corners = [[0.0, 0.0], [2e-4, 0.0], [2e-4, 1e-4], [0.0, 1e-4], [0.0, 0.0]];
    let mut ring: Vec<[f64; 2]> =
        corners.iter().map(|[dx, dy]| [x + dx + jitter(), y + dy + jitter()]).collect();
    ring[4] = ring[0];
    ring
}

/// Makes a virtual layer over a CSV file: fields of any type and name, layers of any name.
fn virtual_table(host: &Host, random: &mut ChaCha20Rng) -> Source {
    let layer = *choice(random, LAYER_NAMES);
    let names = choices(random, FIELD_NAMES, 4);
    let types = choices(random, TYPES, 4);
    let nulls = below(random, 2) == 0;
    let without_place = below(random, 4) == 0;
    let latin = below(random, 4) == 0;
    let mut csv = b"nr,c0,c1,c2,c3,WKT\n".to_vec();
    for number in 0..HOUSES {
        csv.extend(number.to_string().bytes());
        for (_, subtype, values) in &types {
            let value = if nulls && below(random, 4) == 0 { "" } else { choice(random, values) };
            csv.extend(format!(",\"{}\"", value.replace('"', "\"\"")).bytes());
            if latin && subtype.is_empty() && value == "a" {
                csv.truncate(csv.len() - 1);
                csv.extend(b"\xe9\"");
            }
        }
        let ring: Vec<String> = house(number, random).iter().map(|[x, y]| format!("{x} {y}")).collect();
        let wkt = match number {
            7 if without_place => String::new(),
            8 if without_place => "POLYGON EMPTY".into(),
            _ => format!("POLYGON (({}))", ring.join(",")),
        };
        csv.extend(format!(",\"{wkt}\"\n").bytes());
    }
    fs::write(host.path("table.csv"), csv).unwrap();
    let escape = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    let mut fields = String::new();
    for (number, (name, (kind, subtype, _))) in names.iter().zip(&types).enumerate() {
        let subtype = if subtype.is_empty() { String::new() } else { format!(" subtype=\"{subtype}\"") };
        fields += &format!("<Field name=\"{}\" src=\"c{number}\" type=\"{kind}\"{subtype}/>", escape(name));
    }
    let empty =
        if nulls { "<OpenOptions><OOI key=\"EMPTY_STRING_AS_NULL\">YES</OOI></OpenOptions>" } else { "" };
    let xml = format!(
        "<OGRVRTDataSource><OGRVRTLayer name=\"{}\"><SrcDataSource relativeToVRT=\"1\">table.csv</SrcDataSource>{empty}\
         <SrcLayer>table</SrcLayer><GeometryType>wkbPolygon</GeometryType><LayerSRS>EPSG:4326</LayerSRS>\
         <GeometryField encoding=\"WKT\" field=\"WKT\"/><Field name=\"nr\" src=\"nr\" type=\"Integer\"/>{fields}\
         </OGRVRTLayer></OGRVRTDataSource>",
        escape(layer)
    );
    fs::write(host.path("table.vrt"), xml).unwrap();
    let fields: Vec<String> = names
        .iter()
        .zip(&types)
        .map(|(name, (kind, subtype, _))| format!("{name:?} {kind} {subtype}"))
        .collect();
    let what = format!(
        "a layer {layer:?} with {} (nulls {nulls}, no place {without_place}, latin {latin})",
        fields.join(", ")
    );
    Source { path: "table.vrt".into(), what }
}

/// Makes a GeoJSON file, in which a property may be missing, null, or of another type in every
/// feature.
fn geojson(host: &Host, random: &mut ChaCha20Rng) -> Source {
    let layer = *choice(random, LAYER_NAMES);
    let names = choices(random, FIELD_NAMES, 5);
    let kinds: Vec<usize> = names.iter().map(|_| below(random, 10)).collect();
    let (ids, without_place) = (below(random, 4), below(random, 6) == 0);
    let (heights, foreign) = (below(random, 6), below(random, 2) == 0);
    let mut features = Vec::new();
    for number in 0..HOUSES {
        let mut properties = Map::from_iter([("nr".to_string(), json!(number))]);
        for (name, kind) in names.iter().zip(&kinds) {
            let value = value_of(*kind, number, random);
            match below(random, 5) {
                0 => continue,
                1 => drop(properties.insert(name.to_string(), Value::Null)),
                _ => drop(properties.insert(name.to_string(), value)),
            }
        }
        let ring = house(number, random).into_iter().map(|[x, y]| match heights {
            0 => json!([x, y, number, 0.5]),
            1 => json!([x, y, number]),
            _ => json!([x, y]),
        });
        let mut feature = json!({"type": "Feature", "properties": properties,
            "geometry": {"type": "Polygon", "coordinates": [ring.collect::<Vec<_>>()]}});
        if foreign && number % 3 == 0 {
            feature["bbox"] = json!([0, 0, 1, 1]);
            feature["title"] = json!({"bbox": [number], "coordinates": ["käsi", "\"geometry\": {"]});
            feature["geometry"]["more"] = json!([number, {"coordinates": [number, 2]}]);
            feature["geometry"]["bbox"] = json!([0, 0, 1, 1]);
        }
        match ids {
            0 => feature["id"] = json!(1000 - number),
            1 => feature["id"] = json!(format!("way/{number}")),
            2 => feature["id"] = json!(number / 2),
            _ => {}
        }
        match below(random, 20) {
            0 => feature["properties"] = Value::Null,
            // A reader takes the geometry for a value of the attribute of that name then.
            1 if !names.contains(&&"geometry") => {
                feature.as_object_mut().unwrap().remove("properties");
            }
            _ => {}
        }
        if without_place && number == 7 {
            feature["geometry"] = Value::Null;
        }
        features.push(feature);
    }
    let mut all = json!({"type": "FeatureCollection", "features": features});
    if below(random, 3) > 0 {
        all["name"] = json!(layer);
    }
    if foreign {
        all["bbox"] = json!([0, 0, 1, 1]);
        all["licence <1>"] = json!({"bbox": [1, 2], "by": "a & \"b\""});
    }
    fs::write(host.path("table.geojson"), all.to_string()).unwrap();
    let what = format!(
        "a GeoJSON file {layer:?} with {names:?} of kinds {kinds:?}, ids {ids}, no place {without_place}, heights \
         {heights}, foreign members {foreign}"
    );
    Source { path: "table.geojson".into(), what }
}

fn value_of(kind: usize, number: usize, random: &mut ChaCha20Rng) -> Value {
    match kind {
        0 => json!(number as i64 - 40),
        1 => json!(i64::MAX - number as i64),
        2 => {
            choice(random, &[json!(-0.0), json!(0.1), json!(1e300), json!(5e-324), json!(1.0 / 3.0)]).clone()
        }
        3 => choice(random, &[json!(""), json!("a\nb"), json!("x".repeat(300)), json!("käsi \"x\" \\")])
            .clone(),
        4 => json!(number.is_multiple_of(2)),
        5 => json!([number, -1]),
        6 => json!(["a,b", "(c)", ""]),
        7 => json!({"geometry": {"coordinates": [1, 2]}, "n": number}),
        8 => json!(["2024-02-29T12:30:15+05:30", "2024-02-29T12:30:15Z", "2024-02-29"][number % 3]),
        _ => choice(random, &[json!(1), json!("1"), json!(1.5), json!([0.25, 1e300])]).clone(),
    }
}

/// Makes a Shapefile whose names and texts are bytes of any encoding, whatever its code page.
fn shapefile(host: &Host, random: &mut ChaCha20Rng) -> Source {
    let layer = ["map", "gpkg_map", "sqlite_map", "a,b", "it's", "100%s%n", "名称"][below(random, 7)];
    let fields = 4;
    let mut features = Vec::new();
    for number in 0..HOUSES {
        let mut properties = Map::from_iter([("nr".to_string(), json!(number))]);
        for field in 0..fields {
            let value = match field {
                0 => json!(format!("text {number}")),
                1 => json!(number as f64 * 1.25),
                2 => json!(number as i64 * 1_000_000_007),
                _ => json!(["", "aaaa", "bb"][number % 3]),
            };
            properties.insert(format!("field_{field}"), value);
        }
        let ring = house(number, random);
        features.push(json!({"type": "Feature", "properties": properties,
            "geometry": {"type": "Polygon", "coordinates": [ring]}}));
    }
    let text = json!({"type": "FeatureCollection", "features": features}).to_string();
    fs::write(host.path("table.geojson"), text).unwrap();
    let path = format!("{layer}.shp");
    host.run("ogr2ogr", &["-f", "ESRI Shapefile", &path, "table.geojson"]).succeeds();
    let names: &[&[u8]] = &[
        b"fid",
        b"FID",
        b"geom",
        b"Geom",
        b"ogc_fid",
        b"NAME",
        b"name",
        b"h\xf6he",
        b"h\xc3\xb6he",
        b"\xff\xfe",
        b"a,b",
        b"it's",
        b"say \"x\"",
        b" pad ",
        b"100%s",
        b"select",
        b"x\\y",
        b"OGR_STYLE",
        b"\xd0\xc8\xc1",
    ];
    let names = choices(random, names, fields);
    let mut table = fs::read(host.path(&format!("{layer}.dbf"))).unwrap();
    for (number, name) in names.iter().enumerate() {
        let place = 32 * (number + 2);
        table[place..place + 11].fill(0);
        table[place..place + name.len()].copy_from_slice(name);
    }
    let text_bytes = below(random, 3);
    let record = u16::from_le_bytes([table[10], table[11]]) as usize;
    let start = u16::from_le_bytes([table[8], table[9]]) as usize;
    for byte in table[start..start + record * HOUSES].iter_mut().filter(|byte| **byte == b'a') {
        *byte = [b'a', 0xe9, 0x80][text_bytes];
    }
    fs::write(host.path(&format!("{layer}.dbf")), table).unwrap();
    let page = *choice(random, &["", "UTF-8", "ISO-8859-1", "nonsense", "1251"]);
    let file = host.path(&format!("{layer}.cpg"));
    match page {
        "" => drop(fs::remove_file(file)),
        page => fs::write(file, page).unwrap(),
    }
    let names: Vec<_> = names.iter().map(|name| String::from_utf8_lossy(name)).collect();
    Source { what: format!("{path:?} with {names:?}, code page {page:?}, bytes {text_bytes}"), path }
}
