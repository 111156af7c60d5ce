//! The request of `meshmark distribute`.

use meshmark_core::{key::SecretKey, options::Options};
use std::path::PathBuf;

/// The map to distribute, its recipients, and the marking options.
pub struct DistributeRequest {
    /// The secret key.
    pub key: SecretKey,
    /// The marking options, without a subject.
    pub options: Options,
    /// The map.
    pub map: PathBuf,
    /// The list of recipients.
    pub recipients: PathBuf,
    /// The folder of the copies.
    pub folder: PathBuf,
    /// GDAL's short name of the format of the copies.
    pub format: String,
}
