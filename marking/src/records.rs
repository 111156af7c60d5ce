//! The record of a marking.

use crate::{
    Crs, Geometries, Outline,
    quality::{BeforeAfter, Geos, Outlines, Quality, State},
};
use meshmark_core::{
    anchors::Anchors,
    embedding::Marked,
    fingerprint_record::{
        self, BaseEntry, CopyEntry, Divided, FingerprintRecord, FingerprintShape, ReferenceEntry,
    },
    ground::Ground,
    key::SecretKey,
    map::Map,
    options::{Options, Parameters, Subject},
    record::{self, Distortion, Record, Reference, TopologyEntry},
    recorded::Recorded,
    vertices::VertexTable,
};
use std::borrow::Cow;

/// The program and its version, for records.
const SOFTWARE: &str = concat!("meshmark ", env!("CARGO_PKG_VERSION"));

/// Returns the record's description of the reference map.
pub fn reference(vertices: &VertexTable, crs: Option<&dyn Crs>, patches: usize) -> Reference {
    Reference {
        vertices: vertices.len(),
        patches,
        vertices_sha256: vertices.digest(),
        crs: crs.map(|crs| crs.label()),
    }
}

/// The unmarked geometries of a map, with which marked copies are compared.
pub struct Unmarked<'a> {
    geometries: &'a Geometries,
    coords: &'a [[f64; 2]],
    measure: &'a Ground,
    geos: &'a dyn Geos,
    state: State,
}

impl<'a> Unmarked<'a> {
    /// Measures all geometries of a map.
    pub fn new(geometries: &'a Geometries, map: &Map<'a>, geos: &'a dyn Geos) -> Self {
        let coords = map.vertices.coords();
        let get = |number| Cow::Owned(geometries.outline(number, coords));
        let state = State::measure(outlines(geometries, &get), geos);
        Unmarked { geometries, coords, measure: map.measure, geos, state }
    }

    /// Returns the distortion of a marked copy.
    pub fn distortion(&self, marked: &Marked, parameters: &Parameters) -> Distortion {
        let get_before = |number| Cow::Owned(self.geometries.outline(number, self.coords));
        let get_after = |number| Cow::Owned(self.geometries.outline(number, &marked.coords));
        let [before, after] = [outlines(self.geometries, &get_before), outlines(self.geometries, &get_after)];
        let state = State::measure(after, self.geos);
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
    get: &'a (dyn Fn(usize) -> Cow<'a, Outline> + Sync),
) -> Outlines<'a> {
    Outlines { count: geometries.len(), get }
}

/// The parts of a fingerprint, and what determines them: the editions that the map rests on, and its
/// anchors.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lineage {
    /// The parts of the map and its bases; none of a message.
    pub divided: Divided,
    /// The bases.
    pub bases: Vec<BaseEntry>,
    /// The vertices that stay in place.
    pub anchors: Anchors,
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
    let (Reference { vertices, vertices_sha256, crs, .. }, lineage) = (reference, lineage);
    let Lineage { divided: Divided { parts, census }, bases, anchors } = lineage;
    let part_size = options.parts_of(vertices);
    FingerprintRecord {
        meshmark_record: fingerprint_record::VERSION,
        software: SOFTWARE.into(),
        key_commitment: key.commitment(),
        recipient: recipient.into(),
        mark: FingerprintShape::new(coefficients, &options.parameters, part_size),
        layers: options.layers.clone(),
        srs: options.srs.clone(),
        reference: ReferenceEntry { vertices, vertices_sha256, file_sha256: None, crs },
        copy: CopyEntry { file_sha256: None },
        parts,
        bases,
        anchors,
        census,
        distortion,
    }
}
