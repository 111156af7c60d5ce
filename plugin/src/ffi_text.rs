//! Conversions of texts for GDAL's C API.

use std::ffi::{CStr, CString, c_char};

/// Returns the strings of a GDAL list.
///
/// # Safety
/// `list` is null or an array of C strings that ends in null.
pub unsafe fn strings(list: *const *const c_char) -> Vec<String> {
    if list.is_null() {
        return Vec::new();
    }
    // SAFETY: every element before the null is a C string.
    unsafe { (0..).map(|i| *list.add(i)).take_while(|s| !s.is_null()).map(|s| text(s)).collect() }
}

/// Returns the text of a C string; empty for null.
///
/// # Safety
/// `string` is null or a C string.
pub unsafe fn text(string: *const c_char) -> String {
    if string.is_null() {
        return String::new();
    }
    // SAFETY: it is a C string.
    unsafe { CStr::from_ptr(string) }.to_string_lossy().into_owned()
}

/// Converts a text that came from a C string.
pub fn c_string(text: &str) -> CString {
    CString::new(text).expect("it was a C string")
}
