//! The progress of a marking, where its user wants to see it.
//!
//! GDAL gives no driver the callback of its host. For `ogr2ogr -progress` the driver therefore draws
//! a bar of its own on stdout, before that of the features when it reads a map and after it when it
//! writes one. All other hosts see nothing, and nothing is drawn into a map that goes to stdout.

use crate::{ffi_progress::draw, output::ogr2ogr_arguments};
use std::sync::{Mutex, PoisonError};

/// The share of the time of an export that the patches take; writing and reading back take the rest.
const OF_PATCHES: f64 = 0.8;

/// A progress bar.
pub struct Bar {
    /// How many patches are done of how many; `None` where nobody wants to see it.
    patches: Option<Mutex<(usize, usize)>>,
}

impl Bar {
    /// Returns the bar that the host of this process wants.
    pub fn wanted() -> Self {
        let is_wanted = ogr2ogr_arguments().is_some_and(|rest| is_wanted(&rest));
        Bar { patches: is_wanted.then(Mutex::default) }
    }

    /// Begins with so many patches.
    pub fn begin(&self, patches: usize) {
        self.update(|progress| *progress = (0, patches.max(1)));
    }

    /// Counts a patch; any thread may do so.
    pub fn step(&self) {
        self.update(|(done, _)| *done += 1);
    }

    fn update(&self, change: impl FnOnce(&mut (usize, usize))) {
        if let Some(patches) = &self.patches {
            let mut progress = patches.lock().unwrap_or_else(PoisonError::into_inner);
            change(&mut progress);
            let (done, all) = *progress;
            draw(OF_PATCHES * done.min(all) as f64 / all as f64);
        }
    }

    /// Ends the bar of a job that is done.
    pub fn end(&self) {
        if self.patches.is_some() {
            draw(1.0);
        }
    }
}

/// Returns whether these arguments of ogr2ogr ask for a bar, and leave stdout to it.
fn is_wanted(arguments: &[String]) -> bool {
    let is_stdout = |word: &str| {
        let places = ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"];
        word.contains("/vsistdout") || places.iter().any(|place| word.ends_with(place))
    };
    arguments.iter().any(|word| word == "-progress") && !arguments.iter().any(|word| is_stdout(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_is_drawn_where_it_is_asked_for_and_into_no_map() {
        let wanted = |line: &str| is_wanted(&line.split(' ').map(String::from).collect::<Vec<_>>());
        assert!(wanted("-progress out.gpkg MESHMARK:map.gpkg"));
        assert!(wanted("-f MESHMARK MESHMARK:out.gpkg map.gpkg -progress"));
        assert!(!wanted("out.gpkg MESHMARK:map.gpkg"));
        for stdout in ["/vsistdout/", "/vsistdout_redirect/out.json", "/dev/stdout", "/vsigzip//vsistdout/"] {
            assert!(!wanted(&format!("-progress -f GeoJSON {stdout} MESHMARK:map.gpkg")), "{stdout}");
        }
    }
}
