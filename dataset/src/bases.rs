//! The bases of a marking: the earlier editions from which vertices stand, with their references, and
//! the anchors by which the map fits other sheets.

use crate::{Error, Result, Survey, sheets};
use meshmark_core::{
    anchors::Anchors,
    fingerprint_record::{BaseEntry, Divided, FingerprintRecord},
    ground::Ground,
    key::{SecretKey, read_text},
    map::Map,
    map_data::MapData,
    options::{Options, Parameters, join_list},
    recorded::Recorded,
    series::{Edition, Series},
};
use meshmark_marking::{Crs, Lineage};
use std::{
    fs::{self, File},
    path::{Path, PathBuf},
};

/// The options that shape a fingerprint, which all editions of a series share.
const SHARED: [&str; 6] = ["AMPLITUDE", "PATCH_SIZE", "TOLERANCE", "PRECISION", "SHAPE", "BASIS"];

/// Reads a reference as its entry describes it; returns nothing for a map without these layers.
pub type ReadBase<'a, E> = dyn FnMut(&Path, &BaseEntry) -> std::result::Result<Option<Survey>, E> + 'a;

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
    /// Reads the bases and the plan of sheets that options name, for a map that is to be marked with
    /// this key. `read` reads a reference as its entry describes it.
    ///
    /// # Errors
    /// Fails on a plan that the map is not in, on a record that is unreadable or of another key, mark or map, on a reference that is
    /// missing, and on the errors of `read`.
    pub fn of_options<E: From<Error>>(
        options: &Options,
        key: &SecretKey,
        map: &Survey,
        read: &mut ReadBase<'_, E>,
    ) -> std::result::Result<Self, E> {
        let anchors = sheets::anchors(options, map)?;
        let Some(named) = &options.bases else {
            return match options.base_references {
                Some(_) => Err(Error::NoBase.into()),
                None => Ok(Bases {
                    anchors,
                    part_size: options.parts_of(map.data.vertices.len()),
                    ..Bases::default()
                }),
            };
        };
        let mut entries: Vec<BaseEntry> = Vec::new();
        let own_digest = map.data.vertices.digest();
        for path in records_at(named)? {
            let record = read_record(&path)?;
            check_record(&path, &record, options, key, map)?;
            // A copy of this very edition for somebody else is no earlier edition, but it may name some.
            if record.reference.vertices_sha256 == own_digest && record.bases.is_empty() {
                return Err(Error::BaseOfThisEdition { base: path }.into());
            }
            for entry in record.chain().into_iter().filter(|entry| entry.vertices_sha256 != own_digest) {
                match entries.iter().find(|known| known.vertices_sha256 == entry.vertices_sha256) {
                    None => entries.push(entry),
                    Some(known) if *known == entry => {}
                    Some(_) => return Err(Error::ContradictingBase { base: path }.into()),
                }
            }
        }
        let references = options.base_references.as_ref().ok_or(Error::NoBaseReference)?;
        let references: Vec<PathBuf> = references.iter().map(PathBuf::from).collect();
        let bases = Bases::find((entries, anchors), None, &references, read)?;
        match bases.have_any_of(map) {
            true => Ok(bases),
            false => Err(Error::OtherBase { base: join_list(named) }.into()),
        }
    }

    /// Finds the reference of every entry among these files, for a map with these anchors or this size
    /// of parts; `read` returns nothing for a file that lacks the layers of the entry.
    ///
    /// # Errors
    /// Fails on an entry without a reference, and on the errors of `read`.
    pub fn find<E: From<Error>>(
        (entries, anchors): (Vec<BaseEntry>, Anchors),
        part_size: Option<usize>,
        files: &[PathBuf],
        read: &mut ReadBase<'_, E>,
    ) -> std::result::Result<Self, E> {
        let mut found: Vec<Option<Survey>> = entries.iter().map(|_| None).collect();
        let alike = |a: &BaseEntry, b: &BaseEntry| a.layers == b.layers && a.srs == b.srs;
        for file in files {
            for (number, entry) in entries.iter().enumerate() {
                // Entries that describe their maps alike read the file alike.
                let lack =
                    |(survey, other): (&Option<Survey>, &BaseEntry)| survey.is_none() && alike(other, entry);
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
        let of_survey = |survey: Survey| {
            let ground = survey.measure()?.clone();
            Ok::<BaseMap, Error>(BaseMap { data: survey.data, ground })
        };
        let references = found.into_iter().flatten().map(of_survey).collect::<Result<_>>()?;
        Ok(Bases { anchors, part_size, entries, references })
    }

    fn have_any_of(&self, map: &Survey) -> bool {
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
    pub fn united(&self, map: &Survey) -> Result<Survey> {
        let earlier: Vec<&MapData> = self.references.iter().map(|base| &base.data).collect();
        let mut united = map.clone();
        united.data = map.data.with_earlier(&earlier)?;
        Ok(united)
    }
}

/// Returns the paths of records, those of folders in the order of their names.
fn records_at(named: &[String]) -> Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for name in named.iter().map(PathBuf::from) {
        if !name.is_dir() {
            paths.push(name);
            continue;
        }
        let unread = |source| Error::BaseUnread { base: name.clone(), source };
        let mut found = Vec::new();
        for entry in fs::read_dir(&name).map_err(unread)? {
            let path = entry.map_err(unread)?.path();
            if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json")) {
                found.push(path);
            }
        }
        if found.is_empty() {
            return Err(Error::NoRecordOfBase { folder: name });
        }
        found.sort();
        paths.extend(found);
    }
    Ok(paths)
}

fn read_record(path: &Path) -> Result<FingerprintRecord> {
    let base = || path.to_path_buf();
    let text =
        File::open(path).and_then(read_text).map_err(|source| Error::BaseUnread { base: base(), source })?;
    match Recorded::from_json(&text) {
        Ok(Recorded::Fingerprint(record)) => Ok(record),
        Ok(Recorded::Message(_)) => Err(Error::BaseOfMessage { base: base() }),
        Err(source) => Err(Error::BaseMalformed { base: base(), source }),
    }
}

/// Checks that a record of an edition and a marking are of one series.
fn check_record(
    path: &Path,
    record: &FingerprintRecord,
    options: &Options,
    key: &SecretKey,
    map: &Survey,
) -> Result<()> {
    let base = || path.to_path_buf();
    if !record.is_of(key) {
        return Err(Error::BaseOfOtherKey { base: base() });
    }
    let crs = map.crs.as_ref().map(|crs| crs.label());
    if record.reference.crs != crs {
        return Err(Error::BaseInOtherCrs { base: base() });
    }
    let recorded = record.options();
    let differs = |name: &&&str| recorded.text_of(name) != options.text_of(name);
    if let Some(option) = SHARED.iter().find(differs) {
        let (made_with, given) = (recorded.text_of(option), options.text_of(option));
        return Err(Error::BaseOfOtherMark { base: base(), option, made_with, given });
    }
    let whole = &record.reference.vertices_sha256;
    if record.is_whole() && !record.parts.iter().all(|part| part.sha256.to_string() == *whole) {
        return Err(Error::BaseOfOtherParts { base: base() });
    }
    match options.coefficients == recorded.coefficients {
        true => Ok(()),
        false => Err(Error::BaseOfOtherVersion { base: base() }),
    }
}
