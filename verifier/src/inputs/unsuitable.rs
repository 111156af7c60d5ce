//! The reasons why a suspect is not read. Each completes the sentence "the suspect …".

use super::gdal_failures::GdalFailure;
use std::io;

/// A reason for which a suspect has to be converted.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // the messages are the documentation
pub enum Unsuitable {
    #[error("is {name}, which is not read as a suspect")]
    Format { name: &'static str },
    #[error("is {name}, and this GDAL has no {driver} driver")]
    NoDriver { name: &'static str, driver: &'static str },
    #[error("is a compressed SVG file")]
    CompressedDrawing,
    #[error("is a compressed file")]
    Compressed,
    #[error("cannot be opened as a zip file ({source})")]
    Zip { source: GdalFailure },
    #[error("cannot be opened: {source} (a suspect may be SVG, {known})")]
    Unopened { source: GdalFailure, known: String },
    #[error(
        "has no column that is known to hold coordinates (WKT, x and y, lon and lat, easting and northing)"
    )]
    NoCoordinates,
    #[error(transparent)]
    Drawing(#[from] BadDrawing),
}

/// A reason for which a drawing is not read.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // the messages are the documentation
pub enum BadDrawing {
    #[error("cannot be read ({0})")]
    Unread(#[from] io::Error),
    #[error("is not encoded as UTF-8")]
    NotUtf8,
    #[error("is no valid XML ({0})")]
    Xml(#[from] roxmltree::Error),
    #[error("{0}")]
    Refused(String),
}

impl From<String> for BadDrawing {
    fn from(reason: String) -> Self {
        BadDrawing::Refused(reason)
    }
}

impl From<&str> for BadDrawing {
    fn from(reason: &str) -> Self {
        BadDrawing::Refused(reason.into())
    }
}
