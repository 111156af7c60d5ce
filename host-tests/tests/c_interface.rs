//! The interface for programs that load the plugin as a library: `plugin/include/meshmark.h`.

use gdal::{
    Dataset, DriverManager, Metadata,
    vector::{Feature, Geometry, Layer, LayerAccess, LayerOptions, OGRwkbGeometryType},
};
use gdal_sys::{GDALDatasetH, OGRLayerH};
use libloading::Library;
use meshmark_host_tests::{
    contents::{self, LayerContents, coords, lengths, moves},
    plugin::{Host, fixture, library},
};
use std::{
    ffi::{CStr, CString, c_char},
    fs, ptr,
    sync::OnceLock,
};

type Filter = unsafe extern "C" fn(GDALDatasetH, *const *const c_char) -> GDALDatasetH;
type Version = unsafe extern "C" fn() -> *const c_char;

fn plugin() -> &'static Library {
    static PLUGIN: OnceLock<Library> = OnceLock::new();
    // SAFETY: loading the plugin runs no code.
    PLUGIN.get_or_init(|| unsafe { Library::new(library()).unwrap() })
}

/// Calls `MeshmarkFilter` with the host's key and more options. A failure holds the message of the
/// one error.
fn filter(host: &Host, source: GDALDatasetH, more: &[&str]) -> Result<Dataset, String> {
    let key = format!("KEY={}", host.path("key.json").display());
    call(source, &[&[key.as_str(), "RECIPIENT=ACME GmbH"], more].concat())
}

fn call(source: GDALDatasetH, options: &[&str]) -> Result<Dataset, String> {
    let options: Vec<CString> = options.iter().map(|option| CString::new(*option).unwrap()).collect();
    let list: Vec<_> = options.iter().map(|o| o.as_ptr()).chain([ptr::null()]).collect();
    // SAFETY: the symbol has this type, the source is open or null, the list ends in null.
    unsafe {
        let meshmark_filter = plugin().get::<Filter>(b"MeshmarkFilter").unwrap();
        quiet(|| {
            let result = meshmark_filter(source, list.as_ptr());
            if !result.is_null() {
                assert_eq!(last_failure(), None);
                return Ok(Dataset::from_c_dataset(result));
            }
            assert_eq!(gdal_sys::CPLGetErrorCounter(), 1, "exactly one message");
            Err(last_failure().expect("a failure"))
        })
    }
}

/// Runs `f` without GDAL's messages on the terminal, and counts them.
fn quiet<T>(f: impl FnOnce() -> T) -> T {
    // SAFETY: the handler is popped after it was pushed.
    unsafe {
        gdal_sys::CPLErrorReset();
        gdal_sys::CPLPushErrorHandler(Some(gdal_sys::CPLQuietErrorHandler));
        let value = f();
        gdal_sys::CPLPopErrorHandler();
        value
    }
}

fn last_failure() -> Option<String> {
    // SAFETY: GDAL's last message is a C string.
    unsafe {
        let failed = gdal_sys::CPLGetLastErrorType() == gdal_sys::CPLErr::CE_Failure;
        failed.then(|| CStr::from_ptr(gdal_sys::CPLGetLastErrorMsg()).to_string_lossy().into_owned())
    }
}

/// Copies a fixture into memory: a dataset without a name or a file.
fn in_memory(fixture_name: &str) -> Dataset {
    let file = Dataset::open(fixture(fixture_name)).unwrap();
    let memory = DriverManager::get_driver_by_name("Memory").unwrap().create_vector_only("").unwrap();
    for layer in file.layers() {
        let name = CString::new(layer.name()).unwrap();
        // SAFETY: both datasets are open.
        unsafe {
            let (to, from) = (memory.c_dataset(), layer.c_layer());
            gdal_sys::GDALDatasetCopyLayer(to, from, name.as_ptr(), ptr::null_mut());
        }
    }
    memory
}

fn c_layer(layer: &Layer) -> OGRLayerH {
    // SAFETY: the handle is used while the layer is borrowed.
    unsafe { layer.c_layer() }
}

fn capability(layer: &Layer, name: &CStr) -> bool {
    // SAFETY: the layer is open.
    unsafe { gdal_sys::OGR_L_TestCapability(c_layer(layer), name.as_ptr()) != 0 }
}

fn only(layers: Vec<LayerContents>, name: &str) -> LayerContents {
    layers.into_iter().find(|layer| layer.name == name).unwrap()
}

