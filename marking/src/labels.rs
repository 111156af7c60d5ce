//! Labels: attribute texts with the places of their features, from which a verifier makes
//! landmarks.

use geo::{Centroid, Geometry, HasDimensions, dimensions::Dimensions};
use meshmark_core::map_data::{Dimension, Label};

/// Appends the labels of one feature with these attribute texts, at its place.
pub(crate) fn append(values: Vec<String>, geometry: &Geometry, labels: &mut Vec<Label>) {
    let values: Vec<&str> =
        values.iter().map(|value| value.trim()).filter(|value| !value.is_empty()).collect();
    if values.is_empty() {
        return;
    }
    let Some((point, dimension)) = place(geometry) else { return };
    labels.extend(values.into_iter().map(|value| Label { value: value.into(), point, dimension }));
}

fn place(geometry: &Geometry) -> Option<([f64; 2], Dimension)> {
    let dimension = match geometry.dimensions() {
        Dimensions::Empty => return None,
        Dimensions::ZeroDimensional => Dimension::Point,
        Dimensions::OneDimensional => Dimension::Line,
        Dimensions::TwoDimensional => Dimension::Area,
    };
    let centroid = geometry.centroid()?;
    (centroid.x().is_finite() && centroid.y().is_finite())
        .then_some(([centroid.x(), centroid.y()], dimension))
}
