//! The record of a marking: what an auditor needs besides the key and the reference.

use crate::{
    Error, Result,
    code::Code,
    distortion::{AngleChange, Areas, Displacement, Hausdorff, Overlaps, Validity},
    message::Message,
    options::{Laplacian, Parameters, Rigidity, Subject},
};
use serde::{Deserialize, Serialize};

/// The version this program writes and reads.
pub const VERSION: u32 = 1;

/// A record. Field names are the option names in lower case, with their unit; it never holds the
/// secret and no time, so that equal input makes an equal record.
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
    /// Whether the key whitened it before it was coded; left out where it did not, as of recipients.
    #[serde(default, skip_serializing_if = "is_false")]
    pub whitened: bool,
    /// α.
    pub amplitude_m: f64,
    /// How the message becomes the channel bits.
    pub code: Code,
    /// c.
    pub chip_rate: usize,
    /// d.
    pub patch_size: usize,
    /// No vertex moved further.
    pub tolerance_m: f64,
    /// What moved as one.
    pub shape: Rigidity,
    /// Which functions carry the mark.
    pub basis: Laplacian,
    /// Output grid in CRS units.
    pub precision_crs_units: Option<f64>,
    /// Layers that were marked; all when null.
    pub layers: Option<Vec<String>>,
    /// CRS given for a source that had none.
    pub srs: Option<String>,
    /// The reference map.
    pub reference: Reference,
    /// How far its vertices moved.
    pub displacement: Displacement,
    /// How much the angles at its corners changed.
    pub angles: AngleChange,
    /// How much the areas of its polygons changed.
    pub areas: Areas,
    /// How far its features are from where they were.
    pub hausdorff: Hausdorff,
    /// How many of them are invalid.
    pub validity: Validity,
    /// How many of its polygons overlap.
    pub overlaps: Overlaps,
    /// What keeping the topology took.
    pub topology: TopologyEntry,
}

/// What marking did to a map.
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// What a record says about the reference map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Distinct vertices of the marked layers.
    pub vertices: usize,
    /// Patches they were cut into.
    pub patches: usize,
    /// Digest of the vertices, see [`crate::vertices::VertexTable::digest`].
    pub vertices_sha256: String,
    /// CRS as authority and code, or as WKT; null when unknown.
    pub crs: Option<String>,
}

/// What a record says about the topology of the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TopologyEntry {
    /// Vertices that lie on segments of other features and moved with them.
    pub t_junctions: usize,
    /// Vertices that moved otherwise than the mark wanted, so that nothing crosses that did not.
    pub attenuated_vertices: usize,
}

fn is_false(value: &bool) -> bool {
    !value
}

impl Record {
    /// Reads a record's text and checks that its values are legal.
    ///
    /// # Errors
    /// [`Error::Record`] says what is wrong with it.
    pub fn from_json(text: &str) -> Result<Self> {
        let record: Record = serde_json::from_str(text).map_err(|error| {
            // serde goes on with the list of all fields there are.
            Error::Record(error.to_string().split(", expected one of").next().unwrap_or_default().into())
        })?;
        if record.meshmark_record != VERSION {
            let found = record.meshmark_record;
            return Err(Error::Record(format!("version {found} instead of {VERSION}")));
        }
        record.parameters()?;
        record.subject()?;
        let bits = record.message()?.len();
        record.code.channel_bits(bits).map_err(|e| Error::Record(e.to_string()))?;
        Ok(record)
    }

    /// What it says of the map's distortion.
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

    /// The text of the record.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a record is JSON") + "\n"
    }

    /// The parameters that shaped the mark.
    ///
    /// # Errors
    /// [`Error::Record`] when one of them is out of range.
    pub fn parameters(&self) -> Result<Parameters> {
        let values = [
            ("SHAPE", self.shape.name().into()),
            ("BASIS", self.basis.name().into()),
            ("CODE", self.code.name()),
            ("AMPLITUDE", self.amplitude_m.to_string()),
            ("CHIP_RATE", self.chip_rate.to_string()),
            ("PATCH_SIZE", self.patch_size.to_string()),
            ("TOLERANCE", self.tolerance_m.to_string()),
        ];
        let precision = self.precision_crs_units.map(|p| ("PRECISION", p.to_string()));
        let pairs = values.iter().chain(&precision).map(|(name, value)| (*name, value.as_str()));
        let options = crate::options::Options::parse(pairs).map_err(|e| Error::Record(e.to_string()))?;
        Ok(options.parameters)
    }

    /// The message that was embedded.
    ///
    /// # Errors
    /// [`Error::Record`] when it is not hexadecimal.
    pub fn message(&self) -> Result<Message> {
        Message::from_hex(&self.message).map_err(|e| Error::Record(e.to_string()))
    }

    /// What the mark says.
    ///
    /// # Errors
    /// As [`Record::message`], and when it has a recipient and a whitened message.
    pub fn subject(&self) -> Result<Subject> {
        match &self.recipient {
            Some(_) if self.whitened => Err(Error::Record(
                "it has a recipient and a whitened message, of which only one can be".into(),
            )),
            Some(text) => Ok(Subject::Recipient(text.clone())),
            None if self.whitened => Ok(Subject::Message(self.message()?)),
            None => Ok(Subject::Unwhitened(self.message()?)),
        }
    }
}
