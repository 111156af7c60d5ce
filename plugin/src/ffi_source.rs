//! The source dataset, read by GDAL's C API: opening, filters, ignored fields, file list.

use crate::{
    error::{Error, Result},
    ffi_errors::Collector,
    ffi_features::Feature,
    ffi_text::{strings, text},
    marking::Marking,
    source_files::SourceFiles,
};
use gdal::{Dataset, GdalOpenFlags};
use gdal_sys::{GDALDatasetH, OGRLayerH};
use meshmark_dataset::{OPEN_OPTIONS, marked_view};
use std::{
    ffi::{CStr, CString, c_char, c_void},
    marker::PhantomData,
    mem::ManuallyDrop,
    ops::Deref,
    path::PathBuf,
    ptr,
};

unsafe extern "C" {
    /// Returns a marked dataset that takes over a reference to `source`, and `marking`.
    fn meshmark_shim_view(source: GDALDatasetH, marking: *mut c_void) -> GDALDatasetH;
}

const DRIVER: &CStr = c"MESHMARK";

/// A dataset handle that holds one reference and releases it when dropped.
pub struct OwnedSource(GDALDatasetH);

impl OwnedSource {
    /// Opens a vector dataset to read, with the native data of a GeoJSON file if
    /// `with_native_data`. Messages of GDAL are emitted only when it succeeds.
    pub fn open(name: &str, with_native_data: bool) -> Result<Self> {
        if name.trim().is_empty() {
            return Err(Error::NoSource);
        }
        if marked_view::is_named_by(name) {
            return Err(Error::Marked("a marked view"));
        }
        let c_name = CString::new(name).expect("it was a C string");
        let collector = Collector::new();
        // Internal means that the handle belongs to this library alone and is not listed among the
        // host's datasets.
        let flags = GdalOpenFlags::GDAL_OF_VECTOR
            | GdalOpenFlags::GDAL_OF_VERBOSE_ERROR
            | GdalOpenFlags::GDAL_OF_INTERNAL;
        let native = with_native_data.then_some("@NATIVE_DATA=YES");
        let options = OPEN_OPTIONS.into_iter().chain(native);
        let options: Vec<CString> = options.map(|o| CString::new(o).expect("it has no NUL")).collect();
        let options: Vec<_> = options.iter().map(|option| option.as_ptr()).chain([ptr::null()]).collect();
        // SAFETY: the name is a C string; null lists mean all drivers and no sibling files, the
        // options end in null.
        let handle = unsafe {
            gdal_sys::GDALOpenEx(c_name.as_ptr(), flags.bits(), ptr::null(), options.as_ptr(), ptr::null())
        };
        if handle.is_null() {
            let reason = collector.first_failure();
            return Err(match reason {
                _ if is_raster(&c_name) => Error::Raster,
                Some(reason) => Error::SourceUnopened(reason),
                None => Error::SourceUnopened("no vector driver of GDAL knows it".into()),
            });
        }
        collector.release();
        Ok(OwnedSource(handle))
    }

    /// Returns the handle, whose reference then belongs to the caller.
    pub fn into_handle(self) -> GDALDatasetH {
        ManuallyDrop::new(self).0
    }

    /// Returns the dataset, which lives as long as this.
    pub fn dataset(&self) -> Borrowed<'_> {
        // SAFETY: the handle is open, and the borrow of `self` keeps its reference from being given
        // up.
        unsafe { Borrowed::new(self.0) }
    }
}

impl Drop for OwnedSource {
    fn drop(&mut self) {
        // SAFETY: the handle is open and this reference is ours.
        unsafe { gdal_sys::GDALReleaseDataset(self.0) };
    }
}

/// A marked dataset: the read side of the driver, in this process.
pub struct View {
    handle: GDALDatasetH,
    marking: *const Marking,
}

impl View {
    pub fn new(source: OwnedSource, marking: Marking) -> Result<Self> {
        let marking = Box::into_raw(Box::new(marking));
        let collector = Collector::new();
        // SAFETY: both are given away; the marking lives as long as the view.
        let handle = unsafe { meshmark_shim_view(source.into_handle(), marking.cast()) };
        match (handle.is_null(), collector.first_failure()) {
            (false, _) => Ok(View { handle, marking }),
            (true, reason) => Err(Error::SourceUnopened(reason.unwrap_or_default())),
        }
    }

    pub fn marking(&self) -> &Marking {
        // SAFETY: the view owns it.
        unsafe { &*self.marking }
    }

    /// Returns the marked dataset, which lives as long as this.
    pub fn dataset(&self) -> Borrowed<'_> {
        // SAFETY: the handle is open, and the borrow of `self` keeps the view from closing it.
        unsafe { Borrowed::new(self.handle) }
    }

    /// Calls `f` with every feature of a layer.
    pub fn for_each(&self, layer: &str, mut f: impl FnMut(Feature) -> Result<()>) -> Result<()> {
        let name = CString::new(layer).expect("it was a C string");
        let collector = Collector::new();
        // SAFETY: the dataset is open, the name is a C string, and features are the caller's to
        // destroy.
        unsafe {
            let layer = gdal_sys::GDALDatasetGetLayerByName(self.handle, name.as_ptr());
            if !layer.is_null() {
                gdal_sys::OGR_L_ResetReading(layer);
                loop {
                    let feature = gdal_sys::OGR_L_GetNextFeature(layer);
                    if feature.is_null() {
                        break;
                    }
                    f(Feature::from_handle(feature))?;
                }
            }
        }
        match collector.first_failure() {
            None => Ok(()),
            Some(reason) => Err(Error::Writing { what: format!("reading layer \"{layer}\" again"), reason }),
        }
    }
}