#[test]
fn the_version_is_that_of_the_package() {
    // SAFETY: the symbol has this type and returns a C string.
    let version = unsafe { CStr::from_ptr(plugin().get::<Version>(b"MeshmarkVersion").unwrap()()) };
    assert_eq!(version.to_str(), Ok(env!("CARGO_PKG_VERSION")));
}

#[test]
fn a_dataset_in_memory_is_marked_like_the_same_map_in_a_file() {
    let host = Host::new();
    let source = in_memory("kotka.gpkg");
    let before = contents::read_dataset(&source);
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    let marked = contents::read_dataset(&result);
    let (rms, max) = lengths(&moves(&before, &marked));
    assert!((0.05..0.15).contains(&rms) && max <= 0.75, "rms {rms} m, max {max} m");
    host.mark("GPKG", "file.gpkg", &fixture("kotka.gpkg").display().to_string(), &[]).succeeds();
    let file = contents::read(&host.path("file.gpkg"));
    let coords = |layers: &[LayerContents]| layers.iter().map(|l| l.coords()).collect::<Vec<_>>();
    assert!(coords(&marked) == coords(&file));
    drop(result);
    assert!(contents::read_dataset(&source) == before, "the source is as it was");
}

#[test]
fn the_result_is_a_dataset_of_our_driver() {
    let host = Host::new();
    let source = Dataset::open(fixture("kotka.gpkg")).unwrap();
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    assert_eq!(result.driver().short_name(), "MESHMARK");
    assert!(result.description().unwrap().starts_with("MESHMARK:"));
    let layer = result.layer_by_name("roads").unwrap();
    // SAFETY: the handles are open.
    let of_layer = unsafe { gdal_sys::GDALDatasetGetLayerByName(result.c_dataset(), c"roads".as_ptr()) };
    assert_eq!(of_layer, c_layer(&layer));
}

#[test]
fn failures_come_as_null_and_one_message() {
    let host = Host::new();
    let source = Dataset::open(fixture("kotka.gpkg")).unwrap();
    let handle = source.c_dataset();
    assert!(call(ptr::null_mut(), &[]).unwrap_err().contains("the source is NULL"));
    assert!(call(handle, &[]).unwrap_err().contains("neither RECIPIENT nor MESSAGE"));
    assert!(call(handle, &["RECIPIENT=ACME"]).unwrap_err().contains("no KEY"));
    assert!(filter(&host, handle, &["MESSAGE=00"]).unwrap_err().contains("give exactly one"));
    assert!(filter(&host, handle, &["PATCH_SIZE"]).unwrap_err().contains("not NAME=VALUE"));
    assert!(filter(&host, handle, &["LAYERS=rivers"]).unwrap_err().contains("\"rivers\""));
    let error = filter(&host, handle, &["PATCH_SIZE=4096"]).unwrap_err();
    assert!(error.contains("kotka.gpkg") && error.contains("use PATCH_SIZE=3833"), "{error}");
    let result = filter(&host, handle, &[]).unwrap();
    assert!(filter(&host, result.c_dataset(), &[]).unwrap_err().contains("marked view already"));
}

#[test]
fn filters_on_the_source_are_cleared_so_that_the_whole_map_is_marked() {
    let host = Host::new();
    let source = Dataset::open(fixture("kotka.gpkg")).unwrap();
    let mut buildings = source.layer_by_name("buildings").unwrap();
    buildings.set_attribute_filter("fid < 10").unwrap();
    buildings.set_spatial_filter_rect(497000.0, 6710700.0, 497001.0, 6710701.0);
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    let marked = contents::read_dataset(&result);
    assert_eq!(moves(&contents::read(&fixture("kotka.gpkg")), &marked).len(), 3833);
}

#[test]
fn the_result_holds_its_source_when_the_caller_releases_it() {
    let host = Host::new();
    let source = in_memory("kotka.gpkg");
    let before = contents::read_dataset(&source);
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    // SAFETY: the result holds another reference; the wrapper must not close the dataset again.
    unsafe { gdal_sys::GDALReleaseDataset(source.c_dataset()) };
    std::mem::forget(source);
    assert_eq!(moves(&before, &contents::read_dataset(&result)).len(), 3833);
}

