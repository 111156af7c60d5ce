//! The names of marked views: `MESHMARK:` followed by the name of a dataset opens that dataset with
//! marked geometry.

use std::{ffi::OsStr, os::unix::ffi::OsStrExt};

/// The prefix of the name of a marked view, in any case. `plugin/cpp/shim.h` has the same.
pub const PREFIX: &str = "MESHMARK:";

/// Returns whether this is the name of a marked view.
pub fn is_named_by(name: impl AsRef<OsStr>) -> bool {
    let start = name.as_ref().as_bytes().get(..PREFIX.len());
    start.is_some_and(|start| start.eq_ignore_ascii_case(PREFIX.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prefix_in_any_case_names_a_marked_view() {
        for name in ["MESHMARK:map.gpkg", "meshmark:map.gpkg", "MeshMark:"] {
            assert!(is_named_by(name), "{name}");
        }
        for name in ["", "MESHMARK", "map.gpkg", " MESHMARK:map.gpkg", "MESHMÄRK:map.gpkg"] {
            assert!(!is_named_by(name), "{name}");
        }
    }
}
