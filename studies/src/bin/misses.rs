//! Counts misses: verdicts on damaged copies that carry the mark, none of which may be "no match".

use clap::Parser;
use meshmark_host_tests::{Result, product::Product};
use meshmark_studies::misses::{markdown, study};
use std::{path::PathBuf, process::ExitCode};

/// Damage marked copies of maps in random ways, and verify them.
#[derive(Parser)]
struct Arguments {
    /// Maps in metres
    #[arg(required = true)]
    maps: Vec<PathBuf>,
    /// Folder for misses.md and .json
    #[arg(long, default_value = "misses")]
    out: PathBuf,
    /// Damaged copies of each map
    #[arg(long, default_value_t = 120)]
    count: usize,
    /// Seed of keys and damage
    #[arg(long, default_value_t = 2003)]
    seed: u64,
}

fn main() -> ExitCode {
    gdal::config::set_error_handler(|_, _, _| {}); // failures come back as errors
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("misses: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let product = Product::of_this_build()?;
    let mut copies = Vec::new();
    std::fs::create_dir_all(&arguments.out)?;
    for (number, map) in arguments.maps.iter().enumerate() {
        let of_map = study(&product, map, arguments.count, arguments.seed + number as u64)
            .map_err(|error| format!("{}: {error}", map.display()))?;
        copies.extend(of_map);
        // A run takes long; one that is stopped leaves the table of its results so far.
        std::fs::write(arguments.out.join("misses.md"), markdown(&copies, arguments.seed))?;
        let json = serde_json::json!({ "seed": arguments.seed, "copies": copies });
        std::fs::write(arguments.out.join("misses.json"), serde_json::to_string_pretty(&json)? + "\n")?;
    }
    println!("{}", markdown(&copies, arguments.seed));
    match copies.iter().filter(|w| w.verdict == "no-match").count() {
        0 => Ok(()),
        missed => Err(format!("{missed} copies that carry the mark would have been excluded").into()),
    }
}
