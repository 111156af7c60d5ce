//! What GDAL says of a failure: kept, and part of our own messages.

use std::cell::RefCell;

thread_local! {
    /// GDAL's last error message on this thread, kept instead of printed.
    static LAST_FAILURE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Keeps GDAL from printing; its messages become part of ours. Call once, before anything else.
pub fn quieten_gdal() {
    gdal::config::set_error_handler(|kind, _, message| {
        if matches!(kind, gdal::errors::CplErrType::Failure | gdal::errors::CplErrType::Fatal) {
            LAST_FAILURE.set(Some(message.to_string()));
        }
    });
}

/// GDAL's last error message on this thread since [`forget_failure`].
pub(crate) fn last_failure() -> Option<String> {
    LAST_FAILURE.with_borrow(Clone::clone)
}

/// What failed before does not concern what comes now.
pub(crate) fn forget_failure() {
    LAST_FAILURE.set(None);
}
