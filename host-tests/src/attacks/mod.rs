//! Attacks on marked maps: those of Table 2 of the paper, and other changes, malicious or not.
//!
//! An attack is a pure function from a map (and a seed) to a map. Layers, attributes, feature ids
//! and the CRS stay unchanged where the attack does not concern them. Where it concerns vertices, a
//! vertex that several features share is one vertex.

pub mod bodies;
pub mod buffers;
pub mod collusion;
pub mod crop;
pub mod curves;
pub mod deformation;
pub mod features;
pub mod formats;
mod map;
pub mod noise;
pub mod outlines;
mod parts;
pub mod pieces;
pub mod quantisation;
mod random;
pub mod rasters;
pub mod reproject;
mod rows;
pub mod rubber_sheet;
pub mod similarity;
pub mod squaring;
pub mod topology;
pub mod vertices;

pub use map::{Feature, Field, Layer, Map};
pub use random::Random;
pub use rows::{OtherMaps, Row, extended_rows, paper_rows};

use crate::Result;
use bodies::Motion;
use buffers::Buffering;
use crop::Window;
use curves::Redrawing;
use deformation::{Cell, Side};
use formats::Format;
use outlines::Outline;
use quantisation::Quantisation;
use similarity::{About, Matrix};
use std::sync::Arc;
use vertices::Simplification;

/// An attack, all lengths in units of the map's CRS.
#[derive(Debug, Clone, PartialEq)]
pub enum Attack {
    /// A shift of the whole map.
    Translate([f64; 2]),
    /// An affine map with a fixed point.
    Linear(Matrix, About),
    /// Coordinates on a grid through the origin.
    Snap { spacing: f64 },
    /// Uniform noise on both coordinates of every vertex.
    Noise { half_width: f64 },
    /// Gaussian noise on both coordinates of every vertex.
    GaussianNoise { deviation: f64 },
    /// A share of the features with Gaussian noise.
    Redraw { share: f64, deviation: f64 },
    /// Buildings shifted and turned, each by itself.
    MoveBodies(Motion),
    /// A smooth field of displacements, on either axis at most this large.
    RubberSheet { amplitude: f64 },
    /// Cells of a grid turned by this angle, to alternating sides.
    Deform { cell: Cell, degrees: f64, side: Side },
    /// A window cut out.
    Crop(Window),
    /// Vertices inserted at random places of random edges.
    InsertVertices { count: usize },
    /// Edges divided into pieces of at most this length.
    Densify { spacing: f64 },
    /// Lines and rings drawn anew along their course.
    DrawAnew(Redrawing),
    /// Polygons replaced by something simpler, everything else dropped.
    Outline(Outline),
    /// Lines and rings simplified.
    Simplify { tolerance: f64 },
    /// Lines and rings without the vertices of small triangles.
    SimplifyByArea { area: f64 },
    /// Shapes grown or shrunk, everything else dropped.
    Buffer(Buffering),
    /// Polygons through a raster, everything else dropped.
    Vectorise { pixel: f64 },
    /// The polygons of a layer joined.
    Dissolve,
    /// Lines and outlines cut at all crossings.
    Planarise,
    /// A share of the vertices deleted.
    DeleteVertices { share: f64 },
    /// A share of the features deleted.
    DeleteFeatures { share: f64 },
    /// A share of the features exchanged for those of the map before marking.
    Exchange { unmarked: Arc<Map>, share: f64 },
    /// The features around a random place, about so many vertices.
    Piece { vertices: usize },
    /// Layers and features in random order.
    Scramble,
    /// No attributes.
    DropAttributes,
    /// Another map laid over.
    Merge(Arc<Map>),
    /// Into another CRS and perhaps rounded.
    Reproject { epsg: u32, decimals: Option<u32> },
    /// Onto the grid of a format.
    Quantise(Quantisation),
    /// Through an exchange format.
    RoundTrip(Format),
    /// Almost right angles made right.
    Square { tolerance_degrees: f64 },
    /// One after another.
    Sequence(Vec<Attack>),
}