#[test]
fn random_reads_are_those_of_the_stream() {
    let host = Host::new();
    let source = Dataset::open(fixture("kotka.gpkg")).unwrap();
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    let roads = only(contents::read_dataset(&result), "roads");
    let layer = result.layer_by_name("roads").unwrap();
    let geometry = |feature: &Feature| feature.geometry().map(|g| g.iso_wkb().unwrap());
    for (index, expected) in roads.features.iter().enumerate().step_by(17) {
        let by_id = layer.feature(expected.fid.unwrap()).unwrap();
        assert!(geometry(&by_id) == expected.geometries[0]);
        // SAFETY: the layer is open; the feature is destroyed after its last use.
        unsafe {
            assert_eq!(
                gdal_sys::OGR_L_SetNextByIndex(c_layer(&layer), index as i64),
                gdal_sys::OGRErr::OGRERR_NONE
            );
            let next = gdal_sys::OGR_L_GetNextFeature(c_layer(&layer));
            assert_eq!(gdal_sys::OGR_F_GetFID(next), expected.fid.unwrap() as i64);
            gdal_sys::OGR_F_Destroy(next);
        }
    }
    assert!(quiet(|| layer.feature(1_000_000).is_none()), "a feature that does not exist");
}

#[test]
fn counts_agree_with_what_is_read_under_any_filter() {
    let host = Host::new();
    let source = Dataset::open(fixture("kotka.gpkg")).unwrap();
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    let mut layer = result.layer_by_name("roads").unwrap();
    let all = layer.features().count();
    assert_eq!((layer.feature_count(), all), (110, 110));
    layer.set_spatial_filter_rect(497000.0, 6710700.0, 497400.0, 6711000.0);
    let near = layer.features().count();
    assert_eq!(layer.feature_count(), near as u64);
    assert!(near > 0 && near < all);
    layer.set_attribute_filter("kind = 'service'").unwrap();
    let both = layer.features().count();
    assert_eq!(layer.feature_count(), both as u64);
    layer.clear_spatial_filter();
    let service = layer.features().count();
    assert!(both < near && both < service && service < all, "{both}, {near}, {service}, {all}");
    layer.set_attribute_filter("OGR_GEOMETRY = 'LINESTRING' AND kind = 'service'").unwrap();
    assert_eq!((layer.feature_count(), layer.features().count()), (service as u64, service));
    layer.clear_attribute_filter();
    assert_eq!((layer.feature_count(), layer.features().count()), (110, 110));
}

#[test]
fn measuring_the_extent_keeps_filters_and_sees_all_features() {
    let host = Host::new();
    let source = Dataset::open(fixture("kotka.gpkg")).unwrap();
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    let mut layer = result.layer_by_name("roads").unwrap();
    let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for [x, y] in only(contents::read_dataset(&result), "roads").coords() {
        bounds = [bounds[0].min(x), bounds[1].min(y), bounds[2].max(x), bounds[3].max(y)];
    }
    layer.set_attribute_filter("kind = 'service'").unwrap();
    let service = layer.features().count();
    assert!(!capability(&layer, c"FastGetExtent") && layer.try_get_extent().unwrap().is_none());
    let extent = layer.get_extent().unwrap();
    assert_eq!([extent.MinX, extent.MinY, extent.MaxX, extent.MaxY], bounds);
    assert!(capability(&layer, c"FastGetExtent"));
    assert_eq!(layer.features().count(), service, "the filter is still there");
}

/// Returns a layer with two geometry columns: the outline of a square, and its centre as a point.
fn two_columns() -> Dataset {
    let mut dataset = DriverManager::get_driver_by_name("Memory").unwrap().create_vector_only("").unwrap();
    let srs = gdal::spatial_ref::SpatialRef::from_epsg(3067).unwrap();
    let options =
        LayerOptions { name: "squares", srs: Some(&srs), ty: OGRwkbGeometryType::wkbPolygon, options: None };
    dataset.create_layer(options).unwrap();
    let layer = dataset.layer(0).unwrap();
    // SAFETY: the layer is open, and copies the definition and the features it is given.
    unsafe {
        let column = gdal_sys::OGR_GFld_Create(c"centre".as_ptr(), OGRwkbGeometryType::wkbPoint);
        gdal_sys::OGR_GFld_SetSpatialRef(column, srs.to_c_hsrs());
        gdal_sys::OGR_L_CreateGeomField(c_layer(&layer), column, 1);
        gdal_sys::OGR_GFld_Destroy(column);
        for i in 0..300 {
            let (x, y) = (300000 + 40 * (i % 20) + i * i % 11, 6700000 + 40 * (i / 20) + i * i % 7);
            let (x2, y2) = (x + 20 + i % 3, y + 20);
            let square = format!("POLYGON (({x} {y},{x2} {y},{x2} {y2},{x} {y2},{x} {y}))");
            let centre = format!("POINT ({} {})", x + 10, y + 10);
            let feature = gdal_sys::OGR_F_Create(gdal_sys::OGR_L_GetLayerDefn(c_layer(&layer)));
            for (column, wkt) in [square, centre].iter().enumerate() {
                let geometry = Geometry::from_wkt(wkt).unwrap();
                gdal_sys::OGR_F_SetGeomField(feature, column as i32, geometry.c_geometry());
            }
            gdal_sys::OGR_L_CreateFeature(c_layer(&layer), feature);
            gdal_sys::OGR_F_Destroy(feature);
        }
    }
    dataset
}

