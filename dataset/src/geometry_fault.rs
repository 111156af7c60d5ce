//! The reason why a geometry cannot be read.

use meshmark_marking::wkb::WkbError;

/// The reason why a geometry cannot be read.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
#[allow(missing_docs)] // the messages are the documentation
pub enum GeometryFault {
    Gdal(Box<gdal::errors::GdalError>),
    Wkb(#[from] WkbError),
}

impl From<gdal::errors::GdalError> for GeometryFault {
    fn from(error: gdal::errors::GdalError) -> Self {
        GeometryFault::Gdal(Box::new(error))
    }
}
