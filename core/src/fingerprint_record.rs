//! The record of a marking for a recipient, version 2: a fingerprint instead of a message.
//!
//! It names key, vertices and files by digests of 256 bits, so that nothing can be exchanged for
//! something else that fits. A later version may add fields, for example a signature: fields
//! that are unknown here are skipped, but not among those that shape the mark.

use crate::{
    Error, Result,
    anchors::Anchors,
    error::RecordFault,
    key::SecretKey,
    options::{AmplitudeOf, Laplacian, Options, PATCH_SIZE_RANGE, Parameters, Rigidity, Subject},
    part::PartDigest,
    record::Distortion,
    series::Census,
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// The version of this record.
pub const VERSION: u32 = 2;

/// A record of a fingerprint. It holds neither the secret nor the time: equal input makes an equal
/// record, but for the digests of files, which may hold the time at which they were written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FingerprintRecord {
    /// Version of this format.
    pub meshmark_record: u32,
    /// Version of the program that marked.
    pub software: String,
    /// Commitment to the key, see [`SecretKey::commitment`].
    pub key_commitment: String,
    /// The recipient.
    pub recipient: String,
    /// The numbers that shaped the mark.
    pub mark: FingerprintShape,
    /// Layers that were marked; all when null.
    pub layers: Option<Vec<String>>,
    /// CRS given for a source that had none.
    pub srs: Option<String>,
    /// The reference map.
    pub reference: ReferenceEntry,
    /// The copy that was handed out.
    pub copy: CopyEntry,
    /// The parts of the map and its bases, each with signs of its own.
    pub parts: Vec<PartEntry>,
    /// The earlier editions from which vertices stand, the oldest first, those of the bases among
    /// them; omitted when there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bases: Vec<BaseEntry>,
    /// The vertices that stay in place, as the sheet fits others; omitted when there are none.
    #[serde(default, skip_serializing_if = "Anchors::is_empty")]
    pub anchors: Anchors,
    /// How the vertices of the map are divided, where some stand or stay; omitted in other records.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub census: Option<Census>,
    /// What marking did to the map, by the names of version 1.
    #[serde(flatten)]
    pub distortion: Distortion,
}

/// The numbers that shape a fingerprint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FingerprintShape {
    /// Expected displacement of the vertices, root mean square, metres on the ground.
    pub amplitude_m: f64,
    /// Coefficients of a patch and axis that carry the mark.
    pub coefficients: usize,
    /// The smallest number of vertices in a patch.
    pub patch_size: usize,
    /// No vertex moves further than this, metres on the ground.
    pub tolerance_m: f64,
    /// Which vertices move as one.
    pub shape: Rigidity,
    /// Which functions carry the mark.
    pub basis: Laplacian,
    /// Grid of the marked coordinates, CRS units; null where it is not rounded.
    pub precision_crs_units: Option<f64>,
    /// The map is cut into parts of nearly so many vertices; omitted where it is one part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part_size: Option<usize>,
}

/// The reference map, as a record describes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceEntry {
    /// Distinct vertices of the marked layers.
    pub vertices: usize,
    /// Digest of the vertices, see [`crate::vertices::VertexTable::digest`].
    pub vertices_sha256: String,
    /// Digest of its file; null where it is not one file, or was never written as one.
    pub file_sha256: Option<String>,
    /// CRS as authority and code, or as WKT; null when unknown.
    pub crs: Option<String>,
}

/// The copy that was handed out, as far as whoever marked it saw it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CopyEntry {
    /// Digest of its file; null where another program writes it.
    pub file_sha256: Option<String>,
}

/// An earlier edition, as the record of a later one describes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaseEntry {
    /// Digest of the vertices of its reference.
    pub vertices_sha256: String,
    /// Layers that were marked; all when null.
    pub layers: Option<Vec<String>>,
    /// CRS given for a source that had none.
    pub srs: Option<String>,
    /// Digests of the vertices of its own bases, in the order of its record.
    pub bases: Vec<String>,
    /// Its vertices that stay in place; omitted when there are none.
    #[serde(default, skip_serializing_if = "Anchors::is_empty")]
    pub anchors: Anchors,
    /// It is cut into parts of nearly so many vertices; omitted where it is one part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part_size: Option<usize>,
}

