//! The attacks by name: the rows of Table 2 and of the table of other attacks.

mod areas;
mod bodies;
mod curves;
mod files;
mod row;
mod shares;

pub use row::Row;

use super::{
    Attack, Map, Random,
    crop::Window,
    deformation::{Cell, Side},
    similarity::{About, mirror, rotation, scaling, shear},
};
use std::sync::Arc;

/// The paper's unit, 10 cm, in metres: maps are in metres here.
const UNIT: f64 = 0.1;

/// Returns the attacks of Table 2 (Ohbuchi, Ueda and Endoh 2003). For 3a and 3b the text and the
/// table state opposite factors; those of the table are used. Figure 7 shows the crops, but the
/// text does not number them.
pub fn paper_rows() -> Vec<Row> {
    use Attack::{Crop, InsertVertices, Linear, Noise, Scramble, Sequence, Snap, Translate};
    let round = Snap { spacing: UNIT };
    let shift = Translate([1000.0 * UNIT, 500.0 * UNIT]);
    let scale = |factor| Linear(scaling(factor, factor), About::Corner);
    let turn = |about| Linear(rotation(45.0), about);
    let scaled = |factor| Sequence(vec![scale(factor), round.clone()]);
    let turned = vec![turn(About::Corner), shift.clone(), scale(0.6), round.clone()];
    let quarter = |column, row| Crop(Window::Quarter { column, row });
    let centre = |area_share| Crop(Window::Centre { area_share });
    let rows = [
        ("1", "translation by (1000, 500) units", shift),
        ("2", "scaling × 5.5", scale(5.5)),
        ("3a", "scaling × 0.6, rounded", scaled(0.6)),
        ("3b", "scaling × 0.3, rounded", scaled(0.3)),
        ("4a", "rotation 45° about the corner", turn(About::Corner)),
        ("4b", "rotation 45° about the centre", turn(About::Centre)),
        ("5", "rotation, translation, scaling × 0.6, rounded", Sequence(turned)),
        ("6", "cells of 75 m × 50 m turned by ±1°", deformed(Cell::Size([75.0, 50.0]), Side::Cell)),
        ("7", "object order scrambled", Scramble),
        ("8", "3000 vertices inserted", InsertVertices { count: 3000 }),
        ("9a", "noise ±10 cm", Noise { half_width: 0.1 }),
        ("9b", "noise ±30 cm", Noise { half_width: 0.3 }),
        ("9c", "noise ±50 cm", Noise { half_width: 0.5 }),
        ("10-1", "left half", Crop(Window::LeftHalf)),
        ("10-2", "top half", Crop(Window::TopHalf)),
        ("10-3", "upper left quarter", quarter(0, 1)),
        ("10-4", "upper right quarter", quarter(1, 1)),
        ("10-5", "lower left quarter", quarter(0, 0)),
        ("10-6", "lower right quarter", quarter(1, 0)),
        ("10-7", "middle 1/8", centre(1.0 / 8.0)),
        ("10-8", "middle 1/16", centre(1.0 / 16.0)),
    ];
    rows.into_iter().map(|(id, title, attack)| Row::new(id, title, attack)).collect()
}

fn deformed(cell: Cell, side: Side) -> Attack {
    Attack::Deform { cell, degrees: 1.0, side }
}

/// Other maps whose features attacks bring into the marked one.
#[derive(Debug, Clone)]
pub struct OtherMaps {
    /// A map of another place, to be laid over.
    pub foreign: Arc<Map>,
    /// The same map before it was marked.
    pub unmarked: Arc<Map>,
}

/// Returns the attacks that the paper does not have.
pub fn extended_rows(others: &OtherMaps) -> Vec<Row> {
    [
        geometric(),
        noises(),
        bodies::rows(),
        curves::rows(),
        areas::rows(),
        of_vertices(),
        shares::rows(&others.unmarked),
        files::rows(&others.foreign),
        mixes(),
    ]
    .concat()
}

/// Returns the rows with more noise than the paper's.
fn noises() -> Vec<Row> {
    let uniform = [1.0, 1.5, 2.0].map(|half_width| {
        Row::new(
            &format!("noise{half_width}"),
            &format!("noise ±{half_width} m"),
            Attack::Noise { half_width },
        )
    });
    let gaussian = [0.3, 0.5, 0.7, 1.0].map(|deviation| {
        let title = format!("Gaussian noise of {deviation} m");
        Row::new(&format!("gauss{deviation}"), &title, Attack::GaussianNoise { deviation })
    });
    [&uniform[..], &gaussian].concat()
}

