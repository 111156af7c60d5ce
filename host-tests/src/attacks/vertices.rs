//! Attacks on the number of vertices: insertion, densification, simplification, deletion.

use super::{
    Map,
    parts::{Part, rewrite_map, visit},
    random::{PerVertex, Random},
};
use crate::Result;
use geo::{Coord, Geometry, Simplify, SimplifyVw};
use std::collections::{BTreeSet, HashMap};

/// An edge without a direction: the smaller end comes first, so that all features that share the
/// edge agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct Edge([[u64; 2]; 2]);

impl Edge {
    /// Returns the edge and whether its larger end comes first; `None` between equal ends.
    fn new(a: Coord, b: Coord) -> Option<(Edge, bool)> {
        let bits = |c: Coord| [c.x.to_bits(), c.y.to_bits()];
        match bits(a).cmp(&bits(b)) {
            std::cmp::Ordering::Less => Some((Edge([bits(a), bits(b)]), false)),
            std::cmp::Ordering::Equal => None,
            std::cmp::Ordering::Greater => Some((Edge([bits(b), bits(a)]), true)),
        }
    }

    fn ends(self) -> [Coord; 2] {
        self.0.map(|[x, y]| Coord { x: f64::from_bits(x), y: f64::from_bits(y) })
    }

    fn length(self) -> f64 {
        let [a, b] = self.ends();
        (b.x - a.x).hypot(b.y - a.y)
    }
}

/// Inserts vertices at random places of random edges, in every feature that has the edge.
///
/// # Errors
/// Fails on a map of points alone.
pub fn insert(map: &Map, count: usize, seed: u64) -> Result<Map> {
    let edges: Vec<Edge> = edges(map).into_iter().collect();
    if edges.is_empty() {
        return Err("a map without edges has no place for new vertices".into());
    }
    let mut random = Random::new(seed);
    let mut places: HashMap<Edge, Vec<f64>> = HashMap::new();
    for _ in 0..count {
        let edge = edges[random.below(edges.len())];
        places.entry(edge).or_default().push(random.unit());
    }
    places.values_mut().for_each(|shares| shares.sort_by(f64::total_cmp));
    Ok(subdivide(map, |edge| places.get(&edge).cloned().unwrap_or_default()))
}

/// Divides every edge into the fewest equal pieces of at most `spacing`, units of the CRS.
pub fn densify(map: &Map, spacing: f64) -> Map {
    subdivide(map, |edge| {
        let pieces = (edge.length() / spacing).ceil() as usize;
        (1..pieces).map(|k| k as f64 / pieces as f64).collect()
    })
}

/// Puts vertices at shares of every edge's length, in rising order from its smaller end.
fn subdivide(map: &Map, shares: impl Fn(Edge) -> Vec<f64>) -> Map {
    let between = |a: Coord, b: Coord| {
        let Some((edge, reversed)) = Edge::new(a, b) else { return Vec::new() };
        let [from, to] = edge.ends();
        let place = |t: f64| Coord { x: from.x + t * (to.x - from.x), y: from.y + t * (to.y - from.y) };
        let mut places: Vec<Coord> = shares(edge).into_iter().map(place).collect();
        if reversed {
            places.reverse();
        }
        places
    };
    rewrite_map(map, &mut |part, run| {
        if part == Part::Point {
            return run.to_vec();
        }
        let mut divided = vec![run[0]];
        for (a, b) in part.edges(run) {
            divided.extend(between(a, b));
            divided.push(b);
        }
        if part == Part::Ring {
            divided.pop(); // the closing edge ends at the start
        }
        divided
    })
}

fn edges(map: &Map) -> BTreeSet<Edge> {
    let mut edges = BTreeSet::new();
    for geometry in map.geometries() {
        visit(geometry, |part, run| {
            if part != Part::Point {
                edges.extend(part.edges(run).filter_map(|(a, b)| Edge::new(a, b)).map(|(edge, _)| edge));
            }
        });
    }
    edges
}

/// The vertices that a simplification removes.
#[derive(Debug, Clone, Copy)]
pub enum Simplification {
    /// Vertices within this tolerance of the simplified line (Douglas and Peucker 1973), as
    /// `ogr2ogr -simplify` does.
    Distance(f64),
    /// Vertices that span triangles under this area with their neighbours, smallest first
    /// (Visvalingam and Whyatt 1993).
    Area(f64),
}

impl Simplification {
    fn apply<G: Simplify<f64> + SimplifyVw<f64>>(self, geometry: &G) -> G {
        match self {
            Simplification::Distance(tolerance) => geometry.simplify(tolerance),
            Simplification::Area(area) => geometry.simplify_vw(area),
        }
    }
}

/// Simplifies every line and ring by itself.
pub fn simplify(map: &Map, how: Simplification) -> Map {
    map.map_geometries(|geometry| {
        Some(match geometry {
            Geometry::LineString(g) => how.apply(g).into(),
            Geometry::MultiLineString(g) => how.apply(g).into(),
            Geometry::Polygon(g) => how.apply(g).into(),
            Geometry::MultiPolygon(g) => how.apply(g).into(),
            other => other.clone(),
        })
    })
}

