//! The effect of marking on a map.
//!
//! Features correspond by their order within a layer of the same name, vertices by their order within a
//! feature: the driver changes neither. Lengths, angles and areas are measured on the ground.

mod counterparts;
mod crossings;
pub mod detail;
mod text;

pub use crossings::Crossings;

use crate::{Error, Result};
use counterparts::Pair;
use detail::{Detail, Findings};
use meshmark_core::{
    distortion::{AngleChange, Areas, Corner, Displacement, Hausdorff, Overlaps, Validity},
    ground::Ground,
    map::Map,
    vertices::VertexTable,
};
use meshmark_marking::{
    FeatureGeometry, Outline, TransformableCrs,
    quality::{self, Geos, Outlines, Quality, State},
};
use serde::Serialize;
use std::borrow::Cow;

/// The figures of a comparison. `docs/compare.schema.json` describes them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Version of this format.
    pub meshmark_comparison: u32,
    /// Numbers of compared objects.
    pub compared: Counts,
    /// Displacements of the vertices.
    pub displacement: Displacement,
    /// Hausdorff distances of the features.
    pub hausdorff: Hausdorff,
    /// Angles at corners: vertices where exactly two segments meet.
    pub angles: AngleChange,
    /// Areas of polygons.
    pub areas: Areas,
    /// Validity by GEOS.
    pub validity: Validity,
    /// Polygons that overlap, by GEOS.
    pub overlaps: Overlaps,
    /// Segments that cross.
    pub crossings: Crossings,
    /// The places of differences; null except in a report file.
    pub detail: Option<Detail>,
}

/// Numbers of compared objects.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Counts {
    /// Number of geometries.
    pub features: usize,
    /// Number of distinct vertices of the reference.
    pub vertices: usize,
    /// Number of those whose occurrences are no longer at one place.
    pub torn_vertices: usize,
}

/// No mark moves a vertex further than this, metres: coordinates are in different CRS then.
const MOST_AWAY_M: f64 = 100.0;

/// Two maps, paired feature by feature.
pub(crate) struct Pairs<'a> {
    pub features: Vec<Pair>,
    pub measure: &'a Ground,
    pub geos: &'a dyn Geos,
    /// Cell size of the grid of the marked map, CRS units; 0 without a grid.
    pub grid: f64,
}

/// The details of a comparison to keep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Details {
    /// The figures alone.
    None,
    /// The places of differences.
    Places,
    /// The places of differences, and exact displacements of vertices.
    Displacements,
}

/// A map to compare: its geometries in order, and the first CRS of a layer.
pub type Compared<C> = (Vec<FeatureGeometry>, Option<C>);

/// Compares a reference with the marked map, and keeps these details. `measure` is the ground of the
/// reference; `precision` is the cell size of the grid of the marked map, CRS units: overlaps up to a cell of
/// it are slivers.
///
/// # Errors
/// Fails on maps whose features do not correspond.
pub fn compare<C: TransformableCrs>(
    (before, own): Compared<C>,
    (after, other): Compared<C>,
    (measure, geos): (&Ground, &dyn Geos),
    precision: Option<f64>,
    details: Details,
) -> Result<Comparison> {
    let places = before.iter().zip(&after).find_map(|(a, b)| a.outline.first().zip(b.outline.first()));
    let away_m = places
        .map_or(0.0, |(from, to)| measure.metres_between(from, to).iter().fold(0.0, |a: f64, b| a.hypot(*b)));
    if let (Some(own), Some(other), true) = (own, other, away_m > MOST_AWAY_M)
        && !own.is_same(&other)
    {
        let [own, other] = own.names_apart(&other);
        return Err(Error::OtherCrs { own, other });
    }
    let features = counterparts::pairs(before, after)?;
    Ok(Pairs { features, measure, geos, grid: precision.unwrap_or(0.0) }.compare(details))
}

impl Pairs<'_> {
    fn compare(&self, details: Details) -> Comparison {
        let all = |map: fn(&Pair) -> &Outline| {
            self.features.iter().flat_map(move |pair| map(pair).chains.iter().flatten().copied())
        };
        let (vertices, indices) =
            VertexTable::indexed(all(|pair| &pair.before).collect()).expect("a map that was read is finite");
        let mut moved: Vec<Option<[f64; 2]>> = vec![None; vertices.len()];
        let mut torn = vec![false; vertices.len()];
        for (&index, to) in indices.iter().zip(all(|pair| &pair.after)) {
            let place = moved[index as usize].get_or_insert(to);
            torn[index as usize] |= *place != to;
        }
        let moved: Vec<[f64; 2]> = moved.into_iter().map(|to| to.expect("every vertex occurs")).collect();
        let segments = self.segments(&indices);
        let map = Map { segments: &segments, ..Map::of_points(&vertices, self.measure) };
        let corners = Corner::all(&map, &moved);
        let Quality { areas, hausdorff, validity, overlaps, newly_invalid, newly_overlapping } =
            self.quality();
        let (crossings, crossing) = crossings::crossings(&segments, vertices.coords(), &moved, self.measure);
        let detail = (details != Details::None).then(|| {
            let torn = vertices.coords().iter().zip(&torn).filter(|(_, torn)| **torn);
            let place = |number: &u32| self.features[*number as usize].before.first();
            let invalid = newly_invalid.iter().filter_map(place).collect();
            let overlapping = newly_overlapping.iter().filter_map(|[_, second]| place(second)).collect();
            Findings {
                vertices: &vertices,
                moved: &moved,
                measure: self.measure,
                segments: &segments,
                corners: &corners,
                places: [torn.map(|(at, _)| *at).collect(), invalid, overlapping, crossing],
            }
            .detail(details == Details::Displacements)
        });
        Comparison {
            meshmark_comparison: 1,
            compared: Counts {
                features: self.features.len(),
                vertices: vertices.len(),
                torn_vertices: torn.into_iter().filter(|torn| *torn).count(),
            },
            displacement: Displacement::between(&vertices, &moved, self.measure),
            hausdorff,
            angles: AngleChange::at(&corners),
            areas,
            validity,
            overlaps,
            crossings,
            detail,
        }
    }

    /// Returns the distinct segments as pairs of indices.
    fn segments(&self, indices: &[u32]) -> Vec<[u32; 2]> {
        let mut rest = indices;
        let mut segments = Vec::new();
        for chain in self.features.iter().flat_map(|pair| &pair.before.chains) {
            let (own, others) = rest.split_at(chain.len());
            segments.extend(own.windows(2).map(|pair| [pair[0].min(pair[1]), pair[0].max(pair[1])]));
            rest = others;
        }
        segments.retain(|[a, b]| a != b);
        segments.sort_unstable();
        segments.dedup();
        segments
    }

    fn quality(&self) -> Quality {
        let count = self.features.len();
        let before = |number: usize| Cow::Borrowed(&self.features[number].before);
        let after = |number: usize| Cow::Borrowed(&self.features[number].after);
        let (before, after) = (Outlines { count, get: &before }, Outlines { count, get: &after });
        let [was, is] = [before, after].map(|map| State::measure(map, self.geos));
        quality::BeforeAfter {
            before: (before, &was),
            after: (after, &is),
            measure: self.measure,
            grid: self.grid,
        }
        .quality()
    }
}