impl Drop for View {
    fn drop(&mut self) {
        // SAFETY: the dataset is open and ours.
        unsafe { gdal_sys::GDALClose(self.handle) };
    }
}

/// Returns whether only raster drivers recognise the dataset: a damaged GeoPackage could be both.
fn is_raster(name: &CStr) -> bool {
    let known = |kind: GdalOpenFlags| {
        // SAFETY: the name is a C string; null lists mean all drivers and no sibling files.
        let driver =
            unsafe { gdal_sys::GDALIdentifyDriverEx(name.as_ptr(), kind.bits(), ptr::null(), ptr::null()) };
        !driver.is_null()
    };
    known(GdalOpenFlags::GDAL_OF_RASTER) && !known(GdalOpenFlags::GDAL_OF_VECTOR)
}

/// A dataset that this library does not own, open for `'a`, in the type of the `gdal` crate:
/// dropping it does not close it.
pub struct Borrowed<'a>(ManuallyDrop<Dataset>, PhantomData<&'a Dataset>);

impl Borrowed<'_> {
    /// # Safety
    /// `handle` is an open dataset and stays so for the lifetime of the result, which the caller
    /// chooses.
    pub unsafe fn new(handle: GDALDatasetH) -> Self {
        // SAFETY: the handle is open; ManuallyDrop keeps the wrapper from closing it.
        Borrowed(ManuallyDrop::new(unsafe { Dataset::from_c_dataset(handle) }), PhantomData)
    }

    pub fn is_meshmark(&self) -> bool {
        // SAFETY: the dataset is open; a dataset without a driver yields null, which no driver is.
        unsafe {
            let driver = gdal_sys::GDALGetDatasetDriver(self.c_dataset());
            !driver.is_null() && driver == gdal_sys::GDALGetDriverByName(DRIVER.as_ptr())
        }
    }

    /// Returns its name for messages.
    pub fn name(&self) -> String {
        // SAFETY: the dataset is open, and its description is a C string.
        let name = unsafe { text(gdal_sys::GDALGetDescription(self.c_dataset())) };
        if name.is_empty() { "the dataset".into() } else { name }
    }

    /// Watches the files from which it is read.
    pub fn watch_files(&self) -> SourceFiles {
        // SAFETY: the dataset is open; the list is ours to free.
        unsafe {
            let list = gdal_sys::GDALGetFileList(self.c_dataset());
            let paths = strings(list.cast());
            gdal_sys::CSLDestroy(list);
            SourceFiles::watch(paths.into_iter().map(PathBuf::from))
        }
    }

    /// Clears all filters and makes layers yield no attributes until the result is dropped.
    pub fn read_geometry_only(&self) -> GeometryOnly<'_> {
        let layers = self.layers();
        for &layer in &layers {
            // SAFETY: the layers live as long as the dataset; null clears a filter.
            unsafe {
                gdal_sys::OGR_L_SetAttributeFilter(layer, ptr::null());
                gdal_sys::OGR_L_SetSpatialFilter(layer, ptr::null_mut());
                ignore_attributes(layer);
            }
        }
        GeometryOnly { layers, _dataset: self }
    }

    fn layers(&self) -> Vec<OGRLayerH> {
        // SAFETY: the dataset is open and the indices are those of its layers.
        unsafe {
            let count = gdal_sys::GDALDatasetGetLayerCount(self.c_dataset());
            (0..count).map(|i| gdal_sys::GDALDatasetGetLayer(self.c_dataset(), i)).collect()
        }
    }
}

impl Deref for Borrowed<'_> {
    type Target = Dataset;
    fn deref(&self) -> &Dataset {
        &self.0
    }
}

/// While it lives, the layers of a dataset yield no attributes.
pub struct GeometryOnly<'a> {
    layers: Vec<OGRLayerH>,
    _dataset: &'a Borrowed<'a>,
}

impl Drop for GeometryOnly<'_> {
    fn drop(&mut self) {
        for &layer in &self.layers {
            // SAFETY: the layers live as long as the dataset; null reads all fields again.
            unsafe {
                gdal_sys::OGR_L_SetIgnoredFields(layer, ptr::null_mut());
                gdal_sys::OGR_L_ResetReading(layer);
            }
        }
    }
}

/// # Safety
/// `layer` is a layer of an open dataset.
unsafe fn ignore_attributes(layer: OGRLayerH) {
    // SAFETY: the definition lives as long as the layer, the indices are those of its fields, and
    // the list of C strings ends in null and outlives the call.
    unsafe {
        if gdal_sys::OGR_L_TestCapability(layer, c"IgnoreFields".as_ptr()) == 0 {
            return;
        }
        let definition = gdal_sys::OGR_L_GetLayerDefn(layer);
        let fields = 0..gdal_sys::OGR_FD_GetFieldCount(definition);
        let name = |i| gdal_sys::OGR_Fld_GetNameRef(gdal_sys::OGR_FD_GetFieldDefn(definition, i));
        // GDAL takes this name for the geometry, whatever the fields.
        let is_field =
            |name: &*const c_char| !CStr::from_ptr(*name).to_bytes().eq_ignore_ascii_case(b"OGR_GEOMETRY");
        let mut names: Vec<*const c_char> = fields.map(name).filter(is_field).collect();
        names.extend([c"OGR_STYLE".as_ptr(), ptr::null()]);
        gdal_sys::OGR_L_SetIgnoredFields(layer, names.as_mut_ptr());
    }
}