impl Attack {
    /// Applies the attack to a map.
    ///
    /// # Errors
    /// Fails on coordinates that are not finite, and with the messages of GDAL, PROJ and GEOS.
    pub fn apply(&self, map: &Map, seed: u64) -> Result<Map> {
        match self {
            Attack::Translate(by) => Ok(similarity::translate(map, *by)),
            Attack::Linear(matrix, about) => similarity::linear(map, *matrix, *about),
            Attack::Snap { spacing } => Ok(noise::snap(map, *spacing)),
            Attack::Noise { half_width } => noise::add(map, seed, |random| random.symmetric(*half_width)),
            Attack::GaussianNoise { deviation } => {
                noise::add(map, seed, |random| deviation * random.normal())
            }
            Attack::Redraw { share, deviation } => noise::redraw(map, *share, *deviation, seed),
            Attack::MoveBodies(motion) => bodies::shift_and_turn(map, *motion, seed),
            Attack::RubberSheet { amplitude } => rubber_sheet::bend(map, *amplitude, seed),
            Attack::Deform { cell, degrees, side } => deformation::deform(map, *cell, *degrees, *side),
            Attack::Crop(window) => crop::crop(map, *window),
            Attack::InsertVertices { count } => vertices::insert(map, *count, seed),
            Attack::Densify { spacing } => Ok(vertices::densify(map, *spacing)),
            Attack::DrawAnew(redrawing) => Ok(redrawing.draw(map, seed)),
            Attack::Outline(outline) => Ok(outline.apply(map)),
            Attack::Simplify { tolerance } => {
                Ok(vertices::simplify(map, Simplification::Distance(*tolerance)))
            }
            Attack::SimplifyByArea { area } => Ok(vertices::simplify(map, Simplification::Area(*area))),
            Attack::Buffer(buffering) => Ok(buffering.apply(map)),
            Attack::Vectorise { pixel } => rasters::vectorise(map, *pixel),
            Attack::Dissolve => Ok(topology::dissolve(map)),
            Attack::Planarise => topology::planarise(map),
            Attack::DeleteVertices { share } => vertices::delete(map, *share, seed),
            Attack::DeleteFeatures { share } => Ok(features::delete(map, *share, seed)),
            Attack::Exchange { unmarked, share } => features::exchange(map, unmarked, *share, seed),
            Attack::Piece { vertices } => pieces::cut(map, *vertices, seed),
            Attack::Scramble => Ok(features::scramble(map, seed)),
            Attack::DropAttributes => Ok(features::drop_attributes(map)),
            Attack::Merge(foreign) => features::merge(map, foreign),
            Attack::Reproject { epsg, decimals } => reproject::reproject(map, *epsg, *decimals),
            Attack::Quantise(quantisation) => quantisation.apply(map),
            Attack::RoundTrip(format) => formats::round_trip(map, *format),
            Attack::Square { tolerance_degrees } => squaring::square(map, *tolerance_degrees),
            Attack::Sequence(attacks) => {
                let mut seeds = Random::new(seed);
                attacks.iter().try_fold(map.clone(), |map, attack| attack.apply(&map, seeds.seed()))
            }
        }
    }

