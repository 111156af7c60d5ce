//! Datasets that are written by GDAL's C API: layers, fields, features, and their metadata and
//! styles.

use crate::{
    error::Result,
    ffi_errors::{Collector, check, failure},
    ffi_features::Feature,
    ffi_native_data::{NATIVE_DATA, item_without_places, meshmark_native_data},
    ffi_text::{c_string, strings, text},
};
use gdal_sys::{
    GDALDatasetH, OGRFieldDefnH, OGRFieldSubType, OGRFieldType, OGRLayerH, OGRSpatialReferenceH,
    OGRwkbGeometryType,
};
use std::{
    ffi::{CStr, CString, c_char, c_int},
    mem,
    path::Path,
    ptr,
};

/// The configuration option that controls the check of creation options.
const VALIDATE: &CStr = c"GDAL_VALIDATE_CREATION_OPTIONS";

/// The specification of a layer.
pub struct LayerSpec {
    /// Its name.
    pub name: String,
    /// The type of its geometry column.
    pub geometry: OGRwkbGeometryType::Type,
    /// Layer creation options.
    pub options: Vec<(String, String)>,
    srs: Srs,
}

impl LayerSpec {
    /// # Safety
    /// `srs` is null or a spatial reference.
    pub unsafe fn new(
        name: String,
        srs: OGRSpatialReferenceH,
        geometry: OGRwkbGeometryType::Type,
        options: Vec<(String, String)>,
    ) -> Self {
        let options = options.into_iter();
        let options = options
            .filter_map(|(name, value)| item_without_places(&name, &value).map(|value| (name, value)))
            .collect();
        // SAFETY: as the caller promises.
        let srs = Srs(if srs.is_null() { srs } else { unsafe { gdal_sys::OSRClone(srs) } });
        LayerSpec { name, geometry, options, srs }
    }

    /// Returns whether x and y are longitudes and latitudes of WGS 84, or of an unknown CRS.
    pub fn is_wgs84(&self) -> bool {
        // The order of the axes does not matter, as x is the longitude in the host's coordinates.
        let criterion = c"CRITERION=EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS";
        let axes = c"IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES";
        let options = [criterion.as_ptr(), axes.as_ptr(), ptr::null()];
        if self.srs.0.is_null() {
            return true;
        }
        // SAFETY: ours is a reference, the others are made and released here; null is no name, and
        // the list ends in it.
        unsafe {
            let own = Srs(gdal_sys::OSRClone(self.srs.0));
            gdal_sys::OSRDemoteTo2D(own.0, ptr::null());
            let wgs84 = gdal_sys::OSRNewSpatialReference(ptr::null());
            gdal_sys::OSRSetWellKnownGeogCS(wgs84, c"WGS84".as_ptr());
            let is_same = gdal_sys::OSRIsSameEx(own.0, wgs84, options.as_ptr()) != 0;
            gdal_sys::OSRRelease(wgs84);
            is_same
        }
    }

    /// Returns the same layer with another name and other options.
    pub fn renamed(&self, name: String, options: Vec<(String, String)>) -> Self {
        // SAFETY: the spatial reference is null or ours.
        unsafe { Self::new(name, self.srs.0, self.geometry, options) }
    }
}

struct Srs(OGRSpatialReferenceH);

impl Drop for Srs {
    fn drop(&mut self) {
        if !self.0.is_null() {
            // SAFETY: the reference is ours.
            unsafe { gdal_sys::OSRRelease(self.0) };
        }
    }
}

/// The specification of a field.
#[derive(Clone)]
pub struct Field {
    /// Its name; bytes that are not UTF-8 are replaced.
    pub name: String,
    /// The bytes of its name, in any encoding.
    c_name: CString,
    /// Its type.
    pub kind: OGRFieldType::Type,
    subkind: OGRFieldSubType::Type,
    width: c_int,
    precision: c_int,
    nullable: c_int,
    unique: c_int,
    default: Option<CString>,
    domain: Option<CString>,
    alternative_name: Option<CString>,
}

impl Field {
    /// Returns a text field.
    pub fn text(name: String) -> Self {
        Field {
            c_name: c_string(&name),
            name,
            kind: OGRFieldType::OFTString,
            subkind: OGRFieldSubType::OFSTNone,
            width: 0,
            precision: 0,
            nullable: 1,
            unique: 0,
            default: None,
            domain: None,
            alternative_name: None,
        }
    }