/// How a map is divided, as a record describes it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Divided {
    /// The parts of the map and its bases.
    pub parts: Vec<PartEntry>,
    /// How the vertices of the map are divided, where they are not all free.
    pub census: Option<Census>,
}

/// A part of the map, as a record describes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartEntry {
    /// Digest of its vertices, from which its signs follow.
    pub sha256: PartDigest,
    /// Its distinct vertices.
    pub vertices: usize,
    /// Its patches.
    pub patches: usize,
}

impl FingerprintShape {
    /// Returns the shape of a fingerprint with these parameters; those of a message are not part of
    /// it. `part_size` is given where the map is cut into parts.
    pub fn new(coefficients: usize, parameters: &Parameters, part_size: Option<usize>) -> Self {
        let Parameters { amplitude_m, patch_size, tolerance_m, shape, basis, precision_crs_units, .. } =
            *parameters;
        FingerprintShape {
            amplitude_m,
            coefficients,
            patch_size,
            tolerance_m,
            shape,
            basis,
            precision_crs_units,
            part_size,
        }
    }

    /// Returns the parameters of the mark; those of a message have their defaults.
    pub fn parameters(&self) -> Parameters {
        let FingerprintShape {
            amplitude_m, patch_size, tolerance_m, shape, basis, precision_crs_units, ..
        } = *self;
        Parameters {
            amplitude_m,
            amplitude_of: AmplitudeOf::Displacement,
            patch_size,
            tolerance_m,
            shape,
            basis,
            precision_crs_units,
            ..Parameters::default()
        }
    }
}

impl FingerprintRecord {
    /// Reads a record's text and checks that its values are legal.
    ///
    /// # Errors
    /// [`Error::Record`] describes the fault.
    pub fn from_json(text: &str) -> Result<Self> {
        let read = serde_json::from_str(text).or_else(|error| with_nested_figures(text).ok_or(error));
        let record: FingerprintRecord = read.map_err(|error| Error::Record(RecordFault::Json(error)))?;
        record.check()?;
        Ok(record)
    }

    /// Returns the text of the record.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a record is JSON") + "\n"
    }

    /// Returns whether the record was made with this key.
    pub fn is_of(&self, key: &SecretKey) -> bool {
        self.key_commitment == key.commitment()
    }

    /// Returns the options that made the mark.
    pub fn options(&self) -> Options {
        Options {
            key_path: None,
            subject: Some(Subject::Recipient(self.recipient.clone())),
            parameters: self.mark.parameters(),
            coefficients: Some(self.mark.coefficients),
            layers: self.layers.clone(),
            refuses_traces: false,
            srs: self.srs.clone(),
            record_path: None,
            bases: None,
            base_references: None,
            sheets: None,
            part_size: self.mark.part_size.unwrap_or(0),
        }
    }

    /// Returns whether all vertices of the map are in one part that is named by their digest.
    pub fn is_whole(&self) -> bool {
        self.bases.is_empty() && self.anchors.is_empty() && self.mark.part_size.is_none()
    }

    /// Returns the editions that a later one rests on if this is its base, this one last.
    pub fn chain(&self) -> Vec<BaseEntry> {
        let digest = |base: &BaseEntry| base.vertices_sha256.clone();
        let own = BaseEntry {
            vertices_sha256: self.reference.vertices_sha256.clone(),
            layers: self.layers.clone(),
            srs: self.srs.clone(),
            bases: self.bases.iter().map(digest).collect(),
            anchors: self.anchors.clone(),
            part_size: self.mark.part_size,
        };
        self.bases.iter().cloned().chain([own]).collect()
    }

    fn check(&self) -> Result<()> {
        let fault = |fault| Err(Error::Record(fault));
        if self.meshmark_record != VERSION {
            return fault(RecordFault::Version { found: self.meshmark_record, expected: VERSION });
        }
        let most = PATCH_SIZE_RANGE.1;
        if !(1..most).contains(&self.mark.coefficients) {
            return fault(RecordFault::Coefficients { found: self.mark.coefficients, most: most - 1 });
        }
        let digests = [Some(&self.key_commitment), Some(&self.reference.vertices_sha256)];
        let of_files = [self.reference.file_sha256.as_ref(), self.copy.file_sha256.as_ref()];
        let of_bases = self.bases.iter().flat_map(|base| base.bases.iter().chain([&base.vertices_sha256]));
        let digests = digests.into_iter().chain(of_files).flatten().chain(of_bases);
        if let Some(bad) = digests.into_iter().find(|text| !is_digest(text)) {
            return fault(RecordFault::Digest { text: bad.clone() });
        }
        // The bases of a base come before it.
        let named = |digest: &String, number: usize| {
            self.bases[..number].iter().any(|base| base.vertices_sha256 == *digest)
        };
        let late = |(number, base): (usize, &BaseEntry)| {
            base.bases.iter().find(|digest| !named(digest, number)).cloned()
        };
        let is_own = |base: &&BaseEntry| base.vertices_sha256 == self.reference.vertices_sha256;
        if self.bases.iter().any(|base| is_own(&base)) {
            return fault(RecordFault::OwnBase);
        }
        if let Some(digest) = self.bases.iter().enumerate().find_map(late) {
            return fault(RecordFault::UnknownBase { digest });
        }
        if !self.anchors.fit(self.reference.vertices) {
            return fault(RecordFault::Anchors);
        }
        if self.mark.part_size.is_some() && !(self.bases.is_empty() && self.anchors.is_empty()) {
            return fault(RecordFault::PartsBesideOthers);
        }
        if self.mark.part_size == Some(0) || self.bases.iter().any(|base| base.part_size == Some(0)) {
            return fault(RecordFault::PartSize);
        }
        if self.parts.is_empty() {
            return fault(RecordFault::NoPart);
        }
        if self.recipient.trim().is_empty() {
            return fault(RecordFault::NoRecipient);
        }
        self.options().check().or_else(|error| fault(RecordFault::Value(Box::new(error))))
    }
}

