//! GDAL's native data, the members of a GeoJSON file beyond GDAL's own model: they are passed on
//! without unmarked positions.

use crate::{
    ffi_errors::guarded,
    ffi_features::{Feature, FeatureRef},
    ffi_text::{c_string, strings, text},
};
use gdal_sys::{OGRFeatureH, OGRFieldSubType};
use meshmark_dataset::geojson_text::{MEDIA_TYPE, without_places};
use std::{
    ffi::{CStr, CString, c_char},
    ptr,
};

/// The metadata domain of a layer, and the name of the item and of the layer creation option that
/// hold native data.
pub const NATIVE_DATA: &str = "NATIVE_DATA";

/// Returns the value of a NAME=VALUE pair of a layer's native data without positions; `None` when
/// nothing is left.
pub fn item_without_places(name: &str, value: &str) -> Option<String> {
    if !name.eq_ignore_ascii_case(NATIVE_DATA) {
        return Some(value.into());
    }
    without_places(value.as_bytes(), false)
        .map(|kept| String::from_utf8(kept).expect("only ASCII was left out"))
}

impl FeatureRef<'_> {
    /// Returns its native data without places; `None` when nothing is left.
    pub fn native_data(&self) -> Option<CString> {
        // SAFETY: the feature is there; both texts are null or C strings, and are copied.
        let data = unsafe {
            let (data, kind) = (
                gdal_sys::OGR_F_GetNativeData(self.handle()),
                gdal_sys::OGR_F_GetNativeMediaType(self.handle()),
            );
            if data.is_null() || !text(kind).eq_ignore_ascii_case(MEDIA_TYPE) {
                return None;
            }
            without_places(CStr::from_ptr(data).to_bytes(), self.has_json_fields())?
        };
        Some(CString::new(data).expect("it was a C string"))
    }

    /// Returns whether a field of it holds JSON text.
    fn has_json_fields(&self) -> bool {
        // SAFETY: the feature is there, and has a field of every number below their count.
        unsafe {
            (0..gdal_sys::OGR_F_GetFieldCount(self.handle())).any(|number| {
                let field = gdal_sys::OGR_F_GetFieldDefnRef(self.handle(), number);
                gdal_sys::OGR_Fld_GetSubType(field) == OGRFieldSubType::OFSTJSON
            })
        }
    }
}

/// Returns the foreign members of a feature that GDAL read from GeoJSON.
pub fn foreign_members(feature: &gdal::vector::Feature) -> Option<String> {
    // SAFETY: the feature outlives the call.
    let data = unsafe { FeatureRef::new(feature.c_feature()) }.native_data();
    data.map(|data| data.to_string_lossy().into_owned())
}

impl Feature {
    /// Sets its native data.
    pub fn set_native_data(&self, data: &CStr) {
        // SAFETY: the feature is ours, and both texts are copied.
        unsafe {
            gdal_sys::OGR_F_SetNativeData(self.handle(), data.as_ptr());
            gdal_sys::OGR_F_SetNativeMediaType(self.handle(), c_string(MEDIA_TYPE).as_ptr());
        }
    }
}

/// Removes places from the native data of a feature that is handed on.
#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_clear_native_data(feature: OGRFeatureH) {
    guarded((), || {
        // SAFETY: the shim gives a feature, which stays during the call.
        let data = unsafe { FeatureRef::new(feature) }.native_data();
        let text = data.as_ref().map_or(ptr::null(), |text| text.as_ptr());
        // SAFETY: as above; the text is null or a C string, which is copied.
        unsafe { gdal_sys::OGR_F_SetNativeData(feature, text) };
    });
}

/// Returns the native data of a layer, as a list of metadata, without positions; the caller frees
/// it.
///
/// # Safety
/// `metadata` is null or an array of C strings that ends in null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn meshmark_native_data(metadata: *const *const c_char) -> *mut *mut c_char {
    guarded(ptr::null_mut(), || {
        // SAFETY: the shim gives a list of C strings; GDAL copies what it is given.
        unsafe {
            let items = strings(metadata);
            let items = items.iter().filter_map(|item| item.split_once('='));
            let kept = items.filter_map(|(name, value)| Some((name, item_without_places(name, value)?)));
            kept.fold(ptr::null_mut(), |list, (name, value)| {
                gdal_sys::CSLAddString(list, c_string(&format!("{name}={value}")).as_ptr())
            })
        }
    })
}
