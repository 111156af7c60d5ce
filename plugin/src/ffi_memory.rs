//! The memory that written datasets leave behind: none.

use crate::ffi_output::{Field, LayerSpec, Output};
use gdal_sys::OGRwkbGeometryType;
use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    path::Path,
    ptr,
};

/// The system's allocator, which counts the bytes in use for each thread.
struct Counting;

thread_local!(static IN_USE: Cell<isize> = const { Cell::new(0) });

// SAFETY: every call is passed on unchanged; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        IN_USE.set(IN_USE.get() + layout.size() as isize);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        IN_USE.set(IN_USE.get() - layout.size() as isize);
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Writes a dataset of a layer and ends it.
fn write(end: fn(Output)) {
    let mut output = Output::create("Memory", Path::new("")).unwrap();
    let options = vec![("ADVERTIZE_UTF8".into(), "YES".into())];
    // SAFETY: null is no reference.
    let spec =
        unsafe { LayerSpec::new("a".into(), ptr::null_mut(), OGRwkbGeometryType::wkbUnknown, options) };
    output.add_layer(&spec, false).unwrap();
    output.add_field(0, &Field::text("b".into()), false, false).unwrap();
    output.write(0, &output.feature(0), false).unwrap();
    end(output);
}

#[test]
fn a_dataset_that_was_written_leaves_no_memory_behind() {
    gdal::DriverManager::register_all();
    for end in [|output: Output| output.close().unwrap(), drop] {
        write(end); // what is allocated once
        let before = IN_USE.get();
        (0..3).for_each(|_| write(end));
        assert_eq!(IN_USE.get(), before, "bytes in use");
    }
}
