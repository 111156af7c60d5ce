//! Whatever fails while a marked map is written: afterwards there is the complete verified output
//! or the previous state, and the exit code is 0 in the first case only.

use gdal_sys::{CPLErr, GDALDatasetH, OGRErr, OGRFieldType, OGRLayerH, OGRwkbGeometryType};
use libloading::Library;
use meshmark_host_tests::{
    faults::{Fault, Outcome, Scene, points},
    plugin::{Host, fixture, library},
};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};
use std::{
    ffi::{CStr, CString, c_char},
    fs, ptr,
    sync::{Mutex, MutexGuard, PoisonError},
};

fn source(name: &str) -> String {
    fixture(name).display().to_string()
}

/// Asserts that ogr2ogr fails with a sentence that holds `words`, and that it writes and leaves
/// nothing.
#[track_caller]
fn fails(host: &Host, target: &str, source: &str, more: &[&str], words: &[&str]) {
    let before = host.files();
    let run = host.create(target, source, more);
    assert!(run.code.is_some_and(|code| code != 0), "{:?}: {}", run.code, run.stderr);
    for word in words {
        assert!(run.stderr.contains(word), "{word:?} is not in: {}", run.stderr);
    }
    assert!(host.files() == before, "{:?}", host.names());
}

// --- the process or the disk fails ---------------------------------------------------------------

/// Returns the calls to fail: all near the end, where files are published, and some before.
fn places(calls: usize, some: usize) -> Vec<usize> {
    let publication = calls.saturating_sub(25)..=calls;
    (1..=some).map(|i| i * (calls - 25) / (some + 1)).chain(publication).collect()
}

#[test]
fn a_process_that_is_killed_at_any_call_leaves_all_or_nothing() {
    for (target, replaces) in [("out.gpkg", false), ("out.shp", true)] {
        let scene = Scene::new(target, replaces);
        let calls = scene.count_calls();
        let mut seen = Vec::new();
        for at in places(calls, 6) {
            scene.reset();
            seen.push(scene.survives(Fault::Kill(at)));
        }
        assert!(seen.contains(&Outcome::Complete) && seen.contains(&Outcome::Previous), "{seen:?}");
    }
}

#[test]
fn a_process_that_is_killed_at_random_moments_leaves_all_or_nothing() {
    let seed = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_nanos() as u64;
    println!("seed {seed}");
    let mut random = ChaCha20Rng::seed_from_u64(seed);
    let scene = Scene::new("out.gpkg", true);
    for _ in 0..10 {
        scene.reset();
        scene.survives(Fault::KillAfter(f64::from(random.next_u32()) / f64::from(u32::MAX) * 0.6 + 0.01));
    }
}

#[test]
fn a_disk_that_is_full_at_any_call_fails_without_a_trace() {
    for (target, replaces) in [("out.gpkg", true), ("out.geojson", false)] {
        let scene = Scene::new(target, replaces);
        for at in places(scene.count_calls(), 6) {
            scene.reset();
            scene.survives(Fault::FullDisk(at));
        }
    }
}

#[test]
fn a_file_that_cannot_grow_fails_without_a_trace_in_every_format() {
    for target in ["out.gpkg", "out.shp", "out.shz", "out.geojson", "out.fgb"] {
        let scene = Scene::new(target, false);
        scene.count_calls();
        let largest = scene.host.files().into_iter().map(|(_, bytes)| bytes.len()).max().unwrap();
        let mut seen = Vec::new();
        for share in [0.02, 0.2, 0.5, 0.9, 2.0] {
            scene.reset();
            seen.push(scene.survives(Fault::FileSize((largest as f64 * share) as usize)));
        }
        assert_eq!((seen[0], seen[4]), (Outcome::Previous, Outcome::Complete), "{target}: {seen:?}");
    }
}

// --- the host fails ------------------------------------------------------------------------------

#[test]
fn a_map_that_cannot_be_marked_is_not_written() {
    let host = Host::new();
    fs::write(host.path("tiny.geojson"), points(20, "")).unwrap();
    fails(&host, "out.gpkg", "tiny.geojson", &[], &["20 distinct vertices, fewer than PATCH_SIZE=480"]);
    fails(&host, "out.gpkg", "tiny.geojson", &["-where", "FALSE"], &["MESHMARK:out.gpkg"]);
}

