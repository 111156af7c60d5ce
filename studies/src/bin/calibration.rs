//! Calibrates the likelihood ratios on damaged copies, other recipients and wrong keys.

use clap::Parser;
use meshmark_host_tests::{Result, product::Product};
use meshmark_studies::calibration::{Calibration, Sizes, markdown, study, tippett_plot};
use std::{path::PathBuf, process::ExitCode};

/// Compare likelihood ratios of damaged copies with those of other recipients and of wrong keys.
#[derive(Parser)]
struct Arguments {
    /// Maps in metres
    #[arg(required = true)]
    maps: Vec<PathBuf>,
    /// Folder for calibration.md, .json and .svg
    #[arg(long, default_value = "calibration")]
    out: PathBuf,
    /// Damaged copies of each map
    #[arg(long, default_value_t = 40)]
    copies: usize,
    /// Other recipients for each copy
    #[arg(long, default_value_t = 9000)]
    others: usize,
    /// Wrong keys for each damaged map without a mark, of which there are half as many as copies
    #[arg(long, default_value_t = 2000)]
    keys: usize,
    /// Seed of keys and damage
    #[arg(long, default_value_t = 2003)]
    seed: u64,
}

fn main() -> ExitCode {
    gdal::config::set_error_handler(|_, _, _| {}); // failures come back as errors
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("calibration: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let product = Product::of_this_build()?;
    let Arguments { out, copies, others, keys, seed, .. } = arguments;
    let sizes = Sizes { copies: *copies, others: *others, keys: *keys };
    std::fs::create_dir_all(out)?;
    let (mut all, mut names) = (Calibration::default(), Vec::new());
    for (number, map) in arguments.maps.iter().enumerate() {
        // Every map has its own keys, as scores of one key on two maps are not independent.
        let of_map = study(&product, map, sizes, seed + number as u64)
            .map_err(|error| format!("{}: {error}", map.display()))?;
        all.merge(&of_map);
        names.push(map.file_stem().unwrap_or_default().to_string_lossy().into_owned());
        // A run takes long; one that is stopped leaves the table of its results so far.
        std::fs::write(out.join("calibration.md"), markdown(&all, &names, *seed))?;
        let json = serde_json::json!({ "seed": seed, "maps": names, "calibration": all });
        std::fs::write(out.join("calibration.json"), serde_json::to_string_pretty(&json)? + "\n")?;
        std::fs::write(out.join("calibration.svg"), tippett_plot(&all)?)?;
    }
    println!("{}", markdown(&all, &names, *seed));
    match all.faults() {
        faults if faults.is_empty() => Ok(()),
        faults => Err(faults.join("; ").into()),
    }
}
