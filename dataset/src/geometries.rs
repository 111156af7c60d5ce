//! Geometries as chains of vertices.

use crate::{
    chains::Chains,
    wkb::{self, Step, WkbError},
};
use gdal::vector::Geometry;
use std::collections::BTreeMap;

/// A geometry.
#[derive(Debug, Clone)]
pub struct Outline {
    /// The well-known binary that was read; `None` when only the chains are known.
    wkb: Option<Vec<u8>>,
    /// Its rings, lines and points: coordinates in CRS units; a ring ends with its first one.
    pub chains: Vec<Vec<[f64; 2]>>,
    /// The kind of each of them.
    pub kinds: Vec<Step>,
}

impl Outline {
    /// Reads well-known binary.
    ///
    /// # Errors
    /// Fails for bytes that are not a geometry.
    pub fn of_wkb(mut wkb: Vec<u8>) -> Result<Self, WkbError> {
        let (mut chains, mut kinds): (Vec<Vec<[f64; 2]>>, _) = (Vec::new(), Vec::new());
        wkb::map_coordinates::<WkbError>(&mut wkb, &mut |step, point| {
            match (step, chains.last_mut()) {
                (Step::Next, Some(chain)) => chain.push(point),
                _ => {
                    chains.push(vec![point]);
                    kinds.push(step);
                }
            }
            Ok(point)
        })?;
        Ok(Outline { wkb: Some(wkb), chains, kinds })
    }

    /// Returns the geometry of GDAL; `None` when GDAL cannot make one.
    pub(crate) fn geometry(&self) -> Option<Geometry> {
        match &self.wkb {
            Some(wkb) => Geometry::from_wkb(wkb).ok(),
            None => Geometry::from_wkb(&wkb::of_chains(&self.chains, &self.kinds)).ok(),
        }
    }

    /// Returns whether its chains describe it completely: it has no arcs and no collections.
    pub(crate) fn is_plain(&self) -> bool {
        self.wkb.as_deref().is_none_or(wkb::is_plain)
    }

    /// Returns its first vertex.
    pub fn first(&self) -> Option<[f64; 2]> {
        self.chains.first()?.first().copied()
    }
}

/// The geometries of a map as references to its vertices, a few bytes for every coordinate.
#[derive(Debug, Clone)]
pub struct Geometries {
    /// The vertex of every coordinate.
    indices: Vec<u32>,
    /// The index in `indices` where each chain starts, ascending.
    starts: Vec<u32>,
    kinds: Vec<Step>,
    /// The number of the first chain of each geometry, ascending.
    firsts: Vec<u32>,
    /// Geometries other than points, lines and polygons, as well-known binary: their chains do not
    /// describe them completely.
    others: BTreeMap<u32, Vec<u8>>,
}

impl Geometries {
    pub(crate) fn new(indices: Vec<u32>, chains: Chains) -> Self {
        let Chains { starts, kinds, firsts, others, .. } = chains;
        Geometries { indices, starts, kinds, firsts, others }
    }

    /// Returns how many there are, empty ones included.
    pub fn len(&self) -> usize {
        self.firsts.len()
    }

    /// Returns whether there is none.
    pub fn is_empty(&self) -> bool {
        self.firsts.is_empty()
    }

    /// Returns a geometry with the vertices at `coords`, which are in canonical order, without Z
    /// and M.
    pub fn outline(&self, number: usize, coords: &[[f64; 2]]) -> Outline {
        let end =
            |ends: &[u32], number: usize, all: usize| ends.get(number + 1).map_or(all, |end| *end as usize);
        let chains = self.firsts[number] as usize..end(&self.firsts, number, self.starts.len());
        let kinds = self.kinds[chains.clone()].to_vec();
        let chain = |chain: usize| {
            let vertices = self.starts[chain] as usize..end(&self.starts, chain, self.indices.len());
            self.indices[vertices].iter().map(|&vertex| coords[vertex as usize]).collect()
        };
        let chains: Vec<Vec<[f64; 2]>> = chains.map(chain).collect();
        let wkb = self.others.get(&(number as u32)).map(|wkb| with_places(wkb, &chains));
        Outline { wkb, chains, kinds }
    }
}

/// Returns the same geometry with its coordinates at these places.
fn with_places(wkb: &[u8], chains: &[Vec<[f64; 2]>]) -> Vec<u8> {
    let (mut wkb, mut places) = (wkb.to_vec(), chains.iter().flatten());
    let place = &mut |_, point| Ok(places.next().copied().unwrap_or(point));
    wkb::map_coordinates::<WkbError>(&mut wkb, place).expect("it was read before");
    wkb
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Selection, survey};
    use gdal::{DriverManager, vector::LayerAccess};

    #[test]
    fn geometries_are_made_again_from_their_vertices() {
        let made_again = [
            ("POINT (1 2)", "POINT (1 2)"),
            ("MULTIPOINT ((1 2),(3 4))", "MULTIPOINT ((1 2),(3 4))"),
            ("LINESTRING Z (1 2 9,3 4 9,1 2 9)", "LINESTRING (1 2,3 4,1 2)"),
            ("MULTILINESTRING ((1 2,3 4))", "LINESTRING (1 2,3 4)"),
            ("POLYGON EMPTY", "GEOMETRYCOLLECTION EMPTY"),
            (
                "MULTIPOLYGON (((0 0,9 0,9 9,0 0),(6 2,7 2,7 3,6 2)),((20 0,29 0,29 9,20 0)))",
                "MULTIPOLYGON (((0 0,9 0,9 9,0 0),(6 2,7 2,7 3,6 2)),((20 0,29 0,29 9,20 0)))",
            ),
            (
                "GEOMETRYCOLLECTION (POLYGON ((0 0,9 0,9 9,0 0)),LINESTRING (1 2,3 4),POINT (5 6))",
                "GEOMETRYCOLLECTION (POLYGON ((0 0,9 0,9 9,0 0)),LINESTRING (1 2,3 4),POINT (5 6))",
            ),
            ("TIN (((0 0,9 0,9 9,0 0)))", "TIN (((0 0,9 0,9 9,0 0)))"),
            (
                "CURVEPOLYGON (COMPOUNDCURVE (CIRCULARSTRING (0 0,1 1,2 0),(2 0,0 0)))",
                "CURVEPOLYGON (COMPOUNDCURVE (CIRCULARSTRING (0 0,1 1,2 0),(2 0,0 0)))",
            ),
        ];
        let memory = DriverManager::get_driver_by_name("Memory").unwrap();
        let mut dataset = memory.create_vector_only("").unwrap();
        for layer in 0..2 {
            let options =
                gdal::vector::LayerOptions { name: &format!("layer {layer}"), ..Default::default() };
            let mut layer = dataset.create_layer(options).unwrap();
            for (text, _) in made_again {
                layer.create_feature(Geometry::from_wkt(text).unwrap()).unwrap();
            }
        }
        let map = survey(&dataset, &Selection { geometries: true, ..Selection::default() }).unwrap();
        let geometries = map.geometries.unwrap();
        assert_eq!(geometries.len(), 2 * made_again.len());
        for number in 0..geometries.len() {
            let outline = geometries.outline(number, map.data.vertices.coords());
            let text = outline.geometry().unwrap().iso_wkt().unwrap();
            assert_eq!(text, made_again[number % made_again.len()].1);
        }
    }
}
