//! Counts whom the verifier names when recipients mix their copies: `coalitions MAP...`

use clap::Parser;
use meshmark_host_tests::{Result, product::Product};
use meshmark_studies::coalitions::{markdown, study};
use std::{path::PathBuf, process::ExitCode};

/// Mix the copies of recipients in seven ways, and verify the mixtures.
#[derive(Parser)]
struct Arguments {
    /// Maps
    #[arg(required = true)]
    maps: Vec<PathBuf>,
    /// Folder for coalitions.md and .json
    #[arg(long, default_value = "coalitions")]
    out: PathBuf,
    /// Numbers of members
    #[arg(long, value_delimiter = ',', default_value = "2,4,8,16,32")]
    sizes: Vec<usize>,
    /// Seed of keys and mosaics
    #[arg(long, default_value_t = 2003)]
    seed: u64,
    /// Folder of `meshmark` and `gdalplugins/` [default: that of this program]
    #[arg(long)]
    tools: Option<PathBuf>,
}

fn main() -> ExitCode {
    gdal::config::set_error_handler(|_, _, _| {}); // failures come back as errors
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("coalitions: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let product = match &arguments.tools {
        Some(folder) => Product::in_folder(folder)?,
        None => Product::of_this_build()?,
    };
    std::fs::create_dir_all(&arguments.out)?;
    let mut coalitions = Vec::new();
    for map in &arguments.maps {
        let of_map = study(&product, map, &arguments.sizes, arguments.seed)
            .map_err(|error| format!("{}: {error}", map.display()))?;
        coalitions.extend(of_map);
        // A run takes long; one that is stopped leaves the table of its results so far.
        let table = markdown(&coalitions, arguments.seed);
        std::fs::write(arguments.out.join("coalitions.md"), table)?;
        let json = serde_json::json!({ "seed": arguments.seed, "coalitions": coalitions });
        std::fs::write(arguments.out.join("coalitions.json"), serde_json::to_string_pretty(&json)? + "\n")?;
    }
    println!("{}", markdown(&coalitions, arguments.seed));
    match coalitions.iter().map(|c| c.accused).sum() {
        0 => Ok(()),
        accused => Err(format!("{accused} recipients who are no members are named").into()),
    }
}