    /// # Safety
    /// `field` is a field definition.
    pub unsafe fn read(field: OGRFieldDefnH) -> Self {
        // SAFETY: the definition is valid, its strings are null or C strings that are copied.
        unsafe {
            let string = |s: *const c_char| (!s.is_null() && *s != 0).then(|| CStr::from_ptr(s).to_owned());
            Field {
                name: text(gdal_sys::OGR_Fld_GetNameRef(field)),
                c_name: CStr::from_ptr(gdal_sys::OGR_Fld_GetNameRef(field)).to_owned(),
                kind: gdal_sys::OGR_Fld_GetType(field),
                subkind: gdal_sys::OGR_Fld_GetSubType(field),
                width: gdal_sys::OGR_Fld_GetWidth(field),
                precision: gdal_sys::OGR_Fld_GetPrecision(field),
                nullable: gdal_sys::OGR_Fld_IsNullable(field),
                unique: gdal_sys::OGR_Fld_IsUnique(field),
                default: string(gdal_sys::OGR_Fld_GetDefault(field)),
                domain: string(gdal_sys::OGR_Fld_GetDomainName(field)),
                alternative_name: string(gdal_sys::OGR_Fld_GetAlternativeNameRef(field)),
            }
        }
    }

    /// Returns the field of a staging GeoPackage that keeps every value of this one: types that
    /// GeoPackage would change become text. The target checks constraints.
    pub fn staged(&self, name: String, is_geopackage: bool) -> Self {
        let kept = match self.kind {
            OGRFieldType::OFTInteger
            | OGRFieldType::OFTInteger64
            | OGRFieldType::OFTReal
            | OGRFieldType::OFTString
            | OGRFieldType::OFTBinary
            | OGRFieldType::OFTDate => true,
            OGRFieldType::OFTDateTime => is_geopackage,
            _ => false,
        };
        match kept {
            true => Field {
                kind: self.kind,
                subkind: self.subkind,
                default: self.default.clone(),
                ..Field::text(name)
            },
            false => Field::text(name),
        }
    }

    /// Returns whether it holds a number with fractions.
    pub fn is_real(&self) -> bool {
        self.kind == OGRFieldType::OFTReal
    }

    /// Returns whether it holds a text.
    pub fn is_text(&self) -> bool {
        self.kind == OGRFieldType::OFTString
    }

    /// Returns whether it holds several values.
    pub fn is_list(&self) -> bool {
        matches!(
            self.kind,
            OGRFieldType::OFTIntegerList
                | OGRFieldType::OFTInteger64List
                | OGRFieldType::OFTRealList
                | OGRFieldType::OFTStringList
        )
    }

    fn with_handle<T>(&self, f: impl FnOnce(OGRFieldDefnH) -> T) -> T {
        // SAFETY: the definition is made, used and destroyed here; its strings are copied.
        unsafe {
            let field = gdal_sys::OGR_Fld_Create(self.c_name.as_ptr(), self.kind);
            gdal_sys::OGR_Fld_SetSubType(field, self.subkind);
            gdal_sys::OGR_Fld_SetWidth(field, self.width);
            gdal_sys::OGR_Fld_SetPrecision(field, self.precision);
            gdal_sys::OGR_Fld_SetNullable(field, self.nullable);
            gdal_sys::OGR_Fld_SetUnique(field, self.unique);
            if let Some(text) = &self.default {
                gdal_sys::OGR_Fld_SetDefault(field, text.as_ptr());
            }
            if let Some(text) = &self.domain {
                gdal_sys::OGR_Fld_SetDomainName(field, text.as_ptr());
            }
            if let Some(text) = &self.alternative_name {
                gdal_sys::OGR_Fld_SetAlternativeName(field, text.as_ptr());
            }
            let result = f(field);
            gdal_sys::OGR_Fld_Destroy(field);
            result
        }
    }
}

/// A dataset that is written.
pub struct Output {
    dataset: GDALDatasetH,
    layers: Vec<OGRLayerH>,
}

impl Output {
    /// Creates a dataset by the driver of this name.
    pub fn create(driver: &str, path: &Path) -> Result<Self> {
        let collector = Collector::new();
        let path_text = c_string(&path.display().to_string());
        // SAFETY: the names are C strings, a null list means no options, zero bands mean vectors.
        let dataset = unsafe {
            let handle = gdal_sys::GDALGetDriverByName(c_string(driver).as_ptr());
            if handle.is_null() {
                return Err(failure(format!("finding GDAL's driver {driver}"), &collector));
            }
            gdal_sys::GDALCreate(
                handle,
                path_text.as_ptr(),
                0,
                0,
                0,
                gdal_sys::GDALDataType::GDT_Unknown,
                ptr::null_mut(),
            )
        };
        match dataset.is_null() {
            true => Err(failure(format!("creating a {driver} dataset"), &collector)),
            false => Ok(Output { dataset, layers: Vec::new() }),
        }
    }

