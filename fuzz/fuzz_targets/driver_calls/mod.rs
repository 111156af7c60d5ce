//! A host of the driver: one call for every few bytes of an input, each checked.

mod values;

use crate::input::Input;
use gdal::{
    Dataset, DatasetOptions, Driver, DriverManager, GdalOpenFlags,
    cpl::CslStringList,
    spatial_ref::SpatialRef,
    vector::{Feature, FieldDefn, Geometry, Layer, LayerAccess, LayerOptions},
};
use gdal_sys::CPLErr;
use meshmark_plugin as _;
use std::{
    cell::RefCell,
    ffi::{CStr, CString, c_char},
    fs, panic,
    path::PathBuf,
};
use tempfile::TempDir;
use values::*;

unsafe extern "C" {
    /// GDAL's way into the plugin, which is linked here.
    fn RegisterOGRMESHMARK();
}

thread_local! {
    /// The messages of a call: whether each is a failure, and its text.
    static MESSAGES: RefCell<Vec<(bool, String)>> = const { RefCell::new(Vec::new()) };
}

/// Registers the driver. A panic ends the process as in other targets, although the driver would
/// turn it into an error.
pub fn register() {
    DriverManager::register_all();
    gdal::config::set_config_option("GDAL_NUM_THREADS", "1").expect("a legal option");
    // A job does not wait for the disk.
    gdal::config::set_config_option("OGR_SQLITE_SYNCHRONOUS", "OFF").expect("a legal option");
    let hook = panic::take_hook();
    // SAFETY: GDAL is there; the handler lives as long as the program.
    unsafe {
        RegisterOGRMESHMARK();
        gdal_sys::CPLSetErrorHandler(Some(collect));
    }
    panic::set_hook(hook);
}

unsafe extern "C" fn collect(class: CPLErr::Type, _: i32, message: *const c_char) {
    if class != CPLErr::CE_Debug {
        // SAFETY: GDAL gives a C string.
        let message = unsafe { CStr::from_ptr(message) }.to_string_lossy().into_owned();
        MESSAGES.with_borrow_mut(|messages| messages.push((class == CPLErr::CE_Failure, message)));
    }
}

/// Runs a call of the driver and returns its value, and whether it failed: with exactly one error,
/// the last message.
fn checked<T>(call: impl FnOnce() -> T, is_failure: impl FnOnce(&T) -> bool) -> (T, bool) {
    MESSAGES.take();
    // SAFETY: no pointer is involved.
    unsafe { gdal_sys::CPLErrorReset() };
    let value = call();
    let messages = MESSAGES.take();
    let failures = messages.iter().filter(|(is_failure, _)| *is_failure).count();
    assert!(failures <= 1, "several errors: {messages:?}");
    let is_last = messages.last().is_some_and(|(is_failure, _)| *is_failure);
    assert_eq!(is_last, failures == 1, "the failure is the last message: {messages:?}");
    let failed = is_failure(&value);
    assert!(!failed || failures == 1, "a failure without an error");
    (value, failed || failures == 1)
}

/// A program with a folder of its own.
pub struct Host {
    folder: TempDir,
    writing: Option<Writing>,
}

/// A dataset that is written.
struct Writing {
    dataset: Dataset,
    target: PathBuf,
    /// The number of features of every layer.
    features: Vec<usize>,
    has_failed: bool,
}

impl Host {
    /// Makes the folder, with a key and a map.
    pub fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder for temporary files");
        fs::write(folder.path().join("key.json"), KEY).expect("a temporary file");
        fs::write(folder.path().join("houses.geojson"), houses()).expect("a temporary file");
        Host { folder, writing: None }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    /// Makes one call.
    pub fn call(&mut self, input: &mut Input) {
        match (input.byte() % 16, self.writing.is_some()) {
            (0, _) => self.read(input),
            (_, false) => self.create(input),
            (1..=3, true) => self.add_layer(input),
            (4..=6, true) => self.with_layer(input, add_field),
            (7..=9, true) => self.write_feature(input),
            (10..=11, true) => self.write_houses(input),
            (12, true) => self.transaction(input),
            (13, true) => self.describe(input),
            (14, true) => self.ask(input),
            (_, true) => self.close(),
        }
    }