#[test]
fn a_place_that_cannot_be_written_to_is_named_before_anything_is_read() {
    let host = Host::new();
    let kotka = source("kotka.gpkg");
    fails(&host, "/proc/out.gpkg", &kotka, &[], &["writing into /proc"]);
    fails(&host, "out.gpkg", &kotka, &["-dsco", "REFERENCE=/proc/ref.gpkg"], &["writing into /proc"]);
    fails(&host, "out.gpkg", &kotka, &["-dsco", "RECORD=/proc/record.json"], &["/proc"]);
}

#[test]
fn a_feature_that_the_format_refuses_stops_everything() {
    let host = Host::new();
    fails(
        &host,
        "out.shp",
        &source("shapes.gpkg"),
        &["mixed", "-dsco", "PATCH_SIZE=16", "-dsco", "CHIP_RATE=1", "-dsco", "MESSAGE=0a"],
        &["MESHMARK:out.shp"],
    );
}

#[test]
fn a_feature_that_fails_is_never_skipped() {
    let host = Host::new();
    // Two layers go into one, with the same ids, so every feature of the second fails.
    let more = ["buildings", "landuse", "-nln", "both", "-nlt", "GEOMETRY", "-preserve_fid"];
    for option in [&["-skipfailures"][..], &["-gt", "1"], &["-gt", "7"]] {
        let more = [&more[..], option].concat();
        fails(&host, "out.gpkg", &source("kotka.gpkg"), &more, &["UNIQUE constraint"]);
    }
}

#[test]
fn transactions_of_any_size_make_the_same_map() {
    let host = Host::new();
    let take = |host: &Host| {
        let map = meshmark_host_tests::contents::read(&host.path("out.gpkg"));
        for name in ["out.gpkg", "ref.gpkg", "record.json"] {
            fs::remove_file(host.path(name)).unwrap();
        }
        map
    };
    let mut seen = Vec::new();
    // Without transactions, ogr2ogr of GDAL 3.6 commits nevertheless, which fails as with any
    // database.
    let before = host.files();
    let without = host.create("out.gpkg", &source("kotka.gpkg"), &["-gt", "0"]);
    if without.code == Some(0) {
        seen.push(take(&host));
    } else {
        assert!(without.stderr.contains("MESHMARK:out.gpkg"), "{}", without.stderr);
        assert!(host.files() == before, "{:?}", host.names());
    }
    for size in ["1", "100", "unlimited"] {
        host.create("out.gpkg", &source("kotka.gpkg"), &["-gt", size]).succeeds();
        seen.push(take(&host));
    }
    assert!(seen.windows(2).all(|pair| pair[0] == pair[1]));
}

#[test]
fn a_source_that_ends_early_makes_no_map() {
    let host = Host::new();
    host.run(
        "ogr2ogr",
        &["-f", "FlatGeobuf", "in.fgb", &source("kotka.gpkg"), "buildings", "-lco", "SPATIAL_INDEX=NO"],
    )
    .succeeds();
    let bytes = fs::read(host.path("in.fgb")).unwrap();
    fs::write(host.path("in.fgb"), &bytes[..bytes.len() - bytes.len() / 8]).unwrap();
    for size in ["0", "1", "100000"] {
        fails(&host, "out.gpkg", "in.fgb", &["-gt", size], &["MESHMARK:out.gpkg"]);
    }
}

// --- the bare path, which GDAL does not let a driver refuse --------------------------------------

#[test]
fn without_the_prefix_nothing_marked_is_written_and_a_new_file_is_refused() {
    let host = Host::new();
    let before = host.files();
    let kotka = source("kotka.gpkg");
    let arguments = ["-f", "MESHMARK", "out.gpkg", &kotka, "-dsco", "KEY=key.json", "-dsco", "RECIPIENT=A"];
    let run = host.run("ogr2ogr", &arguments);
    assert_eq!(run.code, Some(1));
    assert!(
        run.stderr.contains("write MESHMARK:") && run.stderr.contains("MESHMARK:out.gpkg"),
        "{}",
        run.stderr
    );
    assert!(host.files() == before);
}