#[test]
fn every_geometry_column_is_marked_and_filtered_by_its_own_place() {
    let host = Host::new();
    let source = two_columns();
    let before = contents::read_dataset(&source);
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    let after = contents::read_dataset(&result);
    let moves = moves(&before, &after);
    assert!(moves.len() > 1400 && moves.iter().all(|(from, to)| from != to), "{}", moves.len());

    let layer = result.layer(0).unwrap();
    let count_near = |column: i32, [x, y]: [f64; 2]| {
        let d = 1e-4;
        // SAFETY: the layer is open.
        unsafe {
            gdal_sys::OGR_L_SetSpatialFilterRectEx(c_layer(&layer), column, x - d, y - d, x + d, y + d)
        };
        layer.feature_count()
    };
    let centre = |layers: &[LayerContents]| coords(layers[0].features[7].geometries[1].as_ref().unwrap())[0];
    let corner = coords(after[0].features[7].geometries[0].as_ref().unwrap())[0];
    assert_eq!((count_near(1, centre(&after)), count_near(1, centre(&before))), (1, 0));
    assert_eq!((count_near(0, corner), count_near(1, corner)), (1, 0));
}

#[test]
fn geometry_keeps_its_spatial_reference() {
    let host = Host::new();
    let source = Dataset::open(fixture("kotka.gpkg")).unwrap();
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    let mut layer = result.layer_by_name("roads").unwrap();
    let of_layer = layer.spatial_ref().unwrap();
    let feature = layer.features().next().unwrap();
    let of_geometry = feature.geometry().unwrap().spatial_ref().unwrap();
    assert!(of_geometry == of_layer && of_layer.auth_code().unwrap() == 3067);
}

#[test]
fn ignored_fields_are_not_read_but_a_filter_still_sees_geometry() {
    let host = Host::new();
    let source = Dataset::open(fixture("kotka.gpkg")).unwrap();
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    let mut layer = result.layer_by_name("roads").unwrap();
    layer.set_spatial_filter_rect(497000.0, 6710700.0, 497400.0, 6711000.0);
    let expected: Vec<_> = layer.features().map(|f| f.fid()).collect();
    assert!(!expected.is_empty() && expected.len() < 110);
    let names = [c"kind".as_ptr(), c"OGR_GEOMETRY".as_ptr(), ptr::null()];
    // SAFETY: the layer is open and the list ends in null.
    unsafe { gdal_sys::OGR_L_SetIgnoredFields(c_layer(&layer), names.as_ptr().cast_mut()) };
    let seen: Vec<_> = layer.features().map(|f| (f.fid(), f.geometry_by_index(0).is_ok())).collect();
    assert_eq!(seen, expected.iter().map(|fid| (*fid, false)).collect::<Vec<_>>());
    let kind = |f: &Feature| f.field_as_string(f.field_index("kind").unwrap()).unwrap().unwrap_or_default();
    assert!(layer.features().all(|f| kind(&f).is_empty()));
    // SAFETY: as above; null reads everything again.
    unsafe { gdal_sys::OGR_L_SetIgnoredFields(c_layer(&layer), ptr::null_mut()) };
    assert!(layer.features().all(|f| f.geometry_by_index(0).is_ok() && !kind(&f).is_empty()));
}