    fn create(&mut self, input: &mut Input) {
        let name = pick(TARGETS, input);
        let target = self.path(name);
        let driver = DriverManager::get_driver_by_name("MESHMARK").expect("it is registered");
        let mut options = CslStringList::new();
        let given = self.options(input, CREATION_OPTIONS);
        given.iter().for_each(|option| options.add_string(option).expect("it has no NUL"));
        let created = |driver: &Driver| {
            let path = format!("MESHMARK:{target}");
            driver.create_with_band_type_with_options::<u8, _>(path, 0, 0, 0, &options)
        };
        let (dataset, _) = checked(|| created(&driver), Result::is_err);
        if let Ok(dataset) = dataset {
            let (features, has_failed) = (Vec::new(), false);
            self.writing = Some(Writing { dataset, target: target.into(), features, has_failed });
        } else {
            self.check_nothing_is_left();
        }
    }

    /// Returns the options of a marking: usually enough of them.
    fn options(&self, input: &mut Input, others: &[&str]) -> Vec<String> {
        let mut options = Vec::new();
        let missing = input.byte();
        let usual = [
            format!("KEY={}", self.path("key.json")),
            "RECIPIENT=ACME GmbH".into(),
            "PATCH_SIZE=16".into(),
            format!("REFERENCE={}", self.path("reference.gpkg")),
        ];
        let is_read = std::ptr::eq(others, OPEN_OPTIONS);
        for (i, option) in usual.iter().enumerate().filter(|(i, _)| *i < 3 || !is_read) {
            if missing >> i & 1 == 0 {
                options.push(option.clone());
            }
        }
        for _ in 0..missing >> 6 {
            options.push(pick(others, input).replace("{}", &self.folder.path().display().to_string()));
        }
        options
    }

    fn add_layer(&mut self, input: &mut Input) {
        let Some(writing) = &mut self.writing else { return };
        let srs = pick(SRS, input);
        let srs = (!srs.is_empty()).then(|| SpatialRef::from_definition(srs).expect("a known CRS"));
        let option = pick(LAYER_OPTIONS, input).replace("{}", &(4 * i32::from(input.short())).to_string());
        let options = LayerOptions {
            name: pick(NAMES, input),
            srs: srs.as_ref(),
            ty: pick(GEOMETRY_TYPES, input),
            options: Some(&[option.as_str()][..usize::from(!option.is_empty())]),
        };
        let dataset = &mut writing.dataset;
        let (created, failed) = checked(|| dataset.create_layer(options).is_ok(), |created| !created);
        writing.has_failed |= failed;
        if created {
            writing.features.push(0);
        }
    }

    fn with_layer(&mut self, input: &mut Input, f: impl FnOnce(&Layer, &mut Input) -> bool) {
        let number = usize::from(input.byte() & 3);
        let Some(writing) = &mut self.writing else { return };
        let Ok(layer) = writing.dataset.layer(number) else {
            assert!(number >= writing.features.len(), "a layer is missing");
            return;
        };
        if f(&layer, input) {
            writing.features[number] += 1;
        }
    }

    fn write_feature(&mut self, input: &mut Input) {
        let mut failed = false;
        self.with_layer(input, |layer, input| {
            let feature = feature(layer, input);
            failed = checked(|| feature.create(layer), Result::is_err).1;
            !failed
        });
        self.note(failed);
    }

    /// Writes a map that is large enough.
    fn write_houses(&mut self, input: &mut Input) {
        let number = usize::from(input.byte() & 1);
        let Some(writing) = &mut self.writing else { return };
        let Ok(layer) = writing.dataset.layer(number) else { return };
        for house in house_texts() {
            let mut feature = Feature::new(layer.defn()).expect("a feature");
            feature.set_geometry(Geometry::from_wkt(&house).expect("a house")).ok();
            let failed = checked(|| feature.create(&layer), Result::is_err).1;
            writing.has_failed |= failed;
            writing.features[number] += usize::from(!failed);
        }
    }

