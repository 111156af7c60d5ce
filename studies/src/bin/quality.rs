//! Measures the effect of marking on maps: `quality MAP...` marks each with every SHAPE and BASIS
//! through the driver, compares it with the original by `meshmark compare`, and prints a Markdown
//! table. It fails when a polygon becomes invalid, or two polygons newly overlap.

use clap::Parser;
use meshmark_core::{
    key::SecretKey,
    options::{Laplacian, Rigidity},
};
use meshmark_host_tests::{Result, product::Product};
use serde_json::Value;
use std::{
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Measure the effect of marking on the shape and topology of maps.
#[derive(Parser)]
struct Arguments {
    /// Maps
    #[arg(required = true)]
    maps: Vec<PathBuf>,
    /// A further option of the driver, for example AMPLITUDE=0.2; repeatable
    #[arg(long, value_name = "NAME=VALUE")]
    option: Vec<String>,
    /// Output grid, CRS units
    #[arg(long)]
    precision: Option<String>,
    /// Only these shapes
    #[arg(long, value_delimiter = ',')]
    shapes: Vec<String>,
}

fn main() -> ExitCode {
    match run(Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => {
            eprintln!("quality: marking made polygons invalid or overlap");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("quality: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Returns whether every map kept its quality.
fn run(Arguments { maps, mut option, precision, shapes }: Arguments) -> Result<bool> {
    option.extend(precision.iter().map(|precision| format!("PRECISION={precision}")));
    let work = Work::new(option, precision)?;
    let is_wanted = |shape: &str| shapes.is_empty() || shapes.iter().any(|wanted| wanted == shape);
    println!("{HEADER}");
    let mut good = true;
    for map in &maps {
        for shape in Rigidity::NAMES.into_iter().filter(|shape| is_wanted(shape)) {
            for basis in Laplacian::NAMES {
                let marked = work.mark(map, shape, basis).map_err(|e| format!("{}: {e}", map.display()))?;
                println!("{}", row(map, shape, basis, &marked));
                good &= marked.number("/validity/newly_invalid") == 0.0;
                good &= marked.number("/overlaps/new") == 0.0;
            }
        }
    }
    Ok(good)
}

const HEADER: &str = "\
| map | shape | basis | vertices | T-junctions | attenuated | invalid, new | overlaps, new, new slivers | crossings, new and lost | angle change, mean and p99 (°) | right angles kept | area change, mean and p99 (%) | RMS (m) |
|---|---|---|---|---|---|---|---|---|---|---|---|---|";

fn row(map: &Path, shape: &str, basis: &str, marked: &Marked) -> String {
    let n = |pointer: &str| marked.number(pointer);
    let distortion = &marked.record["distortion"];
    let record = |pointer: &str| distortion.pointer(pointer).and_then(Value::as_f64).unwrap_or(f64::NAN);
    format!(
        "| {} | {} | {} | {} | {} | {} | {}, {} | {}, {}, {} | {}, {} | {:.2}, {:.1} | {:.1} % | {:.3}, {:.2} | {:.3} |",
        map.file_stem().unwrap_or_default().to_string_lossy(),
        shape.to_lowercase(),
        basis.to_lowercase(),
        n("/compared/vertices"),
        record("/topology/t_junctions"),
        record("/topology/attenuated_vertices"),
        n("/validity/invalid_before"),
        n("/validity/newly_invalid"),
        n("/overlaps/before"),
        n("/overlaps/new"),
        n("/overlaps/new_slivers"),
        n("/crossings/new"),
        n("/crossings/lost"),
        n("/angles/mean_change_deg"),
        n("/angles/p99_change_deg"),
        100.0 * n("/angles/right_angles_kept"),
        100.0 * n("/areas/mean_change"),
        100.0 * n("/areas/p99_change"),
        n("/displacement/rms_m"),
    )
}

/// The figures of `meshmark compare` and of the record.
struct Marked {
    comparison: Value,
    record: Value,
}

impl Marked {
    fn number(&self, pointer: &str) -> f64 {
        self.comparison.pointer(pointer).and_then(Value::as_f64).unwrap_or(f64::NAN)
    }
}

/// A folder for the copies, and the settings that make them.
struct Work {
    folder: tempfile::TempDir,
    product: Product,
    precision: Option<String>,
}

impl Work {
    fn new(options: Vec<String>, precision: Option<String>) -> Result<Self> {
        let product = Product::of_this_build()?.with_options(options);
        let work = Work { folder: tempfile::tempdir()?, product, precision };
        fs::write(work.path("key.json"), SecretKey::from_bytes([7; 32]).to_json().as_bytes())?;
        Ok(work)
    }

    fn path(&self, file: &str) -> PathBuf {
        self.folder.path().join(file)
    }

    fn mark(&self, map: &Path, shape: &str, basis: &str) -> Result<Marked> {
        let (copy, record) = (self.path("marked.gpkg"), self.path("record.json"));
        for file in [&copy, &record] {
            if file.exists() {
                fs::remove_file(file)?;
            }
        }
        let options = [
            ("KEY", self.path("key.json").display().to_string()),
            ("RECIPIENT", "quality".into()),
            ("RECORD", record.display().to_string()),
            ("SHAPE", shape.into()),
            ("BASIS", basis.into()),
        ];
        self.product.export(map, &copy, options)?;
        Ok(Marked {
            comparison: self.compare(map, &copy)?,
            record: serde_json::from_slice(&fs::read(record)?)?,
        })
    }

    fn compare(&self, map: &Path, copy: &Path) -> Result<Value> {
        let mut command = self.product.meshmark();
        command.args(["compare", "--json"]).args([map, copy]);
        command.args(self.precision.iter().flat_map(|precision| ["--precision", precision]));
        let output = command.output()?;
        match output.status.success() {
            true => Ok(serde_json::from_slice(&output.stdout)?),
            false => Err(String::from_utf8_lossy(&output.stderr).trim().into()),
        }
    }
}
