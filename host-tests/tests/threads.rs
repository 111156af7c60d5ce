//! A process may fork between two jobs of the driver, as Python's `multiprocessing` does: a child
//! has none of the threads of its parent, and would wait for ever for what one of them is to do.
//! The only test of this process, because it counts the threads.

use gdal::{
    Dataset, DatasetOptions, DriverManager,
    raster::RasterCreationOptions,
    vector::{Geometry, LayerAccess, LayerOptions, OGRwkbGeometryType},
};
use libloading::Library;
use meshmark_host_tests::plugin::{Host, library};
use std::fs;

fn threads() -> usize {
    fs::read_dir("/proc/self/task").unwrap().count()
}

/// Returns a place of a map that is too large to be sorted by one thread.
fn place(number: u32) -> [f64; 2] {
    let (row, column) = (number / 250, number % 250);
    let uneven = f64::from(number * 7 % 11);
    [25_496_000.0 + 9.0 * f64::from(column) + uneven / 3.0, 6_672_000.0 + 9.0 * f64::from(row) - uneven / 5.0]
}

#[test]
fn no_thread_of_the_driver_outlives_its_job() {
    let host = Host::new();
    // SAFETY: loading the plugin runs no code; the symbol has this type.
    let plugin = unsafe { Library::new(library()).unwrap() };
    DriverManager::register_all();
    // SAFETY: as above.
    unsafe { plugin.get::<unsafe extern "C" fn()>(b"RegisterOGRMESHMARK").unwrap()() };
    let key = format!("KEY={}", host.path("key.json").display());
    let before = threads();

    let [reference, record] = ["ref.gpkg", "record.json"].map(|name| host.path(name).display().to_string());
    let options =
        [key.clone(), "RECIPIENT=A".into(), format!("REFERENCE={reference}"), format!("RECORD={record}")];
    let options = RasterCreationOptions::from_iter(options);
    let written = format!("MESHMARK:{}", host.path("out.gpkg").display());
    let driver = DriverManager::get_driver_by_name("MESHMARK").unwrap();
    let mut dataset = driver.create_with_band_type_with_options::<u8, _>(written, 0, 0, 0, &options).unwrap();
    let srs = gdal::spatial_ref::SpatialRef::from_epsg(3879).unwrap();
    let ty = OGRwkbGeometryType::wkbPoint;
    let mut layer = dataset
        .create_layer(LayerOptions { name: "trees", srs: Some(&srs), ty, ..Default::default() })
        .unwrap();
    for [x, y] in (0..50_000).map(place) {
        layer.create_feature(Geometry::from_wkt(&format!("POINT ({x} {y})")).unwrap()).unwrap();
    }
    dataset.close().unwrap();
    assert_eq!(threads(), before, "after writing");

    let options = [&*key, "RECIPIENT=B"];
    let options = DatasetOptions { open_options: Some(&options), ..DatasetOptions::default() };
    let marked = Dataset::open_ex(format!("MESHMARK:{reference}"), options).unwrap();
    assert_eq!(threads(), before, "after reading");
    assert_eq!(marked.layer(0).unwrap().features().count(), 50_000);
}