    fn note(&mut self, failed: bool) {
        self.writing.iter_mut().for_each(|writing| writing.has_failed |= failed);
    }

    fn transaction(&mut self, input: &mut Input) {
        let Some(writing) = &self.writing else { return };
        let dataset = writing.dataset.c_dataset();
        // SAFETY: the dataset is open.
        let call = || unsafe {
            match input.byte() % 4 {
                0 | 1 => gdal_sys::GDALDatasetStartTransaction(dataset, 0),
                2 => gdal_sys::GDALDatasetCommitTransaction(dataset),
                _ => gdal_sys::GDALDatasetRollbackTransaction(dataset),
            }
        };
        checked(call, |_| false);
    }

    fn describe(&mut self, input: &mut Input) {
        let Some(writing) = &self.writing else { return };
        let [name, value] = [(); 2].map(|()| c_text(pick(TEXTS, input)));
        let domain = c_text(pick(&["", "NATIVE_DATA", "xml:A", "A"], input));
        let layer = writing.dataset.layer(usize::from(input.byte() & 3)).ok();
        // SAFETY: the dataset and its layer are open, and GDAL copies the texts.
        unsafe {
            let object = match &layer {
                Some(layer) => layer.c_layer().cast(),
                None => writing.dataset.c_dataset(),
            };
            gdal_sys::GDALSetMetadataItem(object, name.as_ptr(), value.as_ptr(), domain.as_ptr());
        }
    }

    fn ask(&mut self, input: &mut Input) {
        let Some(writing) = &self.writing else { return };
        ask(&writing.dataset, input);
    }

    /// Closes what is written: it is then complete, or an error says that it is not there.
    pub fn close(&mut self) {
        let Some(Writing { dataset, target, features, has_failed }) = self.writing.take() else { return };
        let (_, failed) = checked(|| drop(dataset), |()| false);
        assert!(failed || !has_failed, "what failed before is published");
        if failed {
            self.check_nothing_is_left();
            return;
        }
        let written = Dataset::open(&target).expect("what was written can be read");
        let counts: Vec<usize> = written.layers().map(|layer| layer.feature_count() as usize).collect();
        assert_eq!(counts, features, "features of {}", target.display());
        drop(written);
        fs::remove_file(&target).expect("it is a file");
        fs::remove_file(self.path("reference.gpkg")).expect("the reference is published, too");
    }

    fn check_nothing_is_left(&self) {
        let entries = fs::read_dir(&self.folder).expect("the folder exists");
        let names: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
        let ours = ["key.json", "houses.geojson", "record.json"];
        let is_known = |path: &PathBuf| ours.iter().any(|name| path.ends_with(name));
        assert!(names.iter().all(is_known), "a failure leaves {names:?}");
    }

    /// Opens the map through the driver and reads it.
    fn read(&mut self, input: &mut Input) {
        let name = format!("MESHMARK:{}", self.path(pick(SOURCES, input)));
        let options = self.options(input, OPEN_OPTIONS);
        let options: Vec<&str> = options.iter().map(String::as_str).collect();
        let flags = GdalOpenFlags::GDAL_OF_VECTOR | GdalOpenFlags::GDAL_OF_VERBOSE_ERROR;
        let update = if input.byte() == 255 { GdalOpenFlags::GDAL_OF_UPDATE } else { GdalOpenFlags::empty() };
        let how =
            DatasetOptions { open_flags: flags | update, open_options: Some(&options), ..Default::default() };
        let (dataset, _) = checked(|| Dataset::open_ex(&name, how), Result::is_err);
        let Ok(dataset) = dataset else { return };
        for _ in 0..input.byte() % 8 {
            ask(&dataset, input);
        }
        checked(|| drop(dataset), |()| false);
    }
}
