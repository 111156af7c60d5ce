//! Values of calls: usual ones, odd ones and impossible ones.

use super::*;
use gdal_sys::{OGRFieldType, OGRwkbGeometryType};

pub const KEY: &str = include_str!("../../../fixtures/vectors/key.json");

pub const TARGETS: &[&str] = &[
    "out.gpkg",
    "out.geojson",
    "out.fgb",
    "out.geojsonl",
    "out.shp.zip",
    "out.shz",
    "out",
    "no/out.gpkg",
    "key.json",
];
pub const SOURCES: &[&str] = &["houses.geojson", "houses.geojson", "key.json", "missing.gpkg", ""];
pub const SRS: &[&str] = &["EPSG:3067", "EPSG:4326", "EPSG:3857", ""];
pub const NAMES: &[&str] =
    &["houses", "a", "gpkg_a", "", "ä ö", "select", "sqlite_a", "a\"b", "layer_gpkg_a", "HOUSES"];
pub const GEOMETRY_TYPES: &[OGRwkbGeometryType::Type] = &[
    OGRwkbGeometryType::wkbUnknown,
    OGRwkbGeometryType::wkbPolygon,
    OGRwkbGeometryType::wkbMultiPolygon25D,
    OGRwkbGeometryType::wkbNone,
    OGRwkbGeometryType::wkbCurvePolygon,
    OGRwkbGeometryType::wkbPoint,
];
pub const CREATION_OPTIONS: &[&str] = &[
    "OVERWRITE=YES",
    "FORMAT=GeoJSON",
    "FORMAT=None",
    "RECORD={}/record.json",
    "MESSAGE=00ff",
    "CODE=REPETITION",
    "SHAPE=RIGID",
    "BASIS=COTANGENT",
    "TOLERANCE=1e-9",
    "PRECISION=1",
    "LAYERS=houses",
    "LAYERS=\"a,b",
    "AMPLITUDE=",
    "NO SUCH=1",
    "no equals sign",
    "RECIPIENT=\u{202e}",
    "KEY={}/missing",
    "REFERENCE={}/out.gpkg",
    "ATTRIBUTES=REFUSE",
    "SRS=EPSG:3067",
];
pub const OPEN_OPTIONS: &[&str] = &[
    "NATIVE_DATA=YES",
    "RECORD={}/record.json",
    "MESSAGE=00ff",
    "SHAPE=RIGID",
    "PRECISION=1",
    "LAYERS=houses",
    "LAYERS=",
    "AMPLITUDE=nan",
    "TOLERANCE=1e7",
    "SRS=?",
    "RECORD={}/key.json",
    "CHIP_RATE=2048",
    "ATTRIBUTES=REFUSE",
];
pub const LAYER_OPTIONS: &[&str] = &[
    "",
    "COORDINATE_PRECISION={}",
    "SIGNIFICANT_FIGURES={}",
    "RFC7946=YES",
    "FID=id",
    "GEOMETRY_NAME=fid",
    "SPATIAL_INDEX=NO",
    "ID_FIELD=a",
    "NATIVE_DATA={\"a\":{\"coordinates\":[1,2]}}",
    "NATIVE_DATA={é:1}",
    "=",
    "WRITE_BBOX=YES",
    "ENCODING=none",
    "SHPT=POINT",
];
pub const TEXTS: &[&str] = &[
    "",
    "NATIVE_DATA",
    "NATIVE_MEDIA_TYPE",
    "application/vnd.geo+json",
    "{\"x\":{\"bbox\":[1,2,3,4]}}",
    "{é",
    "a",
    "ä\n",
    "{\"type\":\"Feature\",\"id\":7,\"geometry\":{\"coordinates\":[[[1,2,3,4]]]}}",
];
const FIELD_TYPES: &[OGRFieldType::Type] = &[
    OGRFieldType::OFTString,
    OGRFieldType::OFTInteger,
    OGRFieldType::OFTInteger64,
    OGRFieldType::OFTReal,
    OGRFieldType::OFTDateTime,
    OGRFieldType::OFTTime,
    OGRFieldType::OFTBinary,
    OGRFieldType::OFTStringList,
    OGRFieldType::OFTRealList,
];
const FIELD_NAMES: &[&str] = &["a", "A", "fid", "geom", "OGR_STYLE", "", "name", "äöü", "ogr_values", "a_2"];
const GEOMETRIES: &[&str] = &[
    "POINT EMPTY",
    "POINT (1 2)",
    "POLYGON ((0 0,9 0,9 9,0 0))",
    "LINESTRING Z (1 2 3,4 5 6)",
    "POLYGON EMPTY",
    "GEOMETRYCOLLECTION (POINT (1 2),GEOMETRYCOLLECTION EMPTY)",
    "CIRCULARSTRING (0 0,1 1,2 0)",
    "POINT (1e308 -1e308)",
    "TIN (((0 0,9 0,9 9,0 0)))",
    "POINT M (nan 3 1)",
];
const FILTERS: &[&str] = &["", "fid > 3", "no such", "name = 'b'"];

/// Returns one of several values.
pub fn pick<T: Copy>(values: &[T], input: &mut Input) -> T {
    values[usize::from(input.byte()) % values.len()]
}

