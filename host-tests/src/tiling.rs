//! Larger maps, which consist of copies of a map side by side.

use crate::attacks::{Feature, Map};
use geo::{Coord, MapCoords};

/// Returns this number of copies of every feature, in about as many rows as columns; copies do not
/// touch.
pub fn tile(map: &Map, copies: usize) -> Map {
    let columns = (copies as f64).sqrt().ceil() as usize;
    let [width, height] = size(map).map(|length| 1.01 * length);
    let copy_of = |feature: &Feature, copy: usize| {
        let offset = Coord { x: (copy % columns) as f64 * width, y: (copy / columns) as f64 * height };
        let geometry = feature.geometry.as_ref().map(|geometry| geometry.map_coords(|c| c + offset));
        Feature { fid: None, values: feature.values.clone(), geometry }
    };
    let mut tiled = map.clone();
    for layer in &mut tiled.layers {
        let features = std::mem::take(&mut layer.features);
        layer.features =
            (0..copies).flat_map(|copy| features.iter().map(move |f| copy_of(f, copy))).collect();
    }
    tiled
}

/// Returns width and height of the extent of all layers, CRS units.
fn size(map: &Map) -> [f64; 2] {
    let start = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    let [low, high] = map
        .coords()
        .fold(start, |[low, high], p| [[0, 1].map(|i| low[i].min(p[i])), [0, 1].map(|i| high[i].max(p[i]))]);
    [0, 1].map(|i| (high[i] - low[i]).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attacks::tests::fixture;

    #[test]
    fn a_tiling_has_so_many_times_the_vertices_and_no_common_ones() {
        let map = fixture("kotka.gpkg");
        let once = map.vertices().unwrap().len();
        for copies in [1, 2, 5] {
            assert_eq!(tile(&map, copies).vertices().unwrap().len(), copies * once);
        }
    }
}
