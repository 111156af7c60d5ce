//! Matching: the correspondence of suspect and reference vertices (paper, section 3.5).

mod chance;
mod joined;
mod matcher;
mod matches;
mod radius;

pub use chance::LEAST_MATCHED;
pub(crate) use chance::{OUT_OF_PLACE, by_chance, is_chance, out_of_place};
pub(crate) use joined::Graph;
pub use matcher::Matcher;
pub(crate) use matcher::Near;
pub use matches::Matches;
pub use radius::{Radius, RadiusChoice, RadiusReason};
