//! Rows in which some of the features of a map remain.

use super::row::Row;
use crate::attacks::{Attack, Map};
use std::sync::Arc;

/// Returns the rows: features deleted, exchanged for those of the map before marking, or kept in
/// one small place only.
pub fn rows(unmarked: &Arc<Map>) -> Vec<Row> {
    let share = |percent: i32| f64::from(percent) / 100.0;
    let deleted = [50, 80].map(|percent| {
        let attack = Attack::DeleteFeatures { share: share(percent) };
        Row::new(&format!("features{percent}"), &format!("{percent} % of the features deleted"), attack)
    });
    let exchanged = [30, 50].map(|percent| {
        let attack = Attack::Exchange { unmarked: unmarked.clone(), share: share(percent) };
        let title = format!("{percent} % of the features exchanged for unmarked ones");
        Row::new(&format!("exchanged{percent}"), &title, attack)
    });
    let pieces = [25, 50, 100, 200, 400].map(|vertices| {
        let title = format!("a random piece of {vertices} vertices");
        Row::new(&format!("piece{vertices}"), &title, Attack::Piece { vertices })
    });
    [&deleted[..], &exchanged, &pieces].concat()
}