#[test]
fn without_the_prefix_gdal_deletes_a_file_that_is_there_or_extends_it_unmarked() {
    let kotka = source("kotka.gpkg");
    let arguments = ["-f", "MESHMARK", "out.gpkg", &kotka, "-dsco", "KEY=key.json", "-dsco", "RECIPIENT=A"];
    let host = Host::new();
    host.copy("astana.gpkg", "out.gpkg");
    assert_eq!(host.run("ogr2ogr", &arguments).code, Some(1));
    assert!(!host.path("out.gpkg").exists(), "GDAL deleted it before it asked the driver");
    for mode in ["-append", "-update", "-overwrite"] {
        host.copy("astana.gpkg", "out.gpkg");
        let run = host.run("ogr2ogr", &[&arguments[..], &[mode, "-nln", "unmarked", "buildings"]].concat());
        assert_eq!(run.code, Some(0), "GDAL opens it with its own driver: {}", run.stderr);
        assert!(host.run("ogrinfo", &["-so", "out.gpkg", "unmarked"]).stdout.contains("Feature Count: 643"));
        assert!(!host.path("ref.gpkg").exists());
    }
}

// --- hosts that use the library ------------------------------------------------------------------

/// A host in this process. GDAL has one last error per thread, and one set of drivers per process.
struct InProcess {
    host: Host,
    _alone: MutexGuard<'static, ()>,
}

static ALONE: Mutex<()> = Mutex::new(());

impl InProcess {
    fn new() -> Self {
        let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: loading the plugin runs no code; the entry point takes no arguments. It stays
        // loaded, as GDAL keeps its drivers.
        unsafe {
            let plugin = Box::leak(Box::new(Library::new(library()).unwrap()));
            gdal_sys::GDALAllRegister();
            plugin.get::<unsafe extern "C" fn()>(b"RegisterOGRMESHMARK").unwrap()();
            gdal_sys::CPLPushErrorHandler(Some(gdal_sys::CPLQuietErrorHandler));
            gdal_sys::CPLErrorReset();
        }
        InProcess { host: Host::new(), _alone: alone }
    }

    fn create(&self, target: &str, more: &[&str]) -> Open<'_> {
        let path = |name: &str| self.host.path(name).display().to_string();
        let mut options = vec![
            format!("KEY={}", path("key.json")),
            format!("REFERENCE={}", path(&format!("ref_{target}"))),
            "PATCH_SIZE=130".into(),
            "CODE=REPETITION".into(),
            "CHIP_RATE=1".into(),
            "MESSAGE=0123456789abcdef0123456789abcdef".into(),
        ];
        options.extend(more.iter().map(|o| o.to_string()));
        let options: Vec<CString> = options.into_iter().map(|o| CString::new(o).unwrap()).collect();
        let mut list: Vec<*mut c_char> =
            options.iter().map(|o| o.as_ptr().cast_mut()).chain([ptr::null_mut()]).collect();
        let name = CString::new(format!("MESHMARK:{}", path(target))).unwrap();
        // SAFETY: the driver is registered, the strings outlive the calls, zero bands mean vectors.
        let dataset = unsafe {
            let driver = gdal_sys::GDALGetDriverByName(c"MESHMARK".as_ptr());
            gdal_sys::GDALCreate(
                driver,
                name.as_ptr(),
                0,
                0,
                0,
                gdal_sys::GDALDataType::GDT_Unknown,
                list.as_mut_ptr(),
            )
        };
        assert!(!dataset.is_null(), "{:?}", last_failure());
        Open { dataset, _host: self }
    }

    /// Asserts that the files are those from before.
    #[track_caller]
    fn wrote_nothing(&self, words: &str) {
        let failure = last_failure().expect("a failure, and no other message after it");
        assert!(failure.contains(words), "{words:?} is not in: {failure}");
        assert_eq!(self.host.names(), ["key.json"]);
    }

    #[track_caller]
    fn wrote(&self, target: &str) {
        assert_eq!(last_failure(), None);
        let reference = format!("ref_{target}");
        let message = ["--message", "0123456789abcdef0123456789abcdef"];
        let how = ["--code", "repetition", "--chip-rate", "1", "--patch-size", "130", target];
        let (run, report) = self.host.verify(&reference, &[&message[..], &how].concat());
        assert_eq!((run.code, &report["bit_errors"]), (Some(0), &0.into()), "{}", run.stderr);
    }
}

