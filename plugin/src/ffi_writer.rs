//! The border of the write side: the functions that the C++ shim calls while a host writes.
//! `cpp/shim.h` declares them.

use crate::{
    error::{Error, Result},
    ffi::{default_key_path, fail, mark, warn},
    ffi_errors::{guarded, report},
    ffi_features::FeatureRef,
    ffi_output::{Described, Field, LayerSpec},
    ffi_source::Borrowed,
    ffi_text::{strings, text},
    marking::{MarkingRequest, split_options},
    staged_layer::NATIVE_COLUMN,
    target::Target,
    writer::Writer,
};
use gdal_sys::{
    CPLErr, GDALDatasetH, OGRFeatureH, OGRFieldDefnH, OGRLayerH, OGRSpatialReferenceH, OGRwkbGeometryType,
};
use meshmark_core::options::Creation;
use meshmark_dataset::threads;
use std::{
    ffi::{c_char, c_int},
    path::Path,
    ptr,
    sync::Mutex,
    sync::PoisonError,
};

type OptionList = *const *const c_char;

/// The target that a host last tried to open for update: if the host then creates it, it does not
/// intend a new file.
static EXTENDED: Mutex<Option<String>> = Mutex::new(None);

/// Begins a dataset and stores in `schema` the empty one of the real driver, which lives as long as
/// the writer.
#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_writer_new(
    name: *const c_char,
    options: OptionList,
    schema: *mut GDALDatasetH,
) -> *mut Writer {
    guarded(ptr::null_mut(), || {
        // SAFETY: the shim gives a C string, an option list and the address of a handle.
        let (name, options, schema) = unsafe { (text(name), strings(options), &mut *schema) };
        match new_writer(&name, &options) {
            Ok(writer) => {
                *schema = writer.schema().handle();
                Box::into_raw(Box::new(writer))
            }
            Err(error) => {
                fail(&name, &error);
                ptr::null_mut()
            }
        }
    })
}

fn new_writer(name: &str, options: &[String]) -> Result<Writer> {
    let extended = EXTENDED.lock().unwrap_or_else(PoisonError::into_inner).take();
    let (creation, marking): (Vec<_>, Vec<_>) =
        split_options(options)?.into_iter().partition(|(name, _)| Creation::has(name));
    let creation = Creation::parse(creation.iter().map(|(name, value)| (name.as_str(), value.as_str())))?;
    if extended.is_some_and(|extended| extended == name) {
        let overwrite = if Path::new(name).exists() { "; OVERWRITE=YES replaces the file" } else { "" };
        return Err(Error::Extended { overwrite });
    }
    if name.contains(char::REPLACEMENT_CHARACTER) {
        return Err(Error::NotUtf8("the name of the target".into()));
    }
    let request = MarkingRequest::new(&marking, default_key_path())?;
    Writer::new(Target::new(name, &creation)?, request)
}

/// Refuses to open a target for update.
#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_writer_refuse_update(name: *const c_char) {
    guarded((), || {
        // SAFETY: the shim gives a C string.
        let name = unsafe { text(name) };
        fail(&name, &Error::Extended { overwrite: "" });
        *EXTENDED.lock().unwrap_or_else(PoisonError::into_inner) = Some(name);
    });
}

/// Refuses to create a dataset without the prefix.
#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_writer_refuse_bare(name: *const c_char) {
    // SAFETY: the shim gives a C string.
    guarded((), || unsafe {
        report(CPLErr::CE_Failure, format!("{}: {}", text(name), Error::BareTarget(text(name))))
    });
}

/// Creates a layer and returns the empty one of the real driver, or null.
#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_writer_add_layer(
    writer: *mut Writer,
    name: *const c_char,
    srs: OGRSpatialReferenceH,
    geometry: OGRwkbGeometryType::Type,
    options: OptionList,
) -> OGRLayerH {
    guarded(ptr::null_mut(), || {
        // SAFETY: the shim gives a writer that it holds, a C string, an option list, and null or a
        // reference.
        let (writer, name, options) = unsafe { (&mut *writer, text(name), strings(options)) };
        let added = split_options(&options).and_then(|options| {
            // SAFETY: as above.
            writer.add_layer(unsafe { LayerSpec::new(name, srs, geometry, options) })
        });
        match added {
            Ok(layer) => writer.schema().layer(layer),
            Err(error) => {
                fail(writer.name(), &error);
                ptr::null_mut()
            }
        }
    })
}

/// Creates a field.
#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_writer_add_field(
    writer: *mut Writer,
    layer: c_int,
    field: OGRFieldDefnH,
    approximate: bool,
) -> bool {
    guarded(false, || {
        // SAFETY: the shim gives a writer that it holds and a field definition.
        let (writer, field) = unsafe { (&mut *writer, Field::read(field)) };
        let added = writer.add_field(layer as usize, &field, approximate);
        added.map_err(|error| fail(writer.name(), &error)).is_ok()
    })
}

/// Stages a feature and sets its id.
#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_writer_write(writer: *mut Writer, layer: c_int, feature: OGRFeatureH) -> bool {
    guarded(false, || {
        // SAFETY: the shim gives a writer that it holds and a feature.
        let (writer, feature) = unsafe { (&mut *writer, FeatureRef::new(feature)) };
        let written = writer.write(layer as usize, feature);
        written.map_err(|error| fail(writer.name(), &error)).is_ok()
    })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_writer_begin(writer: *mut Writer) {
    // SAFETY: the shim gives a writer that it holds.
    guarded((), || unsafe { (*writer).begin() });
}

#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_writer_commit(writer: *mut Writer) -> bool {
    // SAFETY: the shim gives a writer that it holds.
    guarded(false, || unsafe { (*writer).commit() })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_writer_roll_back(writer: *mut Writer) {
    // SAFETY: the shim gives a writer that it holds.
    guarded((), || unsafe { (*writer).roll_back() });
}

/// Marks and publishes the dataset unless an operation failed, with metadata and styles of
/// `described`; frees the writer.
#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_writer_finish(
    writer: *mut Writer,
    described: GDALDatasetH,
    host_failure: *const c_char,
) -> bool {
    guarded(false, || {
        // SAFETY: the shim gives up its writer; the dataset is open during the call; null or a C
        // string.
        let (writer, described, host_failure) = unsafe {
            let failure = (!host_failure.is_null()).then(|| text(host_failure));
            (*Box::from_raw(writer), Described::new(described), failure)
        };
        let name = writer.name().to_string();
        let mark_source = |request: &MarkingRequest, source: &Borrowed| {
            mark(name.clone(), request, source, Some(NATIVE_COLUMN))
        };
        let finished = writer.finish(&described, host_failure, &mark_source, threads());
        match finished {
            Ok(warnings) => {
                warn(&name, &warnings);
                true
            }
            Err(error) => {
                fail(&name, &error);
                false
            }
        }
    })
}
