//! What `meshmark distribute` is asked for.

use meshmark_core::{key::SecretKey, options::Options};
use std::path::PathBuf;

/// What to distribute, to whom, and how it is marked.
pub struct DistributeRequest {
    /// The key.
    pub key: SecretKey,
    /// The marking options, without a subject.
    pub options: Options,
    /// The map.
    pub map: PathBuf,
    /// The list of recipients.
    pub recipients: PathBuf,
    /// Where the copies go.
    pub folder: PathBuf,
    /// GDAL's short name of their format.
    pub format: String,
}
