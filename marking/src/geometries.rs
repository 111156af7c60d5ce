//! Geometries as chains of vertices.

use crate::{
    chains::Chains,
    wkb::{self, Step, WkbError},
};
use geo::{Geometry, GeometryCollection, LineString, Point, Polygon};
use std::{borrow::Cow, collections::BTreeMap};

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

    /// Returns the geometry as well-known binary.
    pub fn wkb(&self) -> Cow<'_, [u8]> {
        match &self.wkb {
            Some(wkb) => Cow::Borrowed(wkb),
            None => Cow::Owned(wkb::of_chains(&self.chains, &self.kinds)),
        }
    }

    /// Returns the area of its polygons less that of their holes, CRS units squared; that of arcs is
    /// the area of their chords.
    pub fn area(&self) -> f64 {
        let ring = |(chain, kind): (&Vec<[f64; 2]>, &Step)| match kind {
            Step::Shell => ring_area(chain),
            Step::Hole => -ring_area(chain),
            Step::First | Step::Next => 0.0,
        };
        self.chains.iter().zip(&self.kinds).map(ring).fold(0.0, |sum, area| sum + area)
    }

    /// Returns whether its chains describe it completely: it has no arcs and no collections.
    pub fn is_plain(&self) -> bool {
        self.wkb.as_deref().is_none_or(wkb::is_plain)
    }

    /// Returns its points, lines and polygons as a collection; lines of one vertex are points.
    pub fn to_collection(&self) -> Geometry {
        let line = |chain: &Vec<[f64; 2]>| chain.iter().map(|&[x, y]| (x, y)).collect::<LineString>();
        let mut rest = self.chains.iter().zip(&self.kinds).peekable();
        let mut parts: Vec<Geometry> = Vec::new();
        while let Some((chain, kind)) = rest.next() {
            parts.push(match (kind, chain.as_slice()) {
                (Step::Shell, _) => {
                    let mut holes = Vec::new();
                    while let Some((hole, _)) = rest.next_if(|(_, kind)| **kind == Step::Hole) {
                        holes.push(line(hole));
                    }
                    Polygon::new(line(chain), holes).into()
                }
                (_, &[[x, y]]) => Point::new(x, y).into(),
                _ => line(chain).into(),
            });
        }
        Geometry::GeometryCollection(GeometryCollection(parts))
    }

    /// Returns its first vertex.
    pub fn first(&self) -> Option<[f64; 2]> {
        self.chains.first()?.first().copied()
    }
}

/// One geometry of a map, for comparing two maps feature by feature.
#[derive(Debug, Clone)]
pub struct FeatureGeometry {
    /// The name of its layer.
    pub layer: String,
    /// The name of its feature for messages.
    pub fid: String,
    /// The geometry.
    pub outline: Outline,
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
    /// Creates the geometries from the chains of a walk and the vertex of every coordinate.
    pub fn new(indices: Vec<u32>, chains: Chains) -> Self {
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

/// Returns the area within a ring: half the sum of xᵢ (yᵢ₊₁ − yᵢ₋₁).
fn ring_area(ring: &[[f64; 2]]) -> f64 {
    let count = ring.len();
    let term = |i: usize| ring[i][0] * (ring[(i + 1) % count][1] - ring[(i + count - 1) % count][1]);
    0.5 * (0..count).map(term).fold(0.0, |sum, term| sum + term).abs()
}

/// Returns the same geometry with its coordinates at these places.
fn with_places(wkb: &[u8], chains: &[Vec<[f64; 2]>]) -> Vec<u8> {
    let (mut wkb, mut places) = (wkb.to_vec(), chains.iter().flatten());
    let place = &mut |_, point| Ok(places.next().copied().unwrap_or(point));
    wkb::map_coordinates::<WkbError>(&mut wkb, place).expect("it was read before");
    wkb
}
