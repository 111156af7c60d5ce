//! Counts false alarms: p-values of wrong keys and wrong recipients on marked, attacked and
//! unmarked maps.

use clap::Parser;
use meshmark_host_tests::{Result, product::Product};
use meshmark_studies::false_alarms::{markdown, pooled, study, write};
use std::{path::PathBuf, process::ExitCode};

/// Test wrong keys and wrong recipients on marked, attacked and unmarked copies of maps.
#[derive(Parser)]
struct Arguments {
    /// Maps in metres
    #[arg(required = true)]
    maps: Vec<PathBuf>,
    /// Folder for false_alarms.md, .json and .svg
    #[arg(long, default_value = "false_alarms")]
    out: PathBuf,
    /// Wrong keys, and as many wrong recipients, for each of eleven suspects a map
    #[arg(long, default_value_t = 200)]
    count: usize,
    /// Seed of keys and attacks
    #[arg(long, default_value_t = 2003)]
    seed: u64,
}

/// The default significance of `meshmark verify`.
const SIGNIFICANCE: f64 = 1e-6;

fn main() -> ExitCode {
    gdal::config::set_error_handler(|_, _, _| {}); // failures come back as errors
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("false_alarms: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let product = Product::of_this_build()?;
    let mut samples = Vec::new();
    for (number, map) in arguments.maps.iter().enumerate() {
        // Every map has its own keys, as p-values of one key on two maps are not independent.
        let of_map = study(&product, map, arguments.count, arguments.seed + number as u64)
            .map_err(|error| format!("{}: {error}", map.display()))?;
        samples.extend(of_map);
    }
    println!("{}", markdown(&samples, arguments.seed));
    println!("written to {}", write(&arguments.out, &samples, arguments.seed)?.display());
    match pooled(samples.iter()).concat().into_iter().find(|p| *p < SIGNIFICANCE) {
        Some(p) => Err(format!("an innocent would have been accused: p = {p:e}").into()),
        None => Ok(()),
    }
}
