//! The versions of the programs that a result depends on.

use gdal::version::VersionInfo;

/// Libraries of GDAL that it computes with, by their names in its description.
const LIBRARIES: [[&str; 2]; 2] = [["GEOS", "GEOS_VERSION"], ["PROJ", "PROJ_RUNTIME_VERSION"]];

/// Returns the versions of this program and of GDAL, which reads the maps, with its libraries.
pub fn versions() -> Vec<String> {
    let own =
        [format!("meshmark {}", env!("CARGO_PKG_VERSION")), format!("GDAL {}", VersionInfo::release_name())];
    let described = VersionInfo::build_info();
    let library = |[name, key]: &[&str; 2]| Some(format!("{name} {}", described.get(*key)?));
    own.into_iter().chain(LIBRARIES.iter().filter_map(library)).collect()
}
