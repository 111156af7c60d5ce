//! Tables: the columns of a CSV file that hold its coordinates.

use gdal::{
    Dataset,
    vector::{LayerAccess, OGRwkbGeometryType::wkbNone},
};

/// Names of columns with x and y, in lower case; the first pair that a table has is the one to read.
const PAIRS: &[[&str; 2]] = &[
    ["x", "y"],
    ["easting", "northing"],
    ["east", "north"],
    ["e", "n"],
    ["lon", "lat"],
    ["long", "lat"],
    ["lng", "lat"],
    ["longitude", "latitude"],
    ["x_coord", "y_coord"],
    ["xcoord", "ycoord"],
    ["coord_x", "coord_y"],
    ["point_x", "point_y"],
];

/// Names of columns with geometries as text, besides GDAL's own `WKT`, in lower case.
const GEOMETRIES: &[&str] =
    &["geom", "geometry", "the_geom", "wkb_geometry", "wkt_geom", "geom_wkt", "geometry_wkt", "shape"];

/// Returns whether no layer of a dataset has geometries.
pub(super) fn is_without_geometry(dataset: &Dataset) -> bool {
    dataset.layers().all(|layer| layer.defn().geometry_type() == wkbNone)
}

/// Returns the open options for the columns with the coordinates of a CSV file; `None` without such columns.
pub(super) fn open_options(dataset: &Dataset) -> Option<Vec<String>> {
    dataset.layers().find_map(|layer| {
        let fields: Vec<String> = layer.defn().fields().map(|field| field.name()).collect();
        let field = |name: &str| fields.iter().find(|field| field.trim().eq_ignore_ascii_case(name));
        if let Some(geometry) = GEOMETRIES.iter().find_map(|name| field(name)) {
            return Some(vec![format!("GEOM_POSSIBLE_NAMES={geometry}")]);
        }
        let [x, y] = PAIRS.iter().find_map(|&[x, y]| Some([field(x)?, field(y)?]))?;
        Some(vec![format!("X_POSSIBLE_NAMES={x}"), format!("Y_POSSIBLE_NAMES={y}")])
    })
}