    /// Returns the strength of an attack that has one: the number that names it, in its own unit.
    pub fn strength(&self) -> Option<f64> {
        match self {
            Attack::Snap { spacing } | Attack::Densify { spacing } => Some(*spacing),
            Attack::Noise { half_width } => Some(*half_width),
            Attack::Crop(window) => Some(window.area_share()),
            Attack::Simplify { tolerance } => Some(*tolerance),
            Attack::DeleteVertices { share } | Attack::DeleteFeatures { share } => Some(*share),
            _ => None,
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::plugin;
    use gdal::vector::{FieldValue, Geometry, OGRFieldType, OGRwkbGeometryType, ToGdal};
    use std::collections::HashMap;

    /// Returns one of the repository's small maps.
    pub fn fixture(name: &str) -> Map {
        Map::read(&plugin::fixture(name)).unwrap()
    }

    /// Returns a map of one layer with these geometries, named a, b, …
    pub fn in_memory(wkt: &[&str]) -> Map {
        let feature = |(i, wkt): (usize, &&str)| Feature {
            fid: Some(i as u64 + 1),
            values: vec![Some(FieldValue::StringValue(char::from(b'a' + i as u8).into()))],
            geometry: Some(Geometry::from_wkt(wkt).unwrap().to_geo().unwrap()),
        };
        let layer = Layer {
            name: "shapes".into(),
            crs: None,
            geometry_type: OGRwkbGeometryType::wkbUnknown,
            fields: vec![Field { name: "name".into(), kind: OGRFieldType::OFTString }],
            features: wkt.iter().enumerate().map(feature).collect(),
        };
        Map { layers: vec![layer] }
    }

    /// Returns the geometries of a map.
    pub fn wkt(map: &Map) -> Vec<String> {
        map.geometries().map(|geometry| geometry.to_gdal().unwrap().wkt().unwrap()).collect()
    }

    /// Returns the places of vertices before and after.
    pub fn pairs(before: &Map, after: &Map) -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
        assert_eq!(before.coords().count(), after.coords().count());
        before.coords().zip(after.coords())
    }

    /// Asserts that all occurrences of a vertex move to one place.
    pub fn assert_shared_vertices_stay_shared(before: &Map, after: &Map) {
        let mut places = HashMap::new();
        for (from, to) in pairs(before, after) {
            assert_eq!(*places.entry(from.map(f64::to_bits)).or_insert(to), to, "{from:?}");
        }
        assert!(places.len() < before.coords().count(), "no vertex of this map is shared");
    }

    #[test]
    fn a_sequence_applies_one_attack_after_another_with_seeds_of_their_own() {
        let map = in_memory(&["LINESTRING (0 0,100 0,200 50)"]);
        let noise = Attack::Noise { half_width: 1.0 };
        let twice = Attack::Sequence(vec![noise.clone(), noise.clone()]).apply(&map, 1).unwrap();
        assert_eq!(twice, Attack::Sequence(vec![noise.clone(), noise.clone()]).apply(&map, 1).unwrap());
        let one = Attack::Sequence(vec![noise.clone()]).apply(&map, 1).unwrap();
        let first_step: Vec<_> = pairs(&map, &one).map(|(a, b)| b[0] - a[0]).collect();
        let second_step: Vec<_> = pairs(&one, &twice).map(|(a, b)| b[0] - a[0]).collect();
        assert_ne!(first_step, second_step);
        let moved = Attack::Sequence(vec![Attack::Translate([0.3, 0.0]), Attack::Snap { spacing: 1.0 }]);
        assert_eq!(wkt(&moved.apply(&map, 1).unwrap()), wkt(&map));
    }

    #[test]
    fn attacks_leave_layers_attributes_and_ids_alone() {
        let map = fixture("kotka.gpkg");
        let foreign = Arc::new(fixture("helsinki.gpkg"));
        let others = OtherMaps { foreign, unmarked: Arc::new(map.clone()) };
        let rows = paper_rows().into_iter().chain(extended_rows(&others));
        for row in rows.filter(|row| row.keeps_features()) {
            let attacked = row.attack.apply(&map, 1).unwrap();
            for (before, after) in map.layers.iter().zip(&attacked.layers) {
                assert_eq!((&before.name, &before.fields), (&after.name, &after.fields), "{}", row.title);
                let known =
                    |f: &Feature| before.features.iter().any(|b| b.fid == f.fid && b.values == f.values);
                assert!(after.features.iter().all(known), "{}", row.title);
            }
        }
    }
}
