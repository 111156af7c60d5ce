//! The versions of the programs that a result depends on.

/// Returns the versions of this program and of GDAL, which reads the maps.
pub fn versions() -> Vec<String> {
    let gdal = gdal::version::VersionInfo::release_name();
    vec![format!("meshmark {}", env!("CARGO_PKG_VERSION")), format!("GDAL {gdal}")]
}
