//! Features, by GDAL's C API: ids, styles and values that are read or set.

use crate::{
    error::{Error, Result},
    ffi_errors::{Collector, check},
    ffi_text::{c_string, text},
};
use gdal_sys::OGRFeatureH;
use std::{
    ffi::{CStr, CString, c_char, c_int},
    marker::PhantomData,
};

unsafe extern "C" {
    /// Returns a list field as a JSON array; the caller frees it.
    fn meshmark_shim_list_as_json(feature: OGRFeatureH, field: c_int) -> *mut c_char;
}

/// A feature that this library does not own.
#[derive(Clone, Copy)]
pub struct FeatureRef<'a>(OGRFeatureH, PhantomData<&'a ()>);

impl FeatureRef<'_> {
    /// # Safety
    /// The feature exists while this lives.
    pub unsafe fn new(feature: OGRFeatureH) -> Self {
        FeatureRef(feature, PhantomData)
    }

    /// Returns the handle for GDAL, which is valid while this lives.
    pub fn handle(&self) -> OGRFeatureH {
        self.0
    }

    /// Returns its id, when it has one.
    pub fn id(&self) -> Option<i64> {
        // SAFETY: the feature is there.
        Some(unsafe { gdal_sys::OGR_F_GetFID(self.0) }).filter(|&id| id != NULL_ID)
    }

    /// Sets the id under which it was written.
    pub fn set_id(&self, id: i64) {
        // SAFETY: the feature is there.
        unsafe { gdal_sys::OGR_F_SetFID(self.0, id) };
    }

    /// Returns how many fields it has.
    pub fn field_count(&self) -> usize {
        // SAFETY: the feature is there.
        unsafe { gdal_sys::OGR_F_GetFieldCount(self.0) as usize }
    }

    /// Returns its style, if it has one.
    pub fn style(&self) -> Option<String> {
        // SAFETY: the feature is there; the style is null or a C string.
        Some(unsafe { text(gdal_sys::OGR_F_GetStyleString(self.0)) }).filter(|style| !style.is_empty())
    }

    /// Returns whether a field is unset, which differs from null.
    pub fn is_unset(&self, field: usize) -> bool {
        // SAFETY: the feature is there, and the field is one of its own.
        unsafe { gdal_sys::OGR_F_IsFieldSet(self.0, field as c_int) == 0 }
    }

    /// Returns the number in a field; zero when there is none.
    pub fn real(&self, field: usize) -> f64 {
        // SAFETY: the feature is there, and GDAL checks the index.
        unsafe { gdal_sys::OGR_F_GetFieldAsDouble(self.0, field as c_int) }
    }

    /// Returns the bytes of a field's text, in any encoding.
    pub fn bytes(&self, field: usize) -> Vec<u8> {
        // SAFETY: the feature is there, GDAL checks the index, and the value is a C string that is
        // copied.
        unsafe {
            CStr::from_ptr(gdal_sys::OGR_F_GetFieldAsString(self.0, field as c_int)).to_bytes().to_vec()
        }
    }

    /// Returns the bytes of a list as JSON; none when it is null or unset.
    pub fn list(&self, field: usize) -> Vec<u8> {
        self.json(field).map(CString::into_bytes).unwrap_or_default()
    }

    /// Returns a list as JSON, in any encoding; `None` when it is null or unset.
    fn json(&self, field: usize) -> Option<CString> {
        // SAFETY: the feature is there, and GDAL checks the index; the text is ours to free.
        unsafe {
            let json = meshmark_shim_list_as_json(self.0, field as c_int);
            let text = (!json.is_null()).then(|| CStr::from_ptr(json).to_owned());
            gdal_sys::VSIFree(json.cast());
            text
        }
    }

    /// Returns the value of a text field; empty when it has none.
    pub fn text(&self, field: usize) -> String {
        // SAFETY: the feature is there, GDAL checks the index, and the value is a C string.
        unsafe { text(gdal_sys::OGR_F_GetFieldAsString(self.0, field as c_int)) }
    }
}

/// GDAL's id of a feature that has none.
pub const NULL_ID: i64 = -1;

/// A feature that this library owns.
pub struct Feature(OGRFeatureH);

impl Feature {
    /// # Safety
    /// The feature is the caller's to destroy.
    pub unsafe fn from_handle(feature: OGRFeatureH) -> Self {
        Feature(feature)
    }

    /// Borrows the feature for reading.
    pub fn borrow(&self) -> FeatureRef<'_> {
        FeatureRef(self.0, PhantomData)
    }

    /// Copies geometry and attributes of another feature. `map` holds for each field of the other
    /// feature the number of the field here, or none; fields in `lists` become JSON.
    pub fn copy_from(&self, other: FeatureRef, map: &[Option<usize>], lists: &[usize]) -> Result<()> {
        if map.len() != other.field_count() {
            let reason = format!("it has {} fields, its layer {}", other.field_count(), map.len());
            return Err(Error::Writing { what: "copying its attributes".into(), reason });
        }
        let collector = Collector::new();
        let to = |(i, to): (usize, &Option<usize>)| match to {
            Some(to) if !lists.contains(&i) => *to as c_int,
            _ => -1,
        };
        let indices: Vec<c_int> = map.iter().enumerate().map(to).collect();
        // SAFETY: both features are there, and the map is as long as the fields of the other.
        let error = unsafe { gdal_sys::OGR_F_SetFromWithMap(self.0, other.0, 0, indices.as_ptr()) };
        check(error, || "copying its attributes".into(), &collector)?;
        for &list in lists {
            if let Some((to, json)) = map[list].zip(other.json(list)) {
                self.set_c_text(to, &json);
            }
        }
        Ok(())
    }

    /// Sets its id.
    pub fn set_id(&self, id: i64) {
        self.borrow().set_id(id);
    }

    /// Sets its style.
    pub fn set_style(&self, style: &str) {
        // SAFETY: the feature is ours, and the text is copied.
        unsafe { gdal_sys::OGR_F_SetStyleString(self.0, c_string(style).as_ptr()) };
    }

    /// Sets a field to a text.
    pub fn set_text(&self, field: usize, value: &str) {
        self.set_c_text(field, &c_string(value));
    }

    /// Sets a field to a text in any encoding.
    pub fn set_c_text(&self, field: usize, value: &CStr) {
        // SAFETY: the feature is ours, GDAL checks the index, and the text is copied.
        unsafe { gdal_sys::OGR_F_SetFieldString(self.0, field as c_int, value.as_ptr()) };
    }

    /// Sets a field to a number.
    pub fn set_real(&self, field: usize, value: f64) {
        // SAFETY: the feature is ours, and GDAL checks the index.
        unsafe { gdal_sys::OGR_F_SetFieldDouble(self.0, field as c_int, value) };
    }

    /// Unsets a field.
    pub fn unset(&self, field: usize) {
        // SAFETY: the feature is ours, and the field is one of its own.
        unsafe { gdal_sys::OGR_F_UnsetField(self.0, field as c_int) };
    }

    /// Returns the handle for GDAL, which is valid while this lives.
    pub fn handle(&self) -> OGRFeatureH {
        self.0
    }
}

impl Drop for Feature {
    fn drop(&mut self) {
        // SAFETY: the feature is ours.
        unsafe { gdal_sys::OGR_F_Destroy(self.0) };
    }
}
