//! Compiles the C++ shim against the GDAL that `gdal-config` (or `$GDAL_CONFIG`) describes.

use std::{env, process::Command};

const SOURCES: [&str; 4] = ["cpp/driver.cpp", "cpp/dataset.cpp", "cpp/layer.cpp", "cpp/output.cpp"];
const HEADERS: [&str; 2] = ["cpp/shim.h", "include/meshmark.h"];

fn main() {
    for path in SOURCES.iter().chain(&HEADERS) {
        println!("cargo::rerun-if-changed={path}");
    }
    println!("cargo::rerun-if-env-changed=GDAL_CONFIG");
    cc::Build::new()
        .cpp(true)
        .std("c++17")
        .warnings(true)
        .flag("-fvisibility=hidden")
        .flags(gdal_cflags())
        .include("include")
        .files(SOURCES)
        .compile("meshmark_shim");
    // The shim's calls into Rust stay in this library, whatever else the host has loaded.
    println!("cargo::rustc-cdylib-link-arg=-Wl,-Bsymbolic");
}

/// Include folders become system ones, so that warnings are about our own code.
fn gdal_cflags() -> Vec<String> {
    let program = env::var("GDAL_CONFIG").unwrap_or_else(|_| "gdal-config".into());
    let output = Command::new(&program)
        .arg("--cflags")
        .output()
        .unwrap_or_else(|e| panic!("{program} cannot be run ({e}): install libgdal-dev or set GDAL_CONFIG"));
    assert!(output.status.success(), "{program} --cflags failed");
    let flags = String::from_utf8(output.stdout).expect("compiler flags are text");
    flags.split_whitespace().map(|flag| flag.replacen("-I", "-isystem", 1)).collect()
}