/// Deletes a share of the distinct vertices, chosen at random. A part with too few remaining
/// vertices is dropped, and its vertices count, so the share is exact to within the last part.
///
/// # Errors
/// Fails on coordinates that are not finite.
pub fn delete(map: &Map, share: f64, seed: u64) -> Result<Map> {
    let rank = PerVertex::draw(map, seed, Random::unit)?;
    let without = |below: f64| {
        rewrite_map(map, &mut |_, run| run.iter().copied().filter(|c| rank.at([c.x, c.y]) >= below).collect())
    };
    let target = (share * map.vertices()?.len() as f64).round() as usize;
    let left = map.vertices()?.len() - target;
    // Bisection finds how many vertices are dropped with their parts: more chosen, fewer left.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..40 {
        let middle = (low + high) / 2.0;
        if without(middle).vertices()?.len() > left { low = middle } else { high = middle }
    }
    Ok(without(high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::{fixture, in_memory, wkt};

    const TERRACE: [&str; 2] = ["POLYGON ((0 0,6 0,6 5,0 5,0 0))", "POLYGON ((6 5,6 0,12 0,12 5,6 5))"];

    fn is_on_an_edge(map: &Map, p: [f64; 2]) -> bool {
        edges(map).into_iter().any(|edge| {
            let [a, b] = edge.ends();
            let around = (a.x - p[0]).hypot(a.y - p[1]) + (b.x - p[0]).hypot(b.y - p[1]);
            around - edge.length() < 1e-9
        })
    }

    #[test]
    fn inserted_vertices_are_new_lie_on_edges_and_are_shared() {
        let map = in_memory(&TERRACE);
        assert_eq!(edges(&map).len(), 7);
        let more = insert(&map, 100, 4).unwrap();
        assert_eq!(more.vertices().unwrap().len(), 6 + 100);
        assert!(more.vertices().unwrap().coords().iter().all(|p| is_on_an_edge(&map, *p)));
        assert_eq!(edges(&more).len(), 7 + 100, "an edge of both houses was divided in both alike");
        assert_eq!(more, insert(&map, 100, 4).unwrap());
    }

    #[test]
    fn three_thousand_vertices_are_inserted_into_a_real_map() {
        let map = fixture("helsinki.gpkg");
        let before = map.vertices().unwrap();
        let after = insert(&map, 3000, 1).unwrap().vertices().unwrap();
        assert_eq!(after.len(), before.len() + 3000);
        assert!(before.coords().iter().all(|p| after.index_of(*p).is_some()));
    }

    #[test]
    fn densified_edges_are_no_longer_than_the_spacing_and_as_few_as_that_takes() {
        let dense = densify(&in_memory(&TERRACE), 2.5);
        assert!(edges(&dense).into_iter().all(|edge| edge.length() <= 2.5 + 1e-12));
        // 4 edges of length 6 in 3 pieces, 3 of length 5 in 2.
        assert_eq!(edges(&dense).len(), 4 * 3 + 3 * 2);
        let line = densify(&in_memory(&["LINESTRING (4 0,0 0)"]), 2.0);
        assert_eq!(wkt(&line), ["LINESTRING (4 0,2 0,0 0)"]);
    }

    #[test]
    fn simplification_drops_what_is_within_the_tolerance() {
        let map = in_memory(&["LINESTRING (0 0,50 4,99 0)", "LINESTRING (0 0,50 6,99 0)", "POINT (1 1)"]);
        let simple = wkt(&simplify(&map, Simplification::Distance(5.0)));
        assert_eq!(simple, ["LINESTRING (0 0,99 0)", "LINESTRING (0 0,50 6,99 0)", "POINT (1 1)"]);
    }

    #[test]
    fn simplification_by_area_drops_small_triangles() {
        let map = in_memory(&["LINESTRING (0 0,5 1,10 0)", "LINESTRING (0 0,5 3,10 0)", "POINT (1 1)"]);
        let simple = wkt(&simplify(&map, Simplification::Area(10.0)));
        assert_eq!(simple, ["LINESTRING (0 0,10 0)", "LINESTRING (0 0,5 3,10 0)", "POINT (1 1)"]);
    }

    #[test]
    fn deletion_leaves_the_share_it_promises_and_never_half_a_vertex() {
        let map = fixture("kotka.gpkg");
        let before = map.vertices().unwrap();
        for share in [0.3, 0.5, 0.8] {
            let after = delete(&map, share, 9).unwrap();
            let left = after.vertices().unwrap();
            let wanted = (1.0 - share) * before.len() as f64;
            assert!((left.len() as f64 - wanted).abs() < 10.0, "{} of {wanted}", left.len());
            assert!(left.coords().iter().all(|p| before.index_of(*p).is_some()));
        }
        assert_eq!(delete(&map, 0.5, 9).unwrap(), delete(&map, 0.5, 9).unwrap());
        assert_ne!(delete(&map, 0.5, 9).unwrap(), delete(&map, 0.5, 8).unwrap());
    }
}
