//! The border: the functions of this library that GDAL, hosts and the C++ shim call. `cpp/shim.h`
//! and `include/meshmark.h` declare these functions.

use crate::{
    error::{Error, Result},
    ffi_errors::{Collector, guarded, report, silence_panics},
    ffi_native_data::foreign_members,
    ffi_source::{Borrowed, OwnedSource},
    ffi_text::{strings, text},
    marking::{Marking, MarkingRequest, Source, split_options},
    source_files::{is_being_read, save_copies},
};
use gdal_sys::{CPLErr, GDALDatasetH};
use meshmark_core::options::{creation_option_list_xml, open_option_list_xml};
use meshmark_dataset::{Selection, Survey, marked_view::PREFIX, survey, threads, traces::ForeignMembers};
use meshmark_marking::NotMoved;
use std::{
    ffi::{CString, c_char},
    path::Path,
    ptr, slice,
    sync::OnceLock,
};

type OptionList = *const *const c_char;

unsafe extern "C" {
    fn meshmark_shim_register();
    fn meshmark_shim_filter(source: GDALDatasetH, options: OptionList) -> GDALDatasetH;
}

// --- public --------------------------------------------------------------------------------------

/// GDAL calls this when it loads `ogr_MESHMARK.so`.
#[unsafe(no_mangle)]
pub extern "C" fn RegisterOGRMESHMARK() {
    guarded((), || {
        silence_panics();
        // SAFETY: the shim's function takes no arguments and throws nothing.
        unsafe { meshmark_shim_register() }
    });
}

/// See `include/meshmark.h`.
///
/// # Safety
/// `source` is null or an open dataset; `options` is null or an array of C strings that ends in
/// null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn MeshmarkFilter(source: GDALDatasetH, options: OptionList) -> GDALDatasetH {
    guarded(ptr::null_mut(), || {
        silence_panics();
        if source.is_null() {
            report(CPLErr::CE_Failure, "MeshmarkFilter: the source is NULL: give an open dataset");
            return ptr::null_mut();
        }
        // SAFETY: as the caller promises.
        unsafe { meshmark_shim_filter(source, options) }
    })
}

/// See `include/meshmark.h`.
#[unsafe(no_mangle)]
pub extern "C" fn MeshmarkVersion() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

// --- for the shim --------------------------------------------------------------------------------

/// Opens a dataset by name and marks it; stores the handle, with a reference, in `source`.
#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_open(
    name: *const c_char,
    options: OptionList,
    source: *mut GDALDatasetH,
) -> *mut Marking {
    guarded(ptr::null_mut(), || {
        // SAFETY: the shim gives a C string, an option list and the address of a handle.
        let (name, options, source) = unsafe { (text(name), strings(options), &mut *source) };
        let opened = request(&options).and_then(|request| {
            let opened = OwnedSource::open(&name, asks_for_native_data(&options))?;
            let marking = mark(name.clone(), &request, &opened.dataset(), None)?;
            marking.write_record(&request)?;
            request.progress.end();
            *source = opened.into_handle();
            Ok(marking)
        });
        hand_over(&name, opened)
    })
}

/// Returns whether the host asks for native data, as `ogr2ogr` does with every driver.
fn asks_for_native_data(options: &[String]) -> bool {
    options.iter().any(|option| option.eq_ignore_ascii_case("NATIVE_DATA=YES"))
}

/// Marks an open dataset.
#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_mark(source: GDALDatasetH, options: OptionList) -> *mut Marking {
    guarded(ptr::null_mut(), || {
        // SAFETY: the shim gives an option list, and a dataset that stays open during the call.
        let (source, options) = unsafe { (Borrowed::new(source), strings(options)) };
        let name = source.name();
        let marking = request(&options).and_then(|request| {
            let marking = mark(name.clone(), &request, &source, None)?;
            marking.write_record(&request)?;
            request.progress.end();
            Ok(marking)
        });
        hand_over(&name, marking)
    })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_free(marking: *mut Marking) {
    // SAFETY: the shim frees a marking that `hand_over` gave it, once.
    guarded((), || drop(unsafe { Box::from_raw(marking) }));
}

#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_marks_layer(marking: *const Marking, layer: *const c_char) -> bool {
    // SAFETY: the shim gives a marking that it holds and a C string.
    guarded(true, || unsafe { (*marking).marks_layer(&text(layer)) })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_move(
    marking: *const Marking,
    layer: *const c_char,
    fid: i64,
    wkb: *mut u8,
    size: usize,
) -> i64 {
    guarded(-1, || {
        // SAFETY: the shim gives a marking that it holds and a buffer of `size` bytes.
        let (marking, wkb) = unsafe { (&*marking, slice::from_raw_parts_mut(wkb, size)) };
        let error = match marking.moves().geometry(wkb) {
            Ok(count) => return count as i64,
            Err(error) => error,
        };
        // SAFETY: the shim gives a C string.
        let layer = unsafe { text(layer) };
        let error = match error {
            NotMoved::UnknownVertex([x, y]) => Error::UnknownVertex { layer, fid, x, y },
            NotMoved::Wkb(source) => Error::Geometry { layer, fid, source },
        };
        fail(&marking.name, &error);
        -1
    })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_reach(marking: *const Marking, x: *mut f64, y: *mut f64) {
    // SAFETY: the shim gives a marking that it holds and the addresses of two numbers.
    guarded((), || unsafe { [*x, *y] = (*marking).reach() });
}

#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_source_is_unchanged(marking: *const Marking) -> bool {
    guarded(false, || {
        // SAFETY: the shim gives a marking that it holds.
        let marking = unsafe { &*marking };
        marking.check_source().map_err(|error| fail(&marking.name, &error)).is_ok()
    })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_is_complete(
    marking: *const Marking,
    layer: *const c_char,
    number: i32,
    features: u64,
) -> bool {
    guarded(false, || {
        // SAFETY: the shim gives a marking that it holds and a C string.
        let (marking, layer) = unsafe { (&*marking, text(layer)) };
        let complete = marking.check_count(layer, number as usize, features);
        complete.map_err(|error| fail(&marking.name, &error)).is_ok()
    })
}

#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_is_being_read(name: *const c_char) -> bool {
    // SAFETY: the shim gives a C string.
    guarded(false, || is_being_read(Path::new(&unsafe { text(name) })))
}

