//! The cost of the driver for those who do not use it.

use meshmark_host_tests::{Result, process::Run};
use std::{path::Path, process::Command};

/// Number of programs started with the driver, and as many without it in turns.
const STARTS: usize = 60;

/// Returns by how many milliseconds the drivers of `plugins` delay `ogrinfo --formats`: the
/// difference of the medians.
///
/// # Errors
/// Fails when ogrinfo does not run.
pub fn load_ms(plugins: &Path) -> Result<f64> {
    let folder = tempfile::tempdir()?;
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..STARTS {
        for (times, plugins) in times.iter_mut().zip([folder.path(), plugins]) {
            let mut command = Command::new("ogrinfo");
            command.arg("--formats").env("GDAL_DRIVER_PATH", plugins).stdout(std::process::Stdio::null());
            times.push(1e3 * Run::measure(&mut command, folder.path(), &[0])?.seconds);
        }
    }
    let [without, with] = times.map(median);
    Ok(with - without)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    (values[(values.len() - 1) / 2] + values[values.len() / 2]) / 2.0
}