fn geometric() -> Vec<Row> {
    use Attack::{DropAttributes, GaussianNoise, Linear, Sequence, Snap, Square};
    let cells = Cell::Size([75.0, 50.0]);
    let about = About::Centre;
    let rows = [
        (
            "parity",
            "cells of 75 m × 50 m, ±1° by vertex parity",
            deformed(cells, Side::Vertex { unit: UNIT }),
        ),
        ("grid10", "10 × 10 cells over the map, ±1°", deformed(Cell::Share(10), Side::Cell)),
        ("gauss29", "Gaussian noise of the same variance as ±50 cm", GaussianNoise { deviation: 0.289 }),
        ("snap25", "snapped to 0.25 m", Snap { spacing: 0.25 }),
        ("snap50", "snapped to 0.5 m", Snap { spacing: 0.5 }),
        ("stretch", "x × 1.3, y × 0.8", Linear(scaling(1.3, 0.8), about)),
        ("shear", "shear 0.2", Linear(shear(0.2), about)),
        ("mirror", "mirrored", Linear(mirror(), about)),
        (
            "bare45",
            "attributes dropped, rotation 45°",
            Sequence(vec![DropAttributes, Linear(rotation(45.0), about)]),
        ),
        ("square", "almost right angles (± 10°) squared", Square { tolerance_degrees: 10.0 }),
    ];
    rows.into_iter().map(|(id, title, attack)| Row::new(id, title, attack)).collect()
}

fn of_vertices() -> Vec<Row> {
    let mut rows = vec![Row::new("densify", "a vertex every 5 m", Attack::Densify { spacing: 5.0 })];
    for tolerance in [0.25, 0.5, 1.0, 2.0] {
        let title = format!("Douglas–Peucker {tolerance} m");
        rows.push(Row::new(&format!("dp{tolerance}"), &title, Attack::Simplify { tolerance }));
    }
    for area in [0.5, 1.0, 4.0] {
        let title = format!("Visvalingam {area} m²");
        rows.push(Row::new(&format!("vw{area}"), &title, Attack::SimplifyByArea { area }));
    }
    for percent in [30, 50, 80] {
        let attack = Attack::DeleteVertices { share: f64::from(percent) / 100.0 };
        rows.push(Row::new(
            &format!("vertices{percent}"),
            &format!("{percent} % of the vertices deleted"),
            attack,
        ));
    }
    rows
}

/// Returns the rows of three attacks in sequence, drawn from a list; they are the same for all
/// maps.
fn mixes() -> Vec<Row> {
    use Attack::{Crop, DeleteFeatures, Densify, Linear, Noise, Reproject, Scramble, Simplify, Translate};
    let mixable = [
        ("noise ±20 cm", Noise { half_width: 0.2 }),
        ("rotation 30°", Linear(rotation(30.0), About::Centre)),
        ("shift by 50 m", Translate([50.0, 30.0])),
        ("scaling × 1.7", Linear(scaling(1.7, 1.7), About::Corner)),
        ("left half", Crop(Window::LeftHalf)),
        ("middle 1/4", Crop(Window::Centre { area_share: 0.25 })),
        ("Douglas–Peucker 0.25 m", Simplify { tolerance: 0.25 }),
        ("30 % of the features deleted", DeleteFeatures { share: 0.3 }),
        ("a vertex every 10 m", Densify { spacing: 10.0 }),
        ("order scrambled", Scramble),
        (
            "cells turned ±0.5°",
            Attack::Deform { cell: Cell::Size([75.0, 50.0]), degrees: 0.5, side: Side::Cell },
        ),
        ("EPSG:4326, 7 decimals", Reproject { epsg: 4326, decimals: Some(7) }),
    ];
    let mix = |number: u64| {
        let mut order: Vec<usize> = (0..mixable.len()).collect();
        Random::new(number).shuffle(&mut order);
        // Lengths are in metres, so degrees come last.
        let mut chosen = order[..3].to_vec();
        chosen.sort_by_key(|i| matches!(mixable[*i].1, Reproject { .. }));
        let titles: Vec<&str> = chosen.iter().map(|i| mixable[*i].0).collect();
        let attacks = chosen.iter().map(|i| mixable[*i].1.clone()).collect();
        Row::new(&format!("mix{number}"), &titles.join(", "), Attack::Sequence(attacks))
    };
    (1..=6).map(mix).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn ids_and_titles_are_unique_and_table_2_is_whole() {
        let empty = Arc::new(Map { layers: Vec::new() });
        let others = OtherMaps { foreign: empty.clone(), unmarked: empty };
        let rows: Vec<Row> = paper_rows().into_iter().chain(extended_rows(&others)).collect();
        assert_eq!(paper_rows().len(), 21);
        assert_eq!(rows.iter().map(|row| &row.id).collect::<HashSet<_>>().len(), rows.len());
        assert_eq!(rows.iter().map(|row| &row.title).collect::<HashSet<_>>().len(), rows.len());
    }
}