/// Reads a record of the first version of this format, which had the figures of the distortion in an
/// object of their own.
fn with_nested_figures(text: &str) -> Option<FingerprintRecord> {
    let mut record: Map<String, Value> = serde_json::from_str(text).ok()?;
    let Value::Object(figures) = record.remove("distortion")? else { return None };
    record.extend(figures);
    serde_json::from_value(record.into()).ok()
}

fn is_digest(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|digit| matches!(digit, b'0'..=b'9' | b'a'..=b'f'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        distortion::{AngleChange, Areas, Displacement, Hausdorff, Overlaps, Validity},
        record::TopologyEntry,
        vertices::VertexTable,
    };
    use serde_json::json;

    fn record() -> FingerprintRecord {
        let vertices = VertexTable::new(vec![[0.0, 1.0]]).unwrap();
        FingerprintRecord {
            meshmark_record: VERSION,
            software: "meshmark 0.1.0".into(),
            key_commitment: SecretKey::from_bytes([7; 32]).commitment(),
            recipient: "ACME GmbH".into(),
            mark: FingerprintShape::new(256, &Parameters::of_fingerprint(), None),
            layers: None,
            srs: None,
            reference: ReferenceEntry {
                vertices: 1,
                vertices_sha256: vertices.digest(),
                file_sha256: None,
                crs: Some("EPSG:3067".into()),
            },
            copy: CopyEntry { file_sha256: Some("0f".repeat(32)) },
            parts: vec![PartEntry { sha256: PartDigest::new(&vertices), vertices: 1, patches: 1 }],
            bases: Vec::new(),
            anchors: Anchors::default(),
            census: None,
            distortion: Distortion {
                displacement: Displacement { rms_m: 0.1, p99_m: 0.2, max_m: 0.3 },
                angles: AngleChange::at(&[]),
                areas: Areas { polygons: 0, mean_change: 0.0, p99_change: 0.0, max_change: 0.0 },
                hausdorff: Hausdorff { p99_m: 0.2, max_m: 0.3 },
                validity: Validity { invalid_before: 0, invalid_after: 0, newly_invalid: 0 },
                overlaps: Overlaps { before: 0, after: 0, new: 0, new_area_m2: 0.0, new_slivers: 0 },
                topology: TopologyEntry { t_junctions: 0, attenuated_vertices: 0 },
            },
        }
    }

    fn changed(pointer: &str, value: Value) -> String {
        let mut json: Value = serde_json::from_str(&record().to_json()).unwrap();
        let (object, field) = pointer.rsplit_once('/').unwrap();
        json.pointer_mut(object).unwrap()[field] = value;
        json.to_string()
    }

    #[test]
    fn a_record_reads_back_belongs_to_its_key_and_has_the_parameters_of_its_mark() {
        let read = FingerprintRecord::from_json(&record().to_json()).unwrap();
        assert_eq!(read, record());
        assert!(read.is_of(&SecretKey::from_bytes([7; 32])) && !read.is_of(&SecretKey::from_bytes([8; 32])));
        assert_eq!(read.mark.parameters(), Parameters::of_fingerprint());
    }

    #[test]
    fn a_record_with_the_figures_in_an_object_of_their_own_is_read() {
        let mut json: Map<String, Value> = serde_json::from_str(&record().to_json()).unwrap();
        let names = ["displacement", "angles", "areas", "hausdorff", "validity", "overlaps", "topology"];
        let figures: Map<String, Value> =
            names.map(|name| (name.to_string(), json.remove(name).unwrap())).into_iter().collect();
        json.insert("distortion".into(), figures.into());
        let text = Value::from(json).to_string();
        assert_eq!(FingerprintRecord::from_json(&text).unwrap(), record());
    }

    #[test]
    fn later_versions_may_add_fields_but_none_that_shapes_the_mark() {
        let signed = FingerprintRecord::from_json(&changed("/signature", json!({ "ed25519": "00" })));
        assert_eq!(signed.unwrap(), record());
        for pointer in ["/mark/twist", "/parts/0/offset", "/reference/edition", "/topology/colour"] {
            let error = FingerprintRecord::from_json(&changed(pointer, json!(1))).unwrap_err().to_string();
            assert!(error.contains("unknown field"), "{pointer}: {error}");
        }
    }

    fn base(byte: &str, bases: &[&str]) -> Value {
        let bases: Vec<String> = bases.iter().map(|byte| byte.repeat(32)).collect();
        json!({ "vertices_sha256": byte.repeat(32), "layers": null, "srs": null, "bases": bases })
    }

    #[test]
    fn a_chain_ends_with_the_edition_and_names_its_bases() {
        let text = changed("/bases", json!([base("ab", &[]), base("cd", &["ab"])]));
        let record = FingerprintRecord::from_json(&text).unwrap();
        let chain = record.chain();
        assert_eq!(chain[..2], record.bases);
        assert_eq!(chain[2].vertices_sha256, record.reference.vertices_sha256);
        assert_eq!(chain[2].bases, ["ab", "cd"].map(|byte| byte.repeat(32)));
        for field in ["bases", "anchors", "census"] {
            assert!(!self::record().to_json().contains(field), "records of one edition are as before");
        }
    }

    #[test]
    fn a_value_that_no_marking_writes_is_refused_by_its_name() {
        for (pointer, value, words) in [
            ("/meshmark_record", json!(3), "version 3 instead of 2"),
            ("/mark/coefficients", json!(0), "0 coefficients"),
            ("/mark/coefficients", json!(4096), "4096 coefficients"),
            ("/mark/amplitude_m", json!(0.0), "AMPLITUDE=0"),
            ("/mark/patch_size", json!(3), "PATCH_SIZE=3"),
            ("/key_commitment", json!("434471506306423b"), "\"434471506306423b\" is no digest"),
            ("/reference/vertices_sha256", json!("0F".repeat(32)), "is no digest"),
            ("/copy/file_sha256", json!("?"), "\"?\" is no digest"),
            ("/parts", json!([]), "no part"),
            ("/parts/0/sha256", json!("00"), "64 hexadecimal digits"),
            ("/bases", json!([base("ab", &[]), base("?", &[])]), "is no digest"),
            ("/bases", json!([base("cd", &["ab"]), base("ab", &[])]), "not listed before it"),
            ("/anchors", json!("1"), "no vertices of its reference"),
            ("/recipient", json!(" "), "no recipient"),
            ("/recipient", json!(null), "invalid type: null"),
        ] {
            let error = FingerprintRecord::from_json(&changed(pointer, value)).unwrap_err().to_string();
            assert!(error.contains("malformed record") && error.contains(words), "{pointer}: {error}");
        }
    }
}
