//! Sheets that are marked apart fit together, whether they are cut, overlap or interlock.

mod towns;

use meshmark_core::{
    Error,
    anchors::Anchors,
    borders::{Border, Coverage, Disagreement, anchors},
    fingerprint_embedding,
    key::SecretKey,
    map_data::{ChainKind, MapData},
    options::Parameters,
    series::{Edition, Series},
};
use proptest::prelude::*;
use std::collections::BTreeMap;
use towns::{Feature, SIDE, crossings, data, on, town};

const COEFFICIENTS: usize = 24;

fn parameters() -> Parameters {
    Parameters { patch_size: 60, ..Parameters::of_fingerprint() }
}

/// A line across the town: the places left of it have positive sides.
#[derive(Debug, Clone, Copy)]
struct Cut {
    through: [f64; 2],
    angle: f64,
}

impl Cut {
    fn side(&self, p: [f64; 2]) -> f64 {
        let (sin, cos) = self.angle.sin_cos();
        cos * (p[1] - self.through[1]) - sin * (p[0] - self.through[0])
    }

    /// Returns where a segment crosses the line, the same for either direction.
    fn crossing(&self, p: [f64; 2], q: [f64; 2]) -> [f64; 2] {
        let (p, q) = if p < q { (p, q) } else { (q, p) };
        let share = self.side(p) / (self.side(p) - self.side(q));
        [0, 1].map(|axis| p[axis] + share * (q[axis] - p[axis]))
    }

    /// Returns the parts of a feature on one side.
    fn clip(&self, feature: &Feature, left: bool) -> Vec<Feature> {
        let keeps = |p: [f64; 2]| (self.side(p) >= 0.0) == left;
        let is_ring = matches!(feature.kind, ChainKind::Shell);
        let (mut parts, mut part) = (Vec::new(), Vec::new());
        let count = feature.points.len();
        for (i, &p) in feature.points.iter().enumerate() {
            if keeps(p) {
                part.push(p);
            }
            if i + 1 == count && !is_ring {
                break;
            }
            let q = feature.points[(i + 1) % count];
            if keeps(p) != keeps(q) {
                part.push(self.crossing(p, q));
                if !is_ring && keeps(p) {
                    parts.push(std::mem::take(&mut part));
                }
            }
        }
        parts.push(part);
        let least = if is_ring { 3 } else { 2 };
        let whole = parts.into_iter().filter(|points| points.len() >= least);
        whole.map(|points| Feature { points, kind: feature.kind }).collect()
    }
}

/// How a map is divided into sheets.
#[derive(Debug, Clone, Copy)]
enum Division {
    /// Features are cut at the border.
    Cut,
    /// Features that reach into several sheets are whole in each.
    Overlap,
    /// Every feature is in one sheet.
    Interlock,
}

/// Returns the sheets of a town.
fn sheets(town: &[Feature], cuts: &[Cut], division: Division) -> Vec<Vec<Feature>> {
    let mut sheets = vec![town.to_vec()];
    for cut in cuts {
        let left = |p: &[f64; 2]| cut.side(*p) >= 0.0;
        let on_side = |sheet: &[Feature], is_left: bool| -> Vec<Feature> {
            let parts = |feature: &Feature| match division {
                Division::Cut => cut.clip(feature, is_left),
                Division::Overlap if feature.points.iter().any(|p| left(p) == is_left) => {
                    vec![feature.clone()]
                }
                Division::Interlock if left(&feature.points[0]) == is_left => vec![feature.clone()],
                _ => Vec::new(),
            };
            sheet.iter().flat_map(parts).collect()
        };
        sheets =
            sheets.iter().flat_map(|sheet| [true, false].map(|is_left| on_side(sheet, is_left))).collect();
    }
    sheets.retain(|sheet| !sheet.is_empty());
    sheets
}

fn plan(sheets: &[MapData]) -> Result<Vec<Anchors>, Disagreement> {
    let tolerance_m = parameters().tolerance_m;
    let coverages: Vec<Coverage> = sheets.iter().map(|sheet| Coverage::new(&on(sheet))).collect();
    let border = |(number, sheet): (usize, &MapData)| {
        let others = coverages.iter().enumerate().filter(|(other, _)| *other != number);
        Border::new(&on(sheet), tolerance_m, &others.map(|(_, coverage)| coverage).collect::<Vec<_>>())
    };
    anchors(&sheets.iter().enumerate().map(border).collect::<Vec<_>>(), tolerance_m)
}

/// Returns the new places of the vertices of a sheet; the old ones of one too small for a mark.
fn mark(sheet: &MapData, anchors: &Anchors) -> Vec<[f64; 2]> {
    let (parameters, key) = (parameters(), SecretKey::from_bytes([42; 32]));
    let edition = Edition { map: on(sheet), bases: Vec::new(), anchors: anchors.as_slice(), part_size: None };
    let series = Series::new(vec![edition], &parameters).unwrap();
    match fingerprint_embedding::embed(&series, &key, "ACME", COEFFICIENTS) {
        Ok((marked, _)) => marked.coords,
        Err(Error::TooFewFree { .. } | Error::TooFewVertices { .. } | Error::FingerprintLost { .. }) => {
            sheet.vertices.coords().to_vec()
        }
        Err(error) => panic!("{error}"),
    }
}