impl Drop for InProcess {
    fn drop(&mut self) {
        // SAFETY: pops what `new` pushed.
        unsafe { gdal_sys::CPLPopErrorHandler() };
    }
}

fn last_failure() -> Option<String> {
    // SAFETY: GDAL's last message is a C string.
    unsafe {
        let failed = gdal_sys::CPLGetLastErrorType() == CPLErr::CE_Failure;
        failed.then(|| CStr::from_ptr(gdal_sys::CPLGetLastErrorMsg()).to_string_lossy().into_owned())
    }
}

struct Open<'a> {
    dataset: GDALDatasetH,
    _host: &'a InProcess,
}

impl Open<'_> {
    fn layer(&self, name: &CStr) -> OGRLayerH {
        // SAFETY: the dataset is open; GDAL copies what it is given.
        unsafe {
            let srs = gdal_sys::OSRNewSpatialReference(ptr::null());
            gdal_sys::OSRImportFromEPSG(srs, 3067);
            let kind = OGRwkbGeometryType::wkbPoint;
            let layer =
                gdal_sys::GDALDatasetCreateLayer(self.dataset, name.as_ptr(), srs, kind, ptr::null_mut());
            gdal_sys::OSRRelease(srs);
            assert!(!layer.is_null(), "{:?}", last_failure());
            let field = gdal_sys::OGR_Fld_Create(c"name".as_ptr(), OGRFieldType::OFTString);
            assert_eq!(gdal_sys::OGR_L_CreateField(layer, field, 1), OGRErr::OGRERR_NONE);
            gdal_sys::OGR_Fld_Destroy(field);
            layer
        }
    }

    /// Writes 200 points, with ids from the given one on.
    fn points(&self, layer: OGRLayerH, first_id: Option<i64>) -> OGRErr::Type {
        let mut result = OGRErr::OGRERR_NONE;
        for i in 0..200 {
            // SAFETY: the layer is open; the feature takes the geometry.
            unsafe {
                let feature = gdal_sys::OGR_F_Create(gdal_sys::OGR_L_GetLayerDefn(layer));
                let point = gdal_sys::OGR_G_CreateGeometry(OGRwkbGeometryType::wkbPoint);
                let (x, y) = (i % 14, i / 14);
                gdal_sys::OGR_G_SetPoint_2D(
                    point,
                    0,
                    3e5 + 50.0 * f64::from(x) + f64::from(i),
                    6.7e6 + 50.0 * f64::from(y),
                );
                gdal_sys::OGR_F_SetGeometryDirectly(feature, point);
                gdal_sys::OGR_F_SetFieldString(feature, 0, c"somewhere".as_ptr());
                if let Some(first) = first_id {
                    gdal_sys::OGR_F_SetFID(feature, first + i64::from(i));
                }
                result = result.max(gdal_sys::OGR_L_CreateFeature(layer, feature));
                gdal_sys::OGR_F_Destroy(feature);
            }
        }
        result
    }

    fn begin(&self) {
        // SAFETY: the dataset is open.
        assert_eq!(unsafe { gdal_sys::GDALDatasetStartTransaction(self.dataset, 0) }, OGRErr::OGRERR_NONE);
    }

    fn commit(&self) -> OGRErr::Type {
        // SAFETY: the dataset is open.
        unsafe { gdal_sys::GDALDatasetCommitTransaction(self.dataset) }
    }

    fn close(self) {
        // SAFETY: the dataset is open, and used no more.
        unsafe { gdal_sys::GDALClose(self.dataset) };
    }
}

