//! GDAL's failure messages: kept, and included in the messages of this crate.

use gdal::errors::GdalError;
use std::{cell::RefCell, error, fmt};

thread_local! {
    /// Keeps GDAL's last error message on this thread.
    static LAST_FAILURE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Keeps GDAL from printing, and keeps its messages for this crate. Call it once, before any other
/// use of GDAL.
pub fn quieten_gdal() {
    gdal::config::set_error_handler(|kind, _, message| {
        if matches!(kind, gdal::errors::CplErrType::Failure | gdal::errors::CplErrType::Fatal) {
            LAST_FAILURE.set(Some(message.to_string()));
        }
    });
}

/// A failure of a function of GDAL. Its message on this thread is more exact than the error of the
/// function.
#[derive(Debug)]
pub struct GdalFailure {
    message: Option<String>,
    source: Box<GdalError>,
}

impl GdalFailure {
    /// Adds the last message since [`forget_failure`].
    pub(crate) fn new(source: GdalError) -> Self {
        GdalFailure { message: last_failure(), source: Box::new(source) }
    }
}

impl fmt::Display for GdalFailure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.message {
            Some(message) => f.write_str(message),
            None => self.source.fmt(f),
        }
    }
}

impl error::Error for GdalFailure {
    fn source(&self) -> Option<&(dyn error::Error + 'static)> {
        Some(&*self.source)
    }
}

/// Returns GDAL's last error message on this thread since the last call or [`forget_failure`].
pub(crate) fn last_failure() -> Option<String> {
    LAST_FAILURE.take()
}

/// Discards the failures of earlier operations.
pub(crate) fn forget_failure() {
    LAST_FAILURE.set(None);
}
