//! A reference and a registered suspect whose vertices are matched.

use crate::{
    growth::Growth,
    matching::{Matcher, Matches, Radius, RadiusChoice, by_chance, is_chance},
    registration::{Registration, place_pairs},
};
use meshmark_core::{
    Result, ground::Ground, map::Map, map_data::MapData, options::Parameters, part::Parts, patches::Patches,
    series::Series,
};
use rstar::{AABB, Envelope};
use std::sync::OnceLock;

/// Above this share of found vertices most are found.
const MOST_FOUND: f64 = 0.7;

/// The map before marking.
pub struct Reference<'a> {
    /// The data of the map.
    pub data: &'a MapData,
    /// The ground metric of the mark, metres per CRS unit.
    pub ground: Ground,
    /// The patches of its mesh.
    pub patches: Patches,
    /// The parts on which the signs of fingerprints depend.
    pub parts: Parts,
    /// Number of coefficients of a patch and axis that carry the message.
    pub(crate) carriers: usize,
}

impl<'a> Reference<'a> {
    /// Meshes a map and cuts it into patches; `map` is `data` on the ground.
    ///
    /// # Errors
    /// Fails when a mark with these parameters does not fit the map.
    pub fn new(data: &'a MapData, map: &Map, bits: usize, parameters: &Parameters) -> Result<Self> {
        let patches = Patches::new(map, parameters)?;
        let (carriers, parts) = (patches.carriers(bits, parameters)?, Parts::whole(&data.vertices));
        Ok(Reference { data, ground: map.ground.clone(), patches, parts, carriers })
    }

    /// Meshes the parts of a series and cuts them into patches, as [`Self::new`] does, for
    /// fingerprints of `coefficients` coefficients of every patch and axis. The map is the newest one
    /// with the vertices of all, see [`MapData::with_earlier`].
    ///
    /// # Errors
    /// Fails when such a fingerprint does not fit a map.
    pub fn for_fingerprints(
        data: &'a MapData,
        map: &Map,
        series: &Series,
        coefficients: usize,
    ) -> Result<Self> {
        let (patches, parts) = series.patches_on(map, coefficients)?;
        Ok(Reference { data, ground: map.ground.clone(), patches, parts, carriers: coefficients })
    }
}

/// A suspect whose vertices are matched with those of its reference.
pub struct Matched<'a> {
    /// The reference.
    pub reference: &'a Reference<'a>,
    /// The suspect, in the CRS of the reference.
    pub suspect: &'a MapData,
    /// Vertices of the suspect after registration, CRS units of the reference.
    pub moved: Vec<[f64; 2]>,
    /// The matching radius.
    pub radius: Radius,
    /// The matches of the vertices.
    pub matches: Matches,
    /// Number of vertices that match after the suspect is shifted out of place.
    pub by_chance: usize,
    /// The registration of the suspect.
    pub(crate) registration: Registration,
    /// What [`Matched::grown`] returns.
    grown: OnceLock<Option<Vec<[f64; 2]>>>,
}

impl<'a> Matched<'a> {
    /// Matches the vertices of a registered suspect.
    pub fn new(
        reference: &'a Reference<'a>,
        suspect: &'a MapData,
        registration: &Registration,
        radius: RadiusChoice,
    ) -> Self {
        let moved = registration.apply(suspect.vertices.coords());
        Self::of_moved(reference, (suspect, registration), moved, |matcher, moved, unit_m| {
            radius.choose(matcher, moved, unit_m)
        })
    }

    /// Matches the vertices of a suspect at these places, CRS units of the reference.
    pub(crate) fn of_moved(
        reference: &'a Reference<'a>,
        (suspect, registration): (&'a MapData, &Registration),
        moved: Vec<[f64; 2]>,
        radius: impl FnOnce(&Matcher, &[[f64; 2]], [f64; 2]) -> Radius,
    ) -> Self {
        let (ground, vertices) = (&reference.ground, &reference.data.vertices);
        let unit_m = ground.metres_per_unit(vertices.centre());
        let matcher = Matcher::new(vertices.coords(), ground, vertices.centre());
        let radius = radius(&matcher, &moved, unit_m);
        let matches = matcher.all(&moved, radius.metres);
        let by_chance = by_chance(&matcher, &moved, unit_m, radius.metres).0.count;
        let registration = registration.clone();
        Matched {
            reference,
            suspect,
            moved,
            radius,
            matches,
            by_chance,
            registration,
            grown: OnceLock::new(),
        }
    }

    /// Returns the places to which a strong smooth deformation takes the reference vertices, CRS
    /// units; `None` where there is none that can be followed.
    pub(crate) fn grown(&self) -> Option<&[[f64; 2]]> {
        let Reference { data, ground, .. } = self.reference;
        self.grown
            .get_or_init(|| {
                let place = |place: [f64; 2]| self.registration.apply(&[place])[0];
                let pairs = place_pairs(data, self.suspect).into_iter().map(|[s, r]| [place(s), r]);
                Growth::new(data, ground, pairs.collect()).grow(&self.moved)
            })
            .as_deref()
    }

    /// Returns whether most reference vertices in the extent of the suspect are among `found` ones.
    pub(crate) fn is_mostly_found(&self, found: usize) -> bool {
        let mut extent = AABB::new_empty();
        self.moved.iter().for_each(|place| extent.merge(&AABB::from_point(*place)));
        let coords = self.reference.data.vertices.coords();
        let there = coords.iter().filter(|place| extent.contains_point(place)).count();
        found as f64 >= MOST_FOUND * there as f64
    }

    /// Returns whether no more vertices match than by chance.
    pub(crate) fn is_chance_of_vertices(&self) -> bool {
        is_chance(self.matches.count, self.by_chance)
    }
}