#[test]
fn nothing_can_be_written_and_no_capability_says_so() {
    let host = Host::new();
    let source = in_memory("kotka.gpkg");
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    let layer = result.layer_by_name("roads").unwrap();
    for name in
        [c"SequentialWrite", c"RandomWrite", c"CreateField", c"DeleteFeature", c"Transactions", c"Rename"]
    {
        assert!(!capability(&layer, name), "{name:?}");
    }
    let own = source.layer_by_name("roads").unwrap();
    for name in [c"RandomRead", c"FastFeatureCount", c"FastSetNextByIndex", c"StringsAsUTF8", c"IgnoreFields"]
    {
        assert_eq!(capability(&layer, name), capability(&own, name), "{name:?}");
    }
    // SAFETY: the layer is open.
    unsafe {
        let deleted = quiet(|| gdal_sys::OGR_L_DeleteFeature(c_layer(&layer), 1));
        assert_ne!(deleted, gdal_sys::OGRErr::OGRERR_NONE);
        assert_eq!(gdal_sys::GDALDatasetTestCapability(result.c_dataset(), c"CreateLayer".as_ptr()), 0);
    }
}

#[test]
fn a_vertex_that_came_after_marking_ends_reading_with_a_failure() {
    let host = Host::new();
    let source = in_memory("kotka.gpkg");
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    let own = source.layer_by_name("roads").unwrap();
    let mut changed = own.feature(4).unwrap();
    changed.set_geometry(Geometry::from_wkt("LINESTRING (497000 6710700,497001 6710701)").unwrap()).unwrap();
    own.set_feature(changed).unwrap();

    let layer = result.layer_by_name("roads").unwrap();
    let read_all = || {
        quiet(|| {
            // SAFETY: the layer is open; every feature is destroyed.
            let next = || unsafe { gdal_sys::OGR_L_GetNextFeature(c_layer(&layer)) };
            let mut count = 0;
            let mut feature = next();
            while !feature.is_null() {
                count += 1;
                // SAFETY: it was not destroyed yet.
                unsafe { gdal_sys::OGR_F_Destroy(feature) };
                feature = next();
            }
            (count, last_failure(), next().is_null())
        })
    };
    let (count, failure, stays_ended) = read_all();
    let failure = failure.expect("a failure, not an unmarked coordinate");
    assert!(
        failure.contains("layer \"roads\", feature 4") && failure.contains("(497000, 6710700)"),
        "{failure}"
    );
    assert!(count == 3 && stays_ended);
    // SAFETY: the layer is open.
    unsafe { gdal_sys::OGR_L_ResetReading(c_layer(&layer)) };
    assert!(read_all().1.is_some(), "and again after a reset");
    assert!(quiet(|| layer.feature(4).is_none() && last_failure().is_some()), "nor by its id");
}

#[test]
fn a_feature_that_went_after_marking_is_missed_at_the_end_of_its_layer() {
    let host = Host::new();
    let source = in_memory("kotka.gpkg");
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    let mut layer = result.layer_by_name("roads").unwrap();
    let mut read = || quiet(|| (layer.features().count(), last_failure()));
    assert_eq!(read(), (110, None));
    let own = source.layer_by_name("roads").unwrap();
    // SAFETY: the layer is open.
    assert_eq!(unsafe { gdal_sys::OGR_L_DeleteFeature(c_layer(&own), 4) }, gdal_sys::OGRErr::OGRERR_NONE);
    let (count, failure) = read();
    assert_eq!(count, 109);
    let failure = failure.expect("a failure, not a layer that is said to be whole");
    assert!(failure.contains("layer \"roads\" has 110 features, and 109 of them came out"), "{failure}");
    layer.set_attribute_filter("FID <> 5").unwrap();
    assert_eq!(quiet(|| (layer.features().count(), last_failure())), (108, None), "a filter drops features");
}

#[test]
fn a_file_that_changes_after_marking_is_noticed() {
    let host = Host::new();
    host.copy("kotka.gpkg", "map.gpkg");
    let source = Dataset::open(host.path("map.gpkg")).unwrap();
    let result = filter(&host, source.c_dataset(), &[]).unwrap();
    let mut layer = result.layer_by_name("roads").unwrap();
    assert_eq!(layer.features().count(), 110);
    let later =
        fs::metadata(host.path("map.gpkg")).unwrap().modified().unwrap() + std::time::Duration::from_secs(1);
    fs::File::options().write(true).open(host.path("map.gpkg")).unwrap().set_modified(later).unwrap();
    let failure = quiet(|| {
        layer.features().for_each(drop);
        last_failure()
    });
    assert!(failure.is_some_and(|f| f.contains("map.gpkg was changed")));
}
