//! Rows in which vertices move together: buildings, features, a whole sheet.

use super::row::Row;
use crate::attacks::Attack;
use crate::attacks::bodies::Motion;

/// Returns the rows: buildings shifted and rotated, sheets bent, features redrawn.
pub fn rows() -> Vec<Row> {
    let shifted = [0.3, 1.0, 2.0].map(|deviation| {
        let title = format!("every building shifted by N(0, {deviation} m)");
        bodies(&format!("shifted{deviation}"), &title, deviation, 0.0)
    });
    let turned = [1.0, 2.0].map(|degrees| {
        bodies(&format!("turned{degrees}"), &format!("every building turned by ±{degrees}°"), 0.0, degrees)
    });
    let title = "every building shifted by N(0, 1 m) and turned by ±2°";
    let both = bodies("shifted1turned2", title, 1.0, 2.0);
    let sheets = [2.0, 5.0, 10.0].map(|amplitude| {
        let title = format!("rubber sheet, ±{amplitude} m in waves of 100 m to 200 m");
        Row::new(&format!("sheet{amplitude}"), &title, Attack::RubberSheet { amplitude })
    });
    let redrawn = Attack::Redraw { share: 0.3, deviation: 0.5 };
    let redrawn = Row::new("redrawn30", "30 % of the features redrawn, Gaussian 0.5 m", redrawn);
    [&shifted[..], &turned, &[both], &sheets, &[redrawn]].concat()
}

fn bodies(id: &str, title: &str, deviation: f64, degrees: f64) -> Row {
    Row::new(id, title, Attack::MoveBodies(Motion { deviation, degrees }))
}