pub fn c_text(text: &str) -> CString {
    CString::new(text).expect("it has no NUL")
}

/// Houses of four corners along streets, as many as a mark needs.
pub fn house_texts() -> impl Iterator<Item = String> {
    (0..160).map(|i| {
        let [x, y] = [385_000 + i % 12 * 40 + i * i % 7, 6_671_000 + i / 12 * 50 + i * i % 5];
        let [e, n] = [x + 9 + i % 6, y + 8 + i % 5];
        format!("POLYGON (({x} {y},{e} {y},{e} {n},{x} {n},{x} {y}))")
    })
}

/// The same houses as GeoJSON in metres.
pub fn houses() -> String {
    let feature = |text: String| {
        let geometry = Geometry::from_wkt(&text).and_then(|geometry| geometry.json()).expect("a house");
        format!(r#"{{"type":"Feature","properties":{{"name":"b"}},"extra":[1],"geometry":{geometry}}}"#)
    };
    let features: Vec<String> = house_texts().map(feature).collect();
    let crs = r#"{"type":"name","properties":{"name":"EPSG:3067"}}"#;
    format!(r#"{{"type":"FeatureCollection","crs":{crs},"features":[{}]}}"#, features.join(",\n"))
}

/// Creates a field; that a format lacks it is no fault of the dataset.
pub fn add_field(layer: &Layer, input: &mut Input) -> bool {
    let field = FieldDefn::new(pick(FIELD_NAMES, input), pick(FIELD_TYPES, input)).expect("a field");
    field.set_width(i32::from(input.byte() as i8));
    let _ = checked(|| field.add_to_layer(layer), Result::is_err);
    false
}

/// Makes a feature of a layer, with values that the input chooses.
pub fn feature<'a>(layer: &'a Layer, input: &mut Input) -> Feature<'a> {
    let mut feature = Feature::new(layer.defn()).expect("a feature");
    let flags = input.byte();
    if flags & 1 == 0 {
        let geometry = Geometry::from_wkt(pick(GEOMETRIES, input)).expect("a geometry");
        feature.set_geometry(geometry).ok(); // a layer may have none
    }
    for field in 0..feature.field_count() {
        match input.byte() % 6 {
            0 => feature.set_field_string(field, pick(TEXTS, input)).expect("a text"),
            1 => feature.set_field_double(field, input.number()).expect("a number"),
            2 => feature.set_field_integer64(field, i64::from(input.short())).expect("a number"),
            3 => feature.set_field_null(field).expect("a field"),
            4 => feature.set_field_string_list(field, &[pick(TEXTS, input), "b"]).expect("a list"),
            _ => {}
        }
    }
    let [style, native] = [(); 2].map(|()| c_text(pick(TEXTS, input)));
    // SAFETY: the feature is there, and GDAL copies the texts.
    unsafe {
        let handle = feature.c_feature();
        if flags & 2 != 0 {
            gdal_sys::OGR_F_SetFID(handle, i64::from(input.short()));
        }
        if flags & 4 != 0 {
            gdal_sys::OGR_F_SetStyleString(handle, style.as_ptr());
            gdal_sys::OGR_F_SetNativeData(handle, native.as_ptr());
            gdal_sys::OGR_F_SetNativeMediaType(handle, c"application/vnd.geo+json".as_ptr());
        }
    }
    feature
}

/// Asks a dataset for something and looks at the answer.
pub fn ask(dataset: &Dataset, input: &mut Input) {
    let number = i32::from(input.byte() as i8);
    // SAFETY: the dataset is open, and so are its layers; GDAL gives features away.
    unsafe {
        let handle = dataset.c_dataset();
        gdal_sys::GDALDatasetTestCapability(handle, c"CreateLayer".as_ptr());
        gdal_sys::GDALGetFileList(handle);
        let layer = gdal_sys::GDALDatasetGetLayer(handle, number);
        if layer.is_null() {
            return;
        }
        let what = input.byte() % 8;
        checked(
            || match what {
                0 => drop(gdal_sys::OGR_L_GetFeatureCount(layer, 1)),
                1 => gdal_sys::OGR_L_SetSpatialFilterRect(
                    layer,
                    385_000.0,
                    6_671_000.0,
                    385_100.0,
                    6_671_100.0,
                ),
                2 => drop(gdal_sys::OGR_L_SetAttributeFilter(layer, c_text(pick(FILTERS, input)).as_ptr())),
                3 => drop(gdal_sys::OGR_L_SetNextByIndex(layer, i64::from(input.short()))),
                4 => gdal_sys::OGR_F_Destroy(gdal_sys::OGR_L_GetFeature(layer, i64::from(input.short()))),
                5 => gdal_sys::OGR_L_ResetReading(layer),
                6 => {
                    let mut extent = gdal_sys::OGREnvelope { MinX: 0.0, MaxX: 0.0, MinY: 0.0, MaxY: 0.0 };
                    gdal_sys::OGR_L_GetExtent(layer, &mut extent, 1);
                }
                _ => {
                    for _ in 0..200 {
                        let feature = gdal_sys::OGR_L_GetNextFeature(layer);
                        if feature.is_null() {
                            break;
                        }
                        gdal_sys::OGR_F_Destroy(feature);
                    }
                }
            },
            |()| false,
        );
    }
}