    /// Returns the dataset, which lives as long as this.
    pub fn handle(&self) -> GDALDatasetH {
        self.dataset
    }

    /// Returns a layer, which lives as long as this.
    pub fn layer(&self, number: usize) -> OGRLayerH {
        self.layers[number]
    }

    /// Begins the one transaction of a database.
    pub fn begin(&self) -> Result<()> {
        let collector = Collector::new();
        // SAFETY: the dataset is open.
        let error = unsafe { gdal_sys::GDALDatasetStartTransaction(self.dataset, 0) };
        check(error, || "starting a transaction".into(), &collector)
    }

    /// Commits that transaction.
    pub fn commit(&self) -> Result<()> {
        let collector = Collector::new();
        // SAFETY: the dataset is open.
        let error = unsafe { gdal_sys::GDALDatasetCommitTransaction(self.dataset) };
        check(error, || "committing".into(), &collector)
    }

    /// Creates a layer. The messages of the driver are emitted unless `quiet`.
    pub fn add_layer(&mut self, spec: &LayerSpec, quiet: bool) -> Result<()> {
        let name = c_string(&spec.name);
        let options: Vec<CString> = spec.options.iter().map(|(n, v)| c_string(&format!("{n}={v}"))).collect();
        let mut list: Vec<*mut c_char> = options.iter().map(|o| o.as_ptr().cast_mut()).collect();
        list.push(ptr::null_mut());
        let collector = Collector::new();
        // SAFETY: the dataset is open, the list ends in null, and GDAL changes no option; the
        // configuration option is restored. GDAL has checked the options already when the host
        // created the layer.
        let layer = unsafe {
            let before = gdal_sys::CPLGetThreadLocalConfigOption(VALIDATE.as_ptr(), ptr::null());
            let before = (!before.is_null()).then(|| CStr::from_ptr(before).to_owned());
            gdal_sys::CPLSetThreadLocalConfigOption(VALIDATE.as_ptr(), c"NO".as_ptr());
            let layer = gdal_sys::GDALDatasetCreateLayer(
                self.dataset,
                name.as_ptr(),
                spec.srs.0,
                spec.geometry,
                list.as_mut_ptr(),
            );
            let before = before.as_ref().map_or(ptr::null(), |value| value.as_ptr());
            gdal_sys::CPLSetThreadLocalConfigOption(VALIDATE.as_ptr(), before);
            layer
        };
        if layer.is_null() {
            return Err(failure(format!("creating layer \"{}\"", spec.name), &collector));
        }
        self.layers.push(layer);
        if !quiet {
            collector.release();
        }
        Ok(())
    }

    /// Returns the fields of a layer.
    pub fn fields(&self, layer: usize) -> Vec<Field> {
        // SAFETY: the definition lives as long as the layer, and the indices are those of its
        // fields.
        unsafe {
            let definition = gdal_sys::OGR_L_GetLayerDefn(self.layers[layer]);
            let count = gdal_sys::OGR_FD_GetFieldCount(definition);
            (0..count).map(|i| Field::read(gdal_sys::OGR_FD_GetFieldDefn(definition, i))).collect()
        }
    }

    /// Returns how many fields a layer has.
    pub fn field_count(&self, layer: usize) -> usize {
        // SAFETY: the definition lives as long as the layer.
        unsafe { gdal_sys::OGR_FD_GetFieldCount(gdal_sys::OGR_L_GetLayerDefn(self.layers[layer])) as usize }
    }

    /// Returns the name of a layer and of its columns for ids and geometries; empty where there is
    /// none.
    pub fn names(&self, layer: usize) -> [String; 3] {
        // SAFETY: the layer is open and the names are C strings.
        unsafe {
            let layer = self.layers[layer];
            [
                text(gdal_sys::OGR_L_GetName(layer)),
                text(gdal_sys::OGR_L_GetFIDColumn(layer)),
                text(gdal_sys::OGR_L_GetGeometryColumn(layer)),
            ]
        }
    }

    /// Creates a field.
    pub fn add_field(&self, layer: usize, field: &Field, approximate: bool, quiet: bool) -> Result<()> {
        let collector = Collector::new();
        // SAFETY: the layer is open.
        let error = field.with_handle(|handle| unsafe {
            gdal_sys::OGR_L_CreateField(self.layers[layer], handle, c_int::from(approximate))
        });
        check(error, || format!("creating field \"{}\"", field.name), &collector)?;
        if !quiet {
            collector.release();
        }
        Ok(())
    }

    /// Returns a new feature of a layer.
    pub fn feature(&self, layer: usize) -> Feature {
        // SAFETY: the definition outlives the feature: GDAL counts references to it.
        unsafe {
            Feature::from_handle(gdal_sys::OGR_F_Create(gdal_sys::OGR_L_GetLayerDefn(self.layers[layer])))
        }
    }

