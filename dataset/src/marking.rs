//! The parts of a marking that do not depend on its source and its target.

use crate::{
    CoordinateSystem, Error, Geometries, Result, Survey,
    quality::{BeforeAfter, Outlines, Quality, State},
    wkb,
};
use meshmark_core::{
    embedding::Marked,
    fingerprint_record::{
        self, BaseEntry, CopyEntry, FingerprintRecord, FingerprintShape, PartEntry, ReferenceEntry,
    },
    ground::Ground,
    key::SecretKey,
    map::Map,
    message::{ADVISED_BITS, LEAST_IDENTIFYING_BITS, Message},
    options::{Options, Parameters, Spelling, Subject},
    record::{self, Distortion, Record, Reference, TopologyEntry},
    recorded::Recorded,
    vertices::VertexTable,
};
use std::borrow::Cow;

/// The movement of the vertices of a map.
#[derive(Clone, Copy)]
pub struct Moves<'a> {
    /// The vertices.
    pub from: &'a VertexTable,
    /// The new place of each, in canonical order, CRS units.
    pub to: &'a [[f64; 2]],
}

impl Moves<'_> {
    /// Returns the new place of a vertex; `None` when it is no vertex of the map.
    pub fn destination(&self, point: [f64; 2]) -> Option<[f64; 2]> {
        self.from.index_of(point).map(|index| self.to[index])
    }

    /// Moves every coordinate of a WKB geometry and returns their number.
    ///
    /// # Errors
    /// Fails for a coordinate that is no vertex of the map and for bytes that are not a geometry.
    pub fn geometry(&self, bytes: &mut [u8]) -> std::result::Result<usize, NotMoved> {
        let mut count = 0;
        wkb::map_coordinates::<NotMoved>(bytes, &mut |_, point| {
            count += 1;
            self.destination(point).ok_or(NotMoved::UnknownVertex(point))
        })?;
        Ok(count)
    }
}

/// Why a geometry was not moved.
#[derive(Debug, thiserror::Error)]
pub enum NotMoved {
    /// Its coordinate is not in the table.
    #[error("({}, {}) was not there when the map was read", .0[0], .0[1])]
    UnknownVertex([f64; 2]),
    /// Its bytes are malformed.
    #[error(transparent)]
    Wkb(#[from] wkb::WkbError),
}

/// The program and its version, for records.
const SOFTWARE: &str = concat!("meshmark ", env!("CARGO_PKG_VERSION"));

/// A map smaller than this many tolerances would be noise after its marking.
const LEAST_TOLERANCES: f64 = 10.0;

/// Fails for a map so small that its units must be wrong.
///
/// # Errors
/// [`Error::TooSmall`].
pub fn check_extent(map: &Map, parameters: &Parameters) -> Result<()> {
    let (min, max) = map.vertices.bounds();
    let [width_m, height_m] = map.ground.metres_between(min, max);
    let size_m = width_m.max(height_m);
    let tolerance_m = parameters.tolerance_m;
    match map.vertices.len() > 1 && size_m < LEAST_TOLERANCES * tolerance_m {
        true => Err(Error::TooSmall { size_m, tolerance_m }),
        false => Ok(()),
    }
}

/// Fails where the mark has one scale, and its error is so large that vertices would move further
/// than wanted.
///
/// # Errors
/// [`Error::UnevenScale`].
pub fn check_scale(map: &Map, crs: Option<&CoordinateSystem>) -> Result<()> {
    let uneven = match (map.ground, map.measure) {
        (Ground::Plane { .. }, Ground::Uneven(lattice)) => lattice.unevenness(map.vertices),
        _ => None,
    };
    match uneven {
        None => Ok(()),
        Some((off, ends)) => {
            let crs = crs.map_or_else(String::new, CoordinateSystem::brief_name);
            Err(Error::UnevenScale { ends, off_percent: 100.0 * off, crs })
        }
    }
}

/// Returns warnings about what is legal and probably not intended. `message` is what the code carries;
/// a fingerprint has none.
pub fn warnings(
    options: &Options,
    message: Option<&Message>,
    map: &Survey,
    patches: usize,
    spelling: Spelling,
) -> Vec<String> {
    let parameters = &options.parameters;
    let mut warnings = Vec::new();
    if map.crs.is_none() {
        let srs = spelling.value("SRS", "...");
        warnings
            .push(format!("the source has no CRS: its units are taken as metres; say {srs} if they are not"));
    }
    if let Some(message) = message.filter(|message| message.len() < LEAST_IDENTIFYING_BITS) {
        warnings.push(format!(
            "a message of {} bits identifies nobody, and verification will never call it a match: use {} \
             hexadecimal digits or more",
            message.len(),
            ADVISED_BITS / 4
        ));
    }
    let of_message = |message| {
        let coefficients = 2 * patches * parameters.code.encode(message).len() * parameters.chip_rate;
        parameters.amplitude_m * (coefficients as f64 / map.data.vertices.len() as f64).sqrt()
    };
    let wanted_rms_m = message.map_or(parameters.amplitude_m, of_message);
    if wanted_rms_m > parameters.tolerance_m {
        warnings.push(format!(
            "{} would move the vertices by {wanted_rms_m:.2} m RMS, more than {} m, where many of them are held: the map \
             is distorted and the mark gains little; lower {}",
            spelling.value("AMPLITUDE", parameters.amplitude_m),
            spelling.value("TOLERANCE", parameters.tolerance_m),
            spelling.name("AMPLITUDE")
        ));
    }
    warnings
}

/// The open options for any map. CSV files hold their coordinates as text, which would otherwise
/// stay an attribute, and unmarked; layers of OpenStreetMap files must be read one at a time,
/// whatever the configuration. With @ an option concerns only drivers that have it.
pub const OPEN_OPTIONS: [&str; 2] = ["@KEEP_GEOM_COLUMNS=NO", "@INTERLEAVED_READING=NO"];

/// Returns the record's description of the reference map.
pub fn reference(map: &Survey, patches: usize) -> Reference {
    Reference {
        vertices: map.data.vertices.len(),
        patches,
        vertices_sha256: map.data.vertices.digest(),
        crs: map.crs.as_ref().map(|crs| crs.label()),
    }
}

/// The unmarked geometries of a map, with which marked copies are compared.
pub struct Unmarked<'a> {
    geometries: &'a Geometries,
    coords: &'a [[f64; 2]],
    measure: &'a Ground,
    state: State,
}

