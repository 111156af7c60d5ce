//! Rows in which formats and media change coordinates and attributes.

use super::row::Row;
use crate::attacks::Attack;
use crate::attacks::{
    Map,
    formats::Format,
    quantisation::Quantisation,
    similarity::{About, rotation, scaling, shear},
};
use std::sync::Arc;

/// Returns the rows: other CRS and files, grids of formats, paper.
pub fn rows(foreign: &Arc<Map>) -> Vec<Row> {
    use Attack::{DropAttributes, Merge, Quantise, Reproject, RoundTrip};
    let mut rows = vec![
        Row::new("4326", "EPSG:4326, 7 decimals", Reproject { epsg: 4326, decimals: Some(7) }),
        Row::new("3857", "EPSG:3857", Reproject { epsg: 3857, decimals: None }),
        Row::new("bare", "attributes dropped", DropAttributes),
        Row::new("merge", "a foreign map laid over", Merge(foreign.clone())),
    ];
    rows.extend([Format::Shapefile, Format::GeoJson, Format::FlatGeobuf, Format::Kml].map(|format| {
        let id = format.name().to_lowercase();
        Row::new(&id, &format!("{} and back", format.name()), RoundTrip(format))
    }));
    rows.extend((11..=16).map(|zoom| {
        let title = format!("vector tiles of zoom {zoom}");
        Row::new(&format!("tiles{zoom}"), &title, Quantise(Quantisation::VectorTiles { zoom }))
    }));
    rows.extend([
        Row::new("topojson", "TopoJSON, 10⁴ points an axis", Quantise(Quantisation::TopoJson)),
        Row::new("svg1600", "a drawing (SVG) of 1600 pixels", Quantise(Quantisation::Svg { width: 1600.0 })),
        printed_and_scanned(),
    ]);
    rows
}

/// Returns the row of a map on paper at 1 : 2000, in millimetres, slightly rotated, and digitised
/// with errors of 15 cm.
fn printed_and_scanned() -> Row {
    let attacks = vec![
        Attack::DropAttributes,
        Attack::GaussianNoise { deviation: 0.15 },
        Attack::Linear(shear(0.003), About::Centre),
        Attack::Linear(rotation(1.7), About::Centre),
        Attack::Linear(scaling(0.5, 0.5), About::Corner),
    ];
    Row::new("scan", "printed, scanned and digitised, attributes dropped", Attack::Sequence(attacks))
}
