//! Labels: attribute texts with the places of their features, from which a verifier makes
//! landmarks.

use crate::selection::LabelFields;
use gdal::vector::{Feature, FieldValue};
use geo::{Centroid, Geometry, HasDimensions, dimensions::Dimensions};
use meshmark_core::map_data::{Dimension, Label};

/// Returns the labels of one feature, with their places.
pub(crate) fn of_feature(
    feature: &Feature,
    geometry: &Geometry,
    fields: &LabelFields,
    labels: &mut Vec<Label>,
) {
    let values: Vec<String> = feature
        .fields()
        .filter(|(name, _)| fields.wants(name))
        .filter_map(|(_, value)| text(value?))
        .collect();
    if values.is_empty() {
        return;
    }
    let Some((point, dimension)) = place(geometry) else { return };
    labels.extend(values.into_iter().map(|value| Label { value, point, dimension }));
}

fn text(value: FieldValue) -> Option<String> {
    let text = match value {
        FieldValue::StringValue(text) => text.trim().to_string(),
        FieldValue::IntegerValue(number) => number.to_string(),
        FieldValue::Integer64Value(number) => number.to_string(),
        _ => return None,
    };
    (!text.is_empty()).then_some(text)
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