    /// Writes a feature and returns its id.
    pub fn write(&self, layer: usize, feature: &Feature, quiet: bool) -> Result<i64> {
        let collector = Collector::new();
        // SAFETY: the layer and the feature are open.
        let error = unsafe { gdal_sys::OGR_L_CreateFeature(self.layers[layer], feature.handle()) };
        check(error, || "writing it".into(), &collector)?;
        if !quiet {
            collector.release();
        }
        // SAFETY: the feature is ours.
        Ok(unsafe { gdal_sys::OGR_F_GetFID(feature.handle()) })
    }

    /// Copies the field domains of another dataset.
    pub fn copy_domains(&self, from: &Output) {
        // SAFETY: both datasets are open; the list and the reason are ours to free.
        unsafe {
            let names = gdal_sys::GDALDatasetGetFieldDomainNames(from.dataset, ptr::null_mut());
            for name in strings(names.cast()) {
                let domain = gdal_sys::GDALDatasetGetFieldDomain(from.dataset, c_string(&name).as_ptr());
                let mut reason = ptr::null_mut();
                if !domain.is_null() {
                    gdal_sys::GDALDatasetAddFieldDomain(self.dataset, domain, &mut reason);
                    gdal_sys::VSIFree(reason.cast());
                }
            }
            gdal_sys::CSLDestroy(names);
        }
    }

    /// Copies metadata and styles of the dataset that a host described.
    pub fn describe(&self, described: &Described) {
        // SAFETY: both datasets are open, and the style table is copied.
        unsafe {
            copy_metadata(described.0.cast(), self.dataset.cast());
            let styles = gdal_sys::GDALDatasetGetStyleTable(described.0);
            if !styles.is_null() {
                gdal_sys::GDALDatasetSetStyleTable(self.dataset, styles);
            }
        }
    }

    /// Copies metadata and styles of a layer that a host described.
    pub fn describe_layer(&self, layer: usize, described: &Described) {
        // SAFETY: GDAL checks the index; both layers are open, and the style table is copied.
        unsafe {
            let described = gdal_sys::GDALDatasetGetLayer(described.0, layer as c_int);
            if described.is_null() {
                return;
            }
            copy_metadata(described.cast(), self.layers[layer].cast());
            let styles = gdal_sys::OGR_L_GetStyleTable(described);
            if !styles.is_null() {
                gdal_sys::OGR_L_SetStyleTable(self.layers[layer], styles);
            }
        }
    }

    /// Closes the dataset; many drivers write only at this point.
    pub fn close(mut self) -> Result<()> {
        let collector = Collector::new();
        // SAFETY: the dataset is open and ours, and nothing else uses it afterwards.
        unsafe { gdal_sys::GDALClose(mem::replace(&mut self.dataset, ptr::null_mut())) };
        match collector.first_failure() {
            None => Ok(()),
            Some(_) => Err(failure("closing".into(), &collector)),
        }
    }
}

/// Abandons a dataset that was not closed; messages of its driver about this are discarded.
impl Drop for Output {
    fn drop(&mut self) {
        if self.dataset.is_null() {
            return;
        }
        let _quiet = Collector::new();
        // SAFETY: the dataset is open and ours.
        unsafe { gdal_sys::GDALClose(self.dataset) };
    }
}

/// Copies metadata without the unmarked extent in the native data of a GeoJSON file.
///
/// # Safety
/// Both are datasets or layers that are open.
unsafe fn copy_metadata(from: *mut std::ffi::c_void, to: *mut std::ffi::c_void) {
    // SAFETY: the list of names is ours to free, those of a domain are copied.
    unsafe {
        let domains = gdal_sys::GDALGetMetadataDomainList(from);
        for domain in strings(domains.cast()) {
            let is_native = domain == NATIVE_DATA;
            let domain = c_string(&domain);
            let items = gdal_sys::GDALGetMetadata(from, domain.as_ptr());
            if is_native {
                let items = meshmark_native_data(items.cast_const().cast());
                gdal_sys::GDALSetMetadata(to, items, domain.as_ptr());
                gdal_sys::CSLDestroy(items);
            } else if !items.is_null() && !(*items).is_null() {
                gdal_sys::GDALSetMetadata(to, items.cast(), domain.as_ptr());
            }
        }
        gdal_sys::CSLDestroy(domains);
    }
}

/// The dataset that a host writes to, with the metadata and styles it set.
pub struct Described(GDALDatasetH);

impl Described {
    /// # Safety
    /// The dataset stays open while this lives.
    pub unsafe fn new(dataset: GDALDatasetH) -> Self {
        Described(dataset)
    }
}
