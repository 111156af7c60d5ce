use std::thread::available_parallelism;

/// Returns how many threads the user of GDAL allows: the configuration option GDAL_NUM_THREADS, a
/// number or ALL_CPUS, which is the default.
pub fn threads() -> usize {
    let all = available_parallelism().map_or(1, usize::from);
    let given = gdal::config::get_config_option("GDAL_NUM_THREADS", "").unwrap_or_default();
    given.parse().map_or(all, |threads: usize| threads.clamp(1, 256))
}