impl<'a> Unmarked<'a> {
    /// Measures all geometries of a map.
    pub fn new(geometries: &'a Geometries, map: &Map<'a>) -> Self {
        let coords = map.vertices.coords();
        let state =
            State::measure(outlines(geometries, &|number| Cow::Owned(geometries.outline(number, coords))));
        Unmarked { geometries, coords, measure: map.measure, state }
    }

    /// Returns the distortion of a marked copy.
    pub fn distortion(&self, marked: &Marked, parameters: &Parameters) -> Distortion {
        let get_before = |number| Cow::Owned(self.geometries.outline(number, self.coords));
        let get_after = |number| Cow::Owned(self.geometries.outline(number, &marked.coords));
        let [before, after] = [outlines(self.geometries, &get_before), outlines(self.geometries, &get_after)];
        let state = State::measure(after);
        let grid = parameters.precision_crs_units.unwrap_or(0.0);
        let comparison = BeforeAfter {
            before: (before, &self.state),
            after: (after, &state),
            measure: self.measure,
            grid,
        };
        let Quality { areas, hausdorff, validity, overlaps, .. } = comparison.quality();
        Distortion {
            displacement: marked.displacement,
            angles: marked.angles,
            areas,
            hausdorff,
            validity,
            overlaps,
            topology: TopologyEntry { t_junctions: marked.junctions, attenuated_vertices: marked.attenuated },
        }
    }
}

fn outlines<'a>(
    geometries: &Geometries,
    get: &'a (dyn Fn(usize) -> Cow<'a, crate::Outline> + Sync),
) -> Outlines<'a> {
    Outlines { count: geometries.len(), get }
}

/// The parts of a fingerprint, and the editions that the map rests on.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lineage {
    /// The parts of the map and its bases; none of a message.
    pub parts: Vec<PartEntry>,
    /// The bases.
    pub bases: Vec<BaseEntry>,
}

/// Returns the record of a marking, a fingerprint or a message as the options have it.
pub fn recorded(
    options: &Options,
    subject: &Subject,
    key: &SecretKey,
    (reference, lineage): (Reference, Lineage),
    distortion: Distortion,
) -> Recorded {
    match (options.coefficients, subject) {
        (Some(coefficients), Subject::Recipient(recipient)) => Recorded::Fingerprint(fingerprint_record(
            options,
            recipient,
            key,
            coefficients,
            (reference, lineage),
            distortion,
        )),
        _ => Recorded::Message(record(options, subject, key, reference, distortion)),
    }
}

/// Returns the record of a marking with a message.
pub fn record(
    options: &Options,
    subject: &Subject,
    key: &SecretKey,
    reference: Reference,
    distortion: Distortion,
) -> Record {
    let Distortion { displacement, angles, areas, hausdorff, validity, overlaps, topology } = distortion;
    Record {
        meshmark_record: record::VERSION,
        software: SOFTWARE.into(),
        key_id: key.id(),
        recipient: subject.recipient().map(String::from),
        message: subject.message(key).to_hex(),
        whitened: matches!(subject, Subject::Message(_)),
        parameters: options.parameters.clone(),
        layers: options.layers.clone(),
        srs: options.srs.clone(),
        reference,
        displacement,
        angles,
        areas,
        hausdorff,
        validity,
        overlaps,
        topology,
    }
}

/// Returns the record of a marking for a recipient with a fingerprint of `coefficients`
/// coefficients. The digests of the files of the map are not known here.
pub fn fingerprint_record(
    options: &Options,
    recipient: &str,
    key: &SecretKey,
    coefficients: usize,
    (reference, lineage): (Reference, Lineage),
    distortion: Distortion,
) -> FingerprintRecord {
    let (Reference { vertices, vertices_sha256, crs, .. }, Lineage { parts, bases }) = (reference, lineage);
    FingerprintRecord {
        meshmark_record: fingerprint_record::VERSION,
        software: SOFTWARE.into(),
        key_commitment: key.commitment(),
        recipient: recipient.into(),
        mark: FingerprintShape::new(coefficients, &options.parameters),
        layers: options.layers.clone(),
        srs: options.srs.clone(),
        reference: ReferenceEntry { vertices, vertices_sha256, file_sha256: None, crs },
        copy: CopyEntry { file_sha256: None },
        parts,
        bases,
        distortion,
    }
}
