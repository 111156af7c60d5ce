//! Attacks that draw lines and rings anew: they keep the course, but not the vertices.

use super::{
    Map, Random,
    parts::{Part, rewrite_map},
};
use geo::{ChaikinSmoothing, Coord};

/// The distance along a curve after which the errors of manual tracing lose most of their
/// correlation.
const HAND: f64 = 3.0;

/// The way in which lines and rings are drawn anew. Points stay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Redrawing {
    /// Vertices at this distance along the curve, from a random place on, in place of the old ones.
    Resample { spacing: f64 },
    /// New vertices with Gaussian errors of this deviation, which are correlated along the curve
    /// over about `HAND`. The ends of a ring need not meet.
    Trace { spacing: f64, deviation: f64 },
    /// Corners cut at a quarter and three quarters of every edge (Chaikin 1974), this number of
    /// times.
    Chaikin { rounds: usize },
}

impl Redrawing {
    /// Draws every line and ring of a map anew, each by itself, so shared walls separate.
    pub fn draw(self, map: &Map, seed: u64) -> Map {
        match self {
            Redrawing::Resample { spacing } => resample(map, spacing, seed, |_, places| places),
            Redrawing::Trace { spacing, deviation } => {
                resample(map, spacing, seed, |random, places| by_hand(&places, deviation, random))
            }
            Redrawing::Chaikin { rounds } => {
                map.map_geometries(|geometry| Some(geometry.chaikin_smoothing(rounds)))
            }
        }
    }
}

fn resample(map: &Map, spacing: f64, seed: u64, draw: impl Fn(&mut Random, Vec<Coord>) -> Vec<Coord>) -> Map {
    let mut random = Random::new(seed);
    rewrite_map(map, &mut |part, run| match part {
        Part::Point => run.to_vec(),
        Part::Line | Part::Ring => {
            let places = walk(part, run, spacing, random.unit());
            draw(&mut random, places)
        }
    })
}

/// Moves places on a curve by errors that follow one another as a first-order autoregression.
fn by_hand(places: &[Coord], deviation: f64, random: &mut Random) -> Vec<Coord> {
    let mut error = [0.0; 2];
    let mut likeness = 0.0; // to the preceding error
    let mut drawn = Vec::with_capacity(places.len());
    for (i, place) in places.iter().enumerate() {
        let fresh = (1.0f64 - likeness * likeness).sqrt() * deviation;
        error = error.map(|error| likeness * error + fresh * random.normal());
        drawn.push(Coord { x: place.x + error[0], y: place.y + error[1] });
        if let Some(next) = places.get(i + 1) {
            likeness = (-(next.x - place.x).hypot(next.y - place.y) / HAND).exp();
        }
    }
    drawn
}

/// Returns places along a line or ring, `spacing` apart, or closer where it is too short for the
/// fewest vertices it needs. The first is a share of the spacing away from the start.
pub(super) fn walk(part: Part, run: &[Coord], spacing: f64, phase: f64) -> Vec<Coord> {
    let length = |(a, b): (Coord, Coord)| (b.x - a.x).hypot(b.y - a.y);
    let total: f64 = part.edges(run).map(length).sum();
    if total == 0.0 {
        return run.to_vec();
    }
    let spacing = spacing.min(total / part.least() as f64);
    let (mut walked, mut next) = (0.0, phase * spacing);
    let mut places = Vec::new();
    for (a, b) in part.edges(run) {
        let edge = length((a, b));
        while next < walked + edge {
            let share = (next - walked) / edge;
            places.push(Coord { x: a.x + share * (b.x - a.x), y: a.y + share * (b.y - a.y) });
            next += spacing;
        }
        walked += edge;
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{fixture, in_memory, wkt};
    use geo::{Distance, Euclidean, Point};

    #[test]
    fn a_walk_takes_steps_of_the_spacing_around_corners() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]].map(Coord::from);
        let places = |part, spacing, phase| -> Vec<[f64; 2]> {
            walk(part, &square, spacing, phase).into_iter().map(|c| [c.x, c.y]).collect()
        };
        assert_eq!(places(Part::Line, 5.0, 0.5), [[2.5, 0.0], [4.0, 3.5]]);
        assert_eq!(places(Part::Ring, 5.0, 0.5), [[2.5, 0.0], [4.0, 3.5], [0.0, 3.5]]);
        assert_eq!(places(Part::Ring, 100.0, 0.0).len(), 3, "a ring keeps an area");
        assert_eq!(places(Part::Line, 100.0, 0.9).len(), 2, "a line keeps its course");
    }

    #[test]
    fn resampled_vertices_are_new_and_lie_on_the_old_edges() {
        let map = fixture("kotka.gpkg");
        let drawn = Redrawing::Resample { spacing: 2.0 }.draw(&map, 1);
        assert_eq!(drawn.features().count(), map.features().count());
        let old = map.vertices().unwrap();
        let kept = drawn.coords().filter(|p| old.index_of(*p).is_some()).count();
        assert!(kept * 100 < old.len(), "{kept} of {} vertices are still there", old.len());
        for (before, after) in map.geometries().zip(drawn.geometries()) {
            let off = super::super::map::coords(after).map(|p| Euclidean.distance(before, &Point::from(p)));
            assert!(off.fold(0f64, f64::max) < 1e-6);
        }
        assert_eq!(drawn, Redrawing::Resample { spacing: 2.0 }.draw(&map, 1));
        assert_ne!(drawn, Redrawing::Resample { spacing: 2.0 }.draw(&map, 2));
    }

    #[test]
    fn a_tracing_hand_errs_by_its_deviation_and_not_anew_at_every_vertex() {
        let mut random = Random::new(1);
        let line: Vec<Coord> = (0..20_000).map(|i| Coord { x: f64::from(i), y: 0.0 }).collect();
        let errors: Vec<f64> = by_hand(&line, 0.4, &mut random).iter().map(|c| c.y).collect();
        let mean = |lag: usize| {
            errors.iter().zip(&errors[lag..]).map(|(a, b)| a * b).sum::<f64>() / (errors.len() - lag) as f64
        };
        assert!((mean(0).sqrt() - 0.4).abs() < 0.02, "{}", mean(0).sqrt());
        assert!((mean(3) / mean(0) - (-1f64).exp()).abs() < 0.05, "{}", mean(3) / mean(0));
        assert!((mean(30) / mean(0)).abs() < 0.05);
    }

    #[test]
    fn chaikin_cuts_every_corner() {
        let map = in_memory(&["LINESTRING (0 0,4 0,4 4)", "POLYGON ((0 0,4 0,4 4,0 4,0 0))", "POINT (1 1)"]);
        let smooth = wkt(&Redrawing::Chaikin { rounds: 1 }.draw(&map, 1));
        assert_eq!(smooth[0], "LINESTRING (0 0,1 0,3 0,4 1,4 3,4 4)");
        assert!(!smooth[1].contains("0 0,") && !smooth[1].contains("4 4"), "{}", smooth[1]);
        assert_eq!(smooth[2], "POINT (1 1)");
        let rounder = Redrawing::Chaikin { rounds: 3 }.draw(&map, 1);
        assert!(rounder.coords().count() > 3 * map.coords().count());
    }
}
