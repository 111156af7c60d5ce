//! Measures the cost of marking and verifying beside plain `ogr2ogr` and a numpy script, from
//! thousands of vertices to millions. The program prints a Markdown table with a column for every
//! map and tiling, and writes it with JSON and plots. It uses the `meshmark` and the driver beside
//! it.
//!
//! Processes run in turns, as a user runs them; stages are timed in this process. Nothing is
//! asserted, as times depend on the machine and its load.

mod job;
mod report;
mod stages;
mod startup;

use clap::Parser;
use job::{Jobs, Programs};
use meshmark_host_tests::{Result, attacks::Map, product::Product, tiling::tile};
use startup::load_ms;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Measures plain ogr2ogr, the driver, a numpy script and the verifier.
#[derive(Parser)]
struct Arguments {
    /// Maps, the smallest first.
    #[arg(required = true)]
    maps: Vec<PathBuf>,
    /// Numbers of copies of the last map, side by side, to measure as well.
    #[arg(long, value_delimiter = ',')]
    tiles: Vec<usize>,
    /// A Python with the requirements of the numpy script, and the script.
    #[arg(long, num_args = 2)]
    script: Option<Vec<PathBuf>>,
    /// The folder for bench.md, bench.json and the plots.
    #[arg(long)]
    out: PathBuf,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    gdal::config::set_error_handler(|_, _, _| ()); // warnings about a map do not matter here
    fs::create_dir_all(&arguments.out)?;
    let programs = programs(arguments.script)?;
    let load_ms = load_ms(programs.product.plugins())?;
    let mut all = Vec::new();
    for map in &arguments.maps {
        all.push(measure(&programs, map, Map::read(map)?.vertices()?.len())?);
    }
    let last = arguments.maps.last().ok_or("no map was given")?;
    for copies in arguments.tiles {
        let folder = tempfile::tempdir()?;
        let stem = last.file_stem().unwrap_or_default().to_string_lossy();
        let path = folder.path().join(format!("{stem}_x{copies}.gpkg"));
        let vertices = {
            let tiled = tile(&Map::read(last)?, copies);
            tiled.write(&path)?;
            tiled.vertices()?.len()
        };
        all.push(measure(&programs, &path, vertices)?);
    }
    let text = report::markdown(&all, load_ms);
    print!("{text}");
    fs::write(arguments.out.join("bench.md"), text)?;
    fs::write(arguments.out.join("bench.json"), serde_json::to_string_pretty(&all)?)?;
    for (name, svg) in report::plots(&all)? {
        fs::write(arguments.out.join(format!("bench_{name}.svg")), svg)?;
    }
    Ok(())
}

fn measure(programs: &Programs, map: &Path, vertices: usize) -> Result<Jobs> {
    eprintln!("measuring {}: {vertices} vertices", map.display());
    let map = map.canonicalize()?;
    Jobs::measure(programs, &map, vertices).map_err(|error| format!("{}: {error}", map.display()).into())
}

fn programs(script: Option<Vec<PathBuf>>) -> Result<Programs> {
    let script =
        script.map(|paths| paths.iter().map(std::path::absolute).collect::<std::io::Result<Vec<_>>>());
    let script = script.transpose()?.and_then(|paths| paths.try_into().ok());
    Ok(Programs { product: Product::of_this_build()?, script })
}
