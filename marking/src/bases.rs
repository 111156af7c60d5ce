//! The bases of a marking: the earlier editions from which vertices stand, with their references, and
//! the anchors by which the map fits other sheets.

use crate::{Crs, Error, Lineage, Result, Survey};
use meshmark_core::{
    anchors::Anchors,
    fingerprint_record::{BaseEntry, Divided},
    ground::Ground,
    map::Map,
    map_data::MapData,
    options::Parameters,
    part::PartDigest,
    series::{Edition, Series},
};

/// Reads a reference as its entry describes it; returns nothing for a map without these layers.
pub type ReadBase<'a, R, C, E> = dyn FnMut(&R, &BaseEntry) -> std::result::Result<Option<Survey<C>>, E> + 'a;

/// The earlier editions from which vertices of a map stand, the oldest first, and its anchors; or the
/// size of the parts into which it is cut.
#[derive(Default)]
pub struct Bases {
    anchors: Anchors,
    part_size: Option<usize>,
    entries: Vec<BaseEntry>,
    references: Vec<BaseMap>,
}

/// The reference of a base.
struct BaseMap {
    data: MapData,
    /// Metres on the ground at the place of a vertex, which fingerprints follow.
    ground: Ground,
}

impl Bases {
    /// Creates the bases of a map that has anchors alone, or is cut into parts of this size.
    pub fn of_one(anchors: Anchors, part_size: Option<usize>) -> Self {
        Bases { anchors, part_size, ..Bases::default() }
    }

    /// Finds the reference of every entry among these files, for a map with these anchors or this size
    /// of parts; `read` returns nothing for a file that lacks the layers of the entry.
    ///
    /// # Errors
    /// Fails on an entry without a reference, and on the errors of `read`.
    pub fn find<R, C: Crs, E: From<Error>>(
        (entries, anchors): (Vec<BaseEntry>, Anchors),
        part_size: Option<usize>,
        files: &[R],
        read: &mut ReadBase<'_, R, C, E>,
    ) -> std::result::Result<Self, E> {
        let mut found: Vec<Option<Survey<C>>> = entries.iter().map(|_| None).collect();
        let alike = |a: &BaseEntry, b: &BaseEntry| a.layers == b.layers && a.srs == b.srs;
        for file in files {
            for (number, entry) in entries.iter().enumerate() {
                // Entries that describe their maps alike read the file alike.
                let lack = |(survey, other): (&Option<Survey<C>>, &BaseEntry)| {
                    survey.is_none() && alike(other, entry)
                };
                let is_first = !entries[..number].iter().any(|other| alike(other, entry));
                if !is_first || !found.iter().zip(&entries).any(lack) {
                    continue;
                }
                let Some(survey) = read(file, entry)? else { continue };
                let digest = survey.data.vertices.digest();
                let own = |other: &BaseEntry| other.vertices_sha256 == digest && alike(other, entry);
                if let Some(place) = entries.iter().position(own) {
                    found[place].get_or_insert(survey);
                }
            }
        }
        let lost = found.iter().zip(&entries).find(|(survey, _)| survey.is_none());
        if let Some((_, entry)) = lost {
            return Err(Error::LostBase { vertices_sha256: entry.vertices_sha256.clone() }.into());
        }
        let of_survey = |survey: Survey<C>| {
            let ground = survey.measure()?.clone();
            Ok::<BaseMap, Error>(BaseMap { data: survey.data, ground })
        };
        let references = found.into_iter().flatten().map(of_survey).collect::<Result<_>>()?;
        Ok(Bases { anchors, part_size, entries, references })
    }

    /// Returns the names of the parts into which the base whose reference has this digest is cut; `None`
    /// where it is not.
    ///
    /// # Errors
    /// Returns the errors of [`Series::new`].
    pub fn cut_parts(
        &self,
        vertices_sha256: &str,
        parameters: &Parameters,
    ) -> meshmark_core::Result<Option<Vec<PartDigest>>> {
        let mut bases = self.entries.iter().zip(&self.references);
        let Some((entry, BaseMap { data, ground })) =
            bases.find(|(entry, _)| entry.vertices_sha256 == vertices_sha256)
        else {
            return Ok(None);
        };
        // What is cut rests on nothing.
        let (map, part_size) = (data.on(ground, ground), entry.part_size);
        let edition = Edition { map, bases: Vec::new(), anchors: &[], part_size };
        Ok(Series::new(vec![edition], parameters)?.cut_parts(0))
    }

    /// Returns whether a vertex of the map is in the reference of a base.
    pub fn have_any_of<C>(&self, map: &Survey<C>) -> bool {
        let is_there = |point: &[f64; 2]| {
            self.references.iter().any(|base| base.data.vertices.index_of(*point).is_some())
        };
        map.data.vertices.coords().iter().any(is_there)
    }

    /// Returns whether there are no bases, so that a map alone has all vertices.
    pub fn are_none(&self) -> bool {
        self.entries.is_empty()
    }

    /// Returns what a record says about the bases, the anchors, and the parts that follow from them.
    pub fn lineage(&self, divided: Divided) -> Lineage {
        Lineage { divided, bases: self.entries.clone(), anchors: self.anchors.clone() }
    }

    /// Returns the series of the bases and a map that rests on them.
    ///
    /// # Errors
    /// Returns the errors of [`Series::new`].
    pub fn series<'a>(
        &'a self,
        map: Map<'a>,
        parameters: &'a Parameters,
    ) -> meshmark_core::Result<Series<'a>> {
        let number = |digest: &String| {
            self.entries.iter().position(|entry| entry.vertices_sha256 == *digest).expect("it was checked")
        };
        let edition = |(entry, BaseMap { data, ground }): (&'a BaseEntry, &'a BaseMap)| Edition {
            map: data.on(ground, ground),
            bases: entry.bases.iter().map(number).collect(),
            anchors: entry.anchors.as_slice(),
            part_size: entry.part_size,
        };
        let mut editions: Vec<Edition> = self.entries.iter().zip(&self.references).map(edition).collect();
        editions.push(Edition {
            map,
            bases: (0..self.entries.len()).collect(),
            anchors: self.anchors.as_slice(),
            part_size: self.part_size,
        });
        Series::new(editions, parameters)
    }

    /// Returns a map with the vertices of its bases besides its own.
    ///
    /// # Errors
    /// Fails where the maps span too much.
    pub fn united<C: Clone>(&self, map: &Survey<C>) -> Result<Survey<C>> {
        let earlier: Vec<&MapData> = self.references.iter().map(|base| &base.data).collect();
        let mut united = map.clone();
        united.data = map.data.with_earlier(&earlier)?;
        Ok(united)
    }
}
