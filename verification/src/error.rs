//! The errors of what does not belong together. Every message names the input and the remedy.

use meshmark_core::{counted, options::Spelling};
use meshmark_marking as marking;
use std::fmt;

/// The result of every fallible function of this crate that reads no map.
pub type Result<T> = std::result::Result<T, Error>;

/// An error that ends a verification or a comparison. References have the names of
/// [`Maps::name`](crate::Maps::name).
#[derive(Debug)]
#[allow(missing_docs)] // the messages are the documentation
pub enum Error {
    Core(meshmark_core::Error),
    Unfit { reference: Option<String>, source: Box<marking::Error> },
    Contradiction { option: String, value: String },
    PaperOfFingerprint,
    OtherKey { made_with: String, given: String },
    OtherCommitment { given: String },
    OtherParts { parts: usize },
    OtherPartsOfBases { parts: usize },
    OtherMessage,
    OtherReference { reference: Option<String>, recorded: usize, vertices: usize },
    NoReferenceOfRecord { references: usize },
    SeveralReferences,
    NoRecord,
    OtherLayers { reference: Vec<String>, marked: Vec<String> },
    OtherCount { layer: Option<String>, reference: usize, marked: usize },
    OtherVertices { layer: String, fid: String, other: String },
    OtherCrs { own: String, other: String },
}

impl From<meshmark_core::Error> for Error {
    fn from(error: meshmark_core::Error) -> Self {
        Error::Core(error)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.text(Spelling::Flag))
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Error::Core(source) => Some(source),
            Error::Unfit { source, .. } => Some(&**source),
            _ => None,
        }
    }
}

impl Error {
    /// Returns whether a record does not belong to a key or a reference.
    pub fn is_of_others(&self) -> bool {
        matches!(
            self,
            Error::OtherKey { .. }
                | Error::OtherCommitment { .. }
                | Error::OtherParts { .. }
                | Error::OtherPartsOfBases { .. }
                | Error::OtherMessage
                | Error::OtherReference { .. }
                | Error::NoReferenceOfRecord { .. }
        )
    }

    /// Returns the message, with options spelled as in the user's front end.
    pub fn text(&self, spelling: Spelling) -> String {
        match self {
            Error::Core(error) => error.text(spelling),
            Error::Unfit { reference: Some(name), source } => {
                format!("the reference {name}: {}", source.text(spelling))
            }
            Error::Unfit { reference: None, source } => format!("the reference: {}", source.text(spelling)),
            Error::Contradiction { option, value } => {
                format!("{} contradicts the record: leave one of them out", spelling.value(option, value))
            }
            Error::PaperOfFingerprint => format!(
                "the demodulator of the paper reads messages, and the mark is the fingerprint of a recipient: leave {} out",
                spelling.name("DEMODULATOR")
            ),
            Error::OtherKey { made_with, given } => format!(
                "the record was made with key {made_with}, and this is key {given}: give the key it was made with"
            ),
            Error::OtherCommitment { given } => format!(
                "the record was made with another key than this one, {given}: give the key it was made with"
            ),
            Error::OtherParts { parts } => format!(
                "the record names {} that are not the vertices of its reference: verify with the version of meshmark that \
                 wrote it",
                counted(*parts, "part")
            ),
            Error::OtherPartsOfBases { parts } => format!(
                "the {} of the record are not those of its reference with its bases, anchors and size of parts: give the files \
                 of all editions and the record, unchanged, or verify with the version of meshmark that wrote it",
                counted(*parts, "part")
            ),
            Error::OtherMessage => {
                "the record's message is not that of its recipient under this key: the record was changed".into()
            }
            Error::OtherReference { reference, recorded, vertices } => format!(
                "the record was made from another reference ({recorded} vertices) than {} ({vertices} vertices): give the \
                 file that was marked, unchanged",
                this_one(reference)
            ),
            Error::NoReferenceOfRecord { references } => format!(
                "the record was made from none of the {references} references given: give the file that was marked, \
                 unchanged"
            ),
            Error::SeveralReferences => format!(
                "there are several references, and no record to choose one by: give {} or {}, or one {}",
                spelling.name("RECORD"),
                spelling.name("RECORDS"),
                spelling.name("REFERENCE")
            ),
            Error::NoRecord => {
                "none of the records is of this key and this reference: give those of the copies that were made of it"
                    .into()
            }
            Error::OtherLayers { reference, marked } => format!(
                "the maps have different layers ({}): compare a map with the copy that was marked from it, and give \
                 counterparts the same name",
                own_layers(reference, marked)
            ),
            Error::OtherCount { layer, reference, marked } => {
                let of_layer = layer.as_ref().map_or(String::new(), |layer| format!(" in layer \"{layer}\""));
                format!(
                    "the reference has {}{of_layer} and the marked map {marked}: compare a map with the copy that was marked \
                     from it, before anything is removed",
                    counted(*reference, "geometry")
                )
            }
            Error::OtherVertices { layer, fid, other } => format!(
                "layer \"{layer}\", feature {fid} of the reference does not have the vertices of its counterpart in the \
                 marked map (layer \"{other}\"): features correspond by their order"
            ),
            Error::OtherCrs { own, other } => format!(
                "the marked map is in {other} and the reference in {own}: compare the copy that was marked, before it is \
                 brought into another CRS"
            ),
        }
    }
}

/// Returns which layers one map alone has.
fn own_layers(reference: &[String], marked: &[String]) -> String {
    let of_map = |(map, layers): (&str, &[String])| {
        let names: Vec<String> = layers.iter().map(|name| format!("\"{name}\"")).collect();
        (!names.is_empty()).then(|| format!("only {map} has {}", names.join(", ")))
    };
    let each = [("the reference", reference), ("the marked map", marked)].into_iter().filter_map(of_map);
    each.collect::<Vec<_>>().join(", ")
}

/// Returns what a message about a reference calls it.
pub(crate) fn this_one(name: &Option<String>) -> &str {
    name.as_deref().unwrap_or("this one")
}