type Moves = BTreeMap<[u64; 2], [f64; 2]>;

/// Returns where every vertex of all sheets goes.
fn moves(sheets: &[MapData], marked: &[Vec<[f64; 2]>]) -> Result<Moves, TestCaseError> {
    let mut moves = Moves::new();
    for (sheet, coords) in sheets.iter().zip(marked) {
        for (from, to) in sheet.vertices.coords().iter().zip(coords) {
            let first = moves.entry(from.map(f64::to_bits)).or_insert(*to);
            prop_assert_eq!(first.map(f64::to_bits), to.map(f64::to_bits), "{:?}", from);
        }
    }
    Ok(moves)
}

fn cuts() -> impl Strategy<Value = Vec<Cut>> {
    let size = 20.0 * SIDE as f64;
    let cut = (0.2 * size..0.8 * size, 0.2 * size..0.8 * size, 0.0..std::f64::consts::PI);
    prop::collection::vec(cut.prop_map(|(x, y, angle)| Cut { through: [x, y], angle }), 1..4)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn sheets_that_are_marked_apart_agree_and_their_union_crosses_nothing(
        seed in 0usize..1000,
        cuts in cuts(),
        division in prop::sample::select(vec![Division::Cut, Division::Overlap, Division::Interlock]),
    ) {
        let sheets: Vec<MapData> =
            sheets(&town(seed), &cuts, division).iter().map(|features| data(features)).collect();
        let anchors = plan(&sheets).unwrap();
        let marked: Vec<Vec<[f64; 2]>> =
            sheets.iter().zip(&anchors).map(|(sheet, anchors)| mark(sheet, anchors)).collect();
        let moves = moves(&sheets, &marked)?;
        let moved = moves.iter().filter(|(from, to)| **from != to.map(f64::to_bits)).count();
        prop_assert!(10 * moved > moves.len(), "{} of {}", moved, moves.len());
        let ends = |sheet: &MapData| -> Vec<[[f64; 2]; 2]> {
            let at = |&v: &u32| sheet.vertices.coords()[v as usize];
            sheet.segments.iter().map(|[a, b]| [at(a), at(b)]).collect()
        };
        let before: Vec<[[f64; 2]; 2]> = sheets.iter().flat_map(ends).collect();
        let after: Vec<_> =
            before.iter().map(|ends| ends.map(|end| moves[&end.map(f64::to_bits)])).collect();
        let (before, after) = (crossings(&before), crossings(&after));
        prop_assert!(after.is_subset(&before), "{:?}", after.difference(&before).collect::<Vec<_>>());
    }
}

/// Two halves of a town that share whole features at their border.
fn halves() -> [Vec<Feature>; 2] {
    let middle = Cut { through: [10.0 * SIDE as f64; 2], angle: 0.3 };
    sheets(&town(1), &[middle], Division::Overlap).try_into().ok().unwrap()
}

#[test]
fn a_sheet_without_neighbours_is_marked_as_a_map() {
    let whole = data(&town(1));
    let far = data(&town(1)).moved::<Error>(|p| Ok(p.iter().map(|[x, y]| [x + 1e4, *y]).collect())).unwrap();
    let planned = plan(&[whole.clone(), far]).unwrap();
    assert!(planned.iter().all(Anchors::is_empty));
}

#[test]
fn sheets_that_have_a_vertex_at_two_places_disagree() {
    let [a, b] = halves();
    let of = |sheets: [&[Feature]; 2]| plan(&sheets.map(data));
    assert!(of([&a, &b]).is_ok());
    let shared = |feature: &Feature| a.iter().any(|other| other.points == feature.points);
    let number = b.iter().position(shared).unwrap();
    let mut moved = b.clone();
    moved[number].points[1][0] += 0.01;
    let disagreement = of([&a, &moved]).unwrap_err();
    assert_eq!((disagreement.sheets, disagreement.vertices), ([0, 1], 1));
    assert_eq!(disagreement.places, [b[number].points[1], moved[number].points[1]]);
}

#[test]
fn sheets_of_other_precision_disagree() {
    let middle = Cut { through: [10.0 * SIDE as f64; 2], angle: 0.3 };
    let [a, mut b]: [Vec<Feature>; 2] = sheets(&town(1), &[middle], Division::Cut).try_into().ok().unwrap();
    let points = b.iter_mut().flat_map(|feature| &mut feature.points);
    points.for_each(|p| *p = p.map(|value| (value * 1000.0).round() / 1000.0));
    let disagreement = plan(&[data(&a), data(&b)]).unwrap_err();
    assert!(disagreement.vertices > 10, "{disagreement:?}");
}

#[test]
fn small_things_on_a_border_are_no_disagreement() {
    let cut = Cut { through: [100.0, 100.0], angle: 0.0 };
    let mut town = town(1);
    let corners = [[100.0, 100.0 - 0.2], [100.0, 100.2], [100.3, 100.0]];
    town.push(Feature { points: corners.to_vec(), kind: ChainKind::Shell });
    let sheets: Vec<MapData> =
        sheets(&town, &[cut], Division::Cut).iter().map(|features| data(features)).collect();
    assert!(corners[..2].iter().zip([1, 0]).all(|(p, sheet)| sheets[sheet].vertices.index_of(*p).is_some()));
    plan(&sheets).unwrap();
}
