//! The record of a marking, which an auditor needs besides the key and the reference.

use crate::{
    Error, Result,
    distortion::{AngleChange, Areas, Displacement, Hausdorff, Overlaps, Validity},
    error::RecordFault,
    message::Message,
    options::{Options, Parameters, Subject},
};
use serde::{Deserialize, Serialize};

/// The version this program writes and reads.
pub const VERSION: u32 = 1;

/// A record. Its fields are the option names in lower case, with their unit. It holds neither the
/// secret nor the time, so that equal input makes an equal record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// Version of this format.
    pub meshmark_record: u32,
    /// Version of the program that marked.
    pub software: String,
    /// Public id of the key.
    pub key_id: String,
    /// The recipient, when the message was made from one.
    pub recipient: Option<String>,
    /// The message, hexadecimal.
    pub message: String,
    /// Whether the key whitened the message before it was coded; omitted when it did not, as for
    /// recipients.
    #[serde(default, skip_serializing_if = "is_false")]
    pub whitened: bool,
    /// The numbers that shaped the mark, fields of their own in the JSON.
    #[serde(flatten)]
    pub parameters: Parameters,
    /// Layers that were marked; all when null.
    pub layers: Option<Vec<String>>,
    /// CRS given for a source that had none.
    pub srs: Option<String>,
    /// The reference map.
    pub reference: Reference,
    /// The displacement of its vertices.
    pub displacement: Displacement,
    /// The change of the angles at its corners.
    pub angles: AngleChange,
    /// The change of the areas of its polygons.
    pub areas: Areas,
    /// The Hausdorff distances between its features before and after.
    pub hausdorff: Hausdorff,
    /// The numbers of invalid features.
    pub validity: Validity,
    /// The numbers of overlapping polygons.
    pub overlaps: Overlaps,
    /// The effort of keeping the topology.
    pub topology: TopologyEntry,
}

/// The distortion of a map by marking.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)] // the names are those of the record
pub struct Distortion {
    pub displacement: Displacement,
    pub angles: AngleChange,
    pub areas: Areas,
    pub hausdorff: Hausdorff,
    pub validity: Validity,
    pub overlaps: Overlaps,
    pub topology: TopologyEntry,
}

/// The reference map, as a record describes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Distinct vertices of the marked layers.
    pub vertices: usize,
    /// Patches of the map.
    pub patches: usize,
    /// Digest of the vertices, see [`crate::vertices::VertexTable::digest`].
    pub vertices_sha256: String,
    /// CRS as authority and code, or as WKT; null when unknown.
    pub crs: Option<String>,
}

/// The topology of the map, as a record describes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TopologyEntry {
    /// Vertices that lie on segments of other features and moved with them.
    pub t_junctions: usize,
    /// Vertices that moved differently from the mark, so that no new crossing appears.
    pub attenuated_vertices: usize,
}

fn illegal(value: Error) -> Error {
    Error::Record(RecordFault::Value(Box::new(value)))
}

fn is_false(value: &bool) -> bool {
    !value
}

impl Record {
    /// Reads a record's text and checks that its values are legal.
    ///
    /// # Errors
    /// [`Error::Record`] describes the fault.
    pub fn from_json(text: &str) -> Result<Self> {
        let record: Record =
            serde_json::from_str(text).map_err(|error| Error::Record(RecordFault::Json(error)))?;
        if record.meshmark_record != VERSION {
            let found = record.meshmark_record;
            return Err(Error::Record(RecordFault::Version { found, expected: VERSION }));
        }
        record.options()?;
        let bits = record.message()?.len();
        record.parameters.code.channel_bits(bits).map_err(illegal)?;
        Ok(record)
    }

    /// Returns the distortion of the map.
    pub fn distortion(&self) -> Distortion {
        Distortion {
            displacement: self.displacement,
            angles: self.angles,
            areas: self.areas,
            hausdorff: self.hausdorff,
            validity: self.validity,
            overlaps: self.overlaps,
            topology: self.topology,
        }
    }

    /// Returns the text of the record.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a record is JSON") + "\n"
    }

    /// Returns the options that made the mark.
    ///
    /// # Errors
    /// Returns the errors of [`Record::subject`], and [`Error::Record`] when a value is out of
    /// range.
    pub fn options(&self) -> Result<Options> {
        let options = Options {
            key_path: None,
            subject: Some(self.subject()?),
            parameters: self.parameters.clone(),
            coefficients: None,
            layers: self.layers.clone(),
            refuses_traces: false,
            srs: self.srs.clone(),
            record_path: None,
            bases: None,
            base_references: None,
            sheets: None,
            part_size: 0,
        };
        options.check().map_err(illegal)?;
        Ok(options)
    }

    /// Returns the message that was embedded.
    ///
    /// # Errors
    /// [`Error::Record`] when it is not hexadecimal.
    pub fn message(&self) -> Result<Message> {
        Message::from_hex(&self.message).map_err(illegal)
    }

    /// Returns the subject of the mark.
    ///
    /// # Errors
    /// Returns the errors of [`Record::message`], and [`Error::Record`] for a recipient with a
    /// whitened message.
    pub fn subject(&self) -> Result<Subject> {
        match &self.recipient {
            Some(_) if self.whitened => Err(Error::Record(RecordFault::WhitenedRecipient)),
            Some(text) => Ok(Subject::Recipient(text.clone())),
            None if self.whitened => Ok(Subject::Message(self.message()?)),
            None => Ok(Subject::Unwhitened(self.message()?)),
        }
    }
}