#[unsafe(no_mangle)]
unsafe extern "C" fn meshmark_refuse_to_write(name: *const c_char, copy_first: bool) {
    guarded((), || {
        // SAFETY: the shim gives a C string.
        let name = unsafe { text(name) };
        let saved = if copy_first { save_copies(Path::new(&name)) } else { Ok(()) };
        let unsaved = saved.map_err(|error| format!(" (nor could a copy be saved: {error})"));
        report(
            CPLErr::CE_Failure,
            format!("{name}: {}", Error::BeingRead { unsaved: unsaved.err().unwrap_or_default() }),
        );
    });
}

#[unsafe(no_mangle)]
extern "C" fn meshmark_option_list() -> *const c_char {
    static LIST: OnceLock<CString> = OnceLock::new();
    guarded(c"".as_ptr(), || {
        LIST.get_or_init(|| CString::new(open_option_list_xml()).expect("it has no NUL")).as_ptr()
    })
}

#[unsafe(no_mangle)]
extern "C" fn meshmark_creation_option_list() -> *const c_char {
    static LIST: OnceLock<CString> = OnceLock::new();
    guarded(c"".as_ptr(), || {
        LIST.get_or_init(|| CString::new(creation_option_list_xml()).expect("it has no NUL")).as_ptr()
    })
}

// --- helpers -------------------------------------------------------------------------------------

fn request(options: &[String]) -> Result<MarkingRequest> {
    MarkingRequest::new(&split_options(options)?, default_key_path())
}

/// Marks the dataset and suppresses the messages of GDAL meanwhile: streaming emits those that
/// matter again. The native data of features are in the attribute `native_column` of a staged map.
pub fn mark(
    name: String,
    request: &MarkingRequest,
    source: &Borrowed,
    native_column: Option<&str>,
) -> Result<Marking> {
    if source.is_meshmark() {
        return Err(Error::Marked("a marked view"));
    }
    let collector = Collector::new();
    let files = source.watch_files();
    let geometry_only = source.read_geometry_only();
    collector.clear();
    let last_failure = || collector.first_failure();
    let mut read_base = |path: &Path, selection: &Selection| read_base(path, selection, &collector);
    let surveyed = Source {
        name,
        dataset: source,
        files,
        is_staged: native_column.is_some(),
        last_failure: &last_failure,
        read_base: &mut read_base,
    };
    let mut marking = Marking::new(request, surveyed, threads())?;
    drop(geometry_only);
    let foreign = ForeignMembers { of: &foreign_members, column: native_column };
    marking.search_traces(request, source, &foreign, &last_failure)?;
    Ok(marking)
}

/// Reads the reference of an earlier edition; failures go to this collector.
fn read_base(path: &Path, selection: &Selection, collector: &Collector) -> meshmark_dataset::Result<Survey> {
    let unread = |reason: String| meshmark_dataset::Error::BaseReferenceUnread { path: path.into(), reason };
    let source =
        OwnedSource::open(&path.to_string_lossy(), false).map_err(|error| unread(error.to_string()))?;
    let dataset = source.dataset();
    if dataset.is_meshmark() {
        return Err(unread("it is a marked view".into()));
    }
    collector.clear();
    survey(&dataset, selection)
}

/// Gives a marking to the shim, or reports why there is none.
fn hand_over(name: &str, marking: Result<Marking>) -> *mut Marking {
    match marking {
        Ok(mut marking) => {
            warn(name, &std::mem::take(&mut marking.warnings));
            Box::into_raw(Box::new(marking))
        }
        Err(error) => {
            fail(name, &error);
            ptr::null_mut()
        }
    }
}

/// Emits the one error of a marked view of this name.
pub fn fail(name: &str, error: &Error) {
    report(CPLErr::CE_Failure, format!("{PREFIX}{name}: {error}"));
}

/// Emits the warnings of a marked view of this name.
pub fn warn(name: &str, warnings: &[String]) {
    warnings.iter().for_each(|warning| report(CPLErr::CE_Warning, format!("{PREFIX}{name}: {warning}")));
}

pub fn default_key_path() -> Option<String> {
    Some(config_option(c"MESHMARK_KEY".to_owned())).filter(|path| !path.is_empty())
}

fn config_option(name: CString) -> String {
    // SAFETY: the name is a C string; the value is null or a C string.
    unsafe { text(gdal_sys::CPLGetConfigOption(name.as_ptr(), ptr::null())) }
}