#[test]
fn a_dataset_that_is_closed_is_complete() {
    let process = InProcess::new();
    let open = process.create("out.gpkg", &[]);
    let layer = open.layer(c"places");
    open.begin();
    assert_eq!(open.points(layer, None), OGRErr::OGRERR_NONE);
    assert_eq!(open.commit(), OGRErr::OGRERR_NONE);
    // SAFETY: the dataset is open.
    unsafe { gdal_sys::GDALFlushCache(open.dataset) };
    assert!(!process.host.path("out.gpkg").exists(), "to flush is not to finish");
    open.close();
    process.wrote("out.gpkg");
    assert_eq!(process.host.names(), ["key.json", "out.gpkg", "ref_out.gpkg"]);
}

#[test]
fn a_rollback_an_open_transaction_or_a_feature_that_failed_publishes_nothing() {
    let process = InProcess::new();
    let open = process.create("out.gpkg", &[]);
    open.begin();
    open.points(open.layer(c"places"), None);
    // SAFETY: the dataset is open.
    unsafe { gdal_sys::GDALDatasetRollbackTransaction(open.dataset) };
    open.close();
    process.wrote_nothing("a transaction was rolled back");

    let open = process.create("out.gpkg", &[]);
    open.begin();
    open.points(open.layer(c"places"), None);
    open.close();
    process.wrote_nothing("a transaction is still open");

    let open = process.create("out.gpkg", &[]);
    let layer = open.layer(c"places");
    assert_eq!(open.points(layer, Some(7)), OGRErr::OGRERR_NONE);
    assert_ne!(open.points(layer, Some(7)), OGRErr::OGRERR_NONE, "the ids are taken");
    open.close();
    process.wrote_nothing("UNIQUE constraint");

    let open = process.create("out.gpkg", &[]);
    assert_eq!(open.commit(), OGRErr::OGRERR_FAILURE, "there is nothing to commit");
    open.close();
    process.wrote_nothing("out.gpkg");
}

#[test]
fn a_failure_before_closing_publishes_nothing_and_an_old_one_does_not_matter() {
    let process = InProcess::new();
    let fail = || {
        // SAFETY: the format takes no arguments.
        unsafe { gdal_sys::CPLError(CPLErr::CE_Failure, 1, c"the cable was cut".as_ptr()) };
    };
    let open = process.create("out.gpkg", &[]);
    open.points(open.layer(c"places"), None);
    fail();
    open.close();
    process.wrote_nothing("the cable was cut");

    fail();
    let open = process.create("out.gpkg", &[]);
    open.points(open.layer(c"places"), None);
    open.close();
    process.wrote("out.gpkg");
}

#[test]
fn what_comes_into_being_meanwhile_is_not_overwritten() {
    let process = InProcess::new();
    for name in ["out.gpkg", "ref_out.gpkg"] {
        let open = process.create("out.gpkg", &[]);
        open.points(open.layer(c"places"), None);
        fs::write(process.host.path(name), "somebody else's").unwrap();
        open.close();
        assert!(last_failure().unwrap().contains("exists: move it away"));
        assert_eq!(process.host.names().len(), 2, "{:?}", process.host.names());
        assert_eq!(fs::read_to_string(process.host.path(name)).unwrap(), "somebody else's");
        fs::remove_file(process.host.path(name)).unwrap();
    }
    let open = process.create("out.gpkg", &["OVERWRITE=YES"]);
    open.points(open.layer(c"places"), None);
    fs::create_dir(process.host.path("out.gpkg")).unwrap();
    open.close();
    assert!(last_failure().unwrap().contains("replacing"), "a folder cannot be replaced");
    assert_eq!(process.host.names(), ["key.json", "out.gpkg"]);
}

#[test]
fn two_datasets_in_one_folder_leave_each_other_alone() {
    let process = InProcess::new();
    let (one, two) = (process.create("one.gpkg", &[]), process.create("two.gpkg", &[]));
    one.points(one.layer(c"places"), None);
    let three = process.create("three.gpkg", &[]);
    two.points(two.layer(c"places"), Some(1000));
    one.close();
    process.wrote("one.gpkg");
    two.close();
    process.wrote("two.gpkg");
    three.close();
    assert!(last_failure().is_some(), "it has no layer");
    assert_eq!(process.host.names(), ["key.json", "one.gpkg", "ref_one.gpkg", "ref_two.gpkg", "two.gpkg"]);
}
