//! Small pieces of a map: the features around one place.

use super::{Map, Random, map::coords};
use crate::Result;
use geo::Geometry;
use std::collections::HashSet;

/// Keeps the features in a circle around a random vertex, which grows until they have this number
/// of distinct vertices. Features that would exceed the number are passed over; the piece is
/// complete at nine tenths of it.
///
/// # Errors
/// Fails on a map without vertices.
pub fn cut(map: &Map, vertices: usize, seed: u64) -> Result<Map> {
    let table = map.vertices()?;
    if table.is_empty() {
        return Err("a map without vertices has no pieces".into());
    }
    let place = table.coords()[Random::new(seed).below(table.len())];
    let mut inmost: Vec<(f64, usize, &Geometry)> = map
        .features()
        .enumerate()
        .filter_map(|(i, feature)| feature.geometry.as_ref().map(|geometry| (i, geometry)))
        .map(|(i, geometry)| (radius(geometry, place), i, geometry))
        .collect();
    inmost.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut kept, mut taken) = (HashSet::new(), HashSet::new());
    for (_, i, geometry) in inmost {
        let of_feature: HashSet<usize> = coords(geometry).filter_map(|c| table.index_of(c)).collect();
        let more = of_feature.difference(&taken).count();
        if taken.len() + more <= vertices {
            taken.extend(of_feature);
            kept.insert(i);
        }
        if 10 * taken.len() >= 9 * vertices {
            break;
        }
    }
    let (mut piece, mut number) = (map.clone(), 0..);
    for layer in &mut piece.layers {
        layer.features.retain(|_| number.next().is_some_and(|i| kept.contains(&i)));
    }
    Ok(piece)
}

/// Returns the radius of the circle around a place that holds a geometry.
fn radius(geometry: &Geometry, place: [f64; 2]) -> f64 {
    coords(geometry).map(|[x, y]| (x - place[0]).hypot(y - place[1])).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::fixture;

    #[test]
    fn a_piece_has_its_vertices_and_lies_in_one_place() {
        let map = fixture("kotka.gpkg");
        let size = |map: &Map| {
            let (min, max) = map.vertices().unwrap().bounds();
            (max[0] - min[0]).hypot(max[1] - min[1])
        };
        for vertices in [25, 50, 100, 200, 400] {
            let piece = cut(&map, vertices, 4).unwrap();
            let count = piece.vertices().unwrap().len();
            assert!(count <= vertices && 10 * count >= 9 * vertices, "{count} of {vertices}");
            assert!(piece.features().all(|feature| map.features().any(|other| other == feature)));
            assert!(size(&piece) < 0.5 * size(&map), "{} of {}", size(&piece), size(&map));
        }
        assert_eq!(cut(&map, 100, 4).unwrap(), cut(&map, 100, 4).unwrap());
        assert_ne!(cut(&map, 100, 4).unwrap(), cut(&map, 100, 5).unwrap());
    }
}
