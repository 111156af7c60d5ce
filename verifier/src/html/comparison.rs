//! The report of a comparison.

use super::page;
use crate::compare::Comparison;
use maud::html;

/// What marking did to a map.
pub fn comparison(comparison: &Comparison) -> String {
    let _ = comparison;
    page("Quality of a marked map", "meshmark", &html! {})
}
