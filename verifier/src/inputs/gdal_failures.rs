//! GDAL's failure messages: kept, and included in the messages of this crate.

use std::cell::RefCell;

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

/// Returns GDAL's last error message on this thread since [`forget_failure`].
pub(crate) fn last_failure() -> Option<String> {
    LAST_FAILURE.with_borrow(Clone::clone)
}

/// Discards the failures of earlier operations.
pub(crate) fn forget_failure() {
    LAST_FAILURE.set(None);
}
