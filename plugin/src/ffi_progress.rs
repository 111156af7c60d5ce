//! The progress bar of GDAL.

use std::ptr;

/// Draws the bar up to this share of a job on stdout; 1 ends it.
pub fn draw(share: f64) {
    // SAFETY: the message may be null, and the bar ignores the last argument.
    unsafe { gdal_sys::GDALTermProgress(share, ptr::null(), ptr::null_mut()) };
}
