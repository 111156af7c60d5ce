//! Marks maps, attacks the copies, verifies them, and compares the bit errors with the paper's
//! Table 2.

use clap::Parser;
use meshmark_host_tests::{
    Result,
    experiment::{
        Outcome, Plan,
        cases::{Case, Table},
        run,
    },
    product::{Product, Profile},
};
use meshmark_studies::table2::{figures, markdown};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Mutex,
};

/// Rerun Table 2 of Ohbuchi, Ueda and Endoh 2003 with the driver and the verifier of this build.
#[derive(Parser)]
struct Arguments {
    /// Maps in metres, or folders of GeoPackages
    #[arg(required = true)]
    maps: Vec<PathBuf>,
    /// Folder for table2.md, table2.json and the figures
    #[arg(long, default_value = "table2")]
    out: PathBuf,
    /// Only the attacks of the paper, only chip rate 2
    #[arg(long)]
    quick: bool,
    /// These codes, instead of 2,3,LDPC: a number is repetition with this chip rate
    #[arg(long, value_delimiter = ',', value_parser = profile)]
    profiles: Vec<Profile>,
    /// Only these rows, for example 6,9c,dp0.5
    #[arg(long, value_delimiter = ',')]
    rows: Vec<String>,
    /// A further option of the driver, for example SHAPE=RIGID; repeatable
    #[arg(long, value_name = "NAME=VALUE")]
    option: Vec<String>,
    /// Seed of keys and attacks
    #[arg(long, default_value_t = 2003)]
    seed: u64,
    /// Processes at a time
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// New folder in which to keep references, marked copies, records, keys and suspects
    #[arg(long)]
    keep: Option<PathBuf>,
    /// Folder of `meshmark` and `gdalplugins/` [default: that of this program]
    #[arg(long)]
    tools: Option<PathBuf>,
}

fn main() -> ExitCode {
    // GDAL's warnings about versions of GeoPackage do not help the reader.
    gdal::config::set_error_handler(|_, _, _| {});
    match run_all(Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("table2: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run_all(arguments: Arguments) -> Result<()> {
    let product = match &arguments.tools {
        Some(folder) => Product::in_folder(folder)?,
        None => Product::of_this_build()?,
    };
    let product = product.with_options(arguments.option);
    let (quick, rows) = (arguments.quick, arguments.rows.clone());
    let wanted = move |case: &Case, profile: Profile| {
        // The paper's own rows use its two chip rates; all others use the two codes at the same
        // displacement.
        let is_measured = case.table() == Table::Paper || (!quick && profile != Profile::repetition(3));
        is_measured && (rows.is_empty() || rows.contains(&case.id()))
    };
    let plan = Plan {
        maps: geopackages(&arguments.maps)?,
        profiles: match (quick, arguments.profiles.as_slice()) {
            (true, []) => vec![Profile::repetition(2)],
            (false, []) => {
                vec![Profile::repetition(2), Profile::repetition(3), Profile::LDPC, Profile::FINGERPRINT]
            }
            (_, profiles) => profiles.to_vec(),
        },
        wanted: Box::new(wanted),
        seed: arguments.seed,
        workers: arguments.jobs.max(1),
        keep: arguments.keep,
    };
    println!("seed {}, {} maps", plan.seed, plan.maps.len());
    std::fs::create_dir_all(&arguments.out)?;
    let (out, version) = (arguments.out, product.version()?);
    // A run takes long; one that is stopped leaves the tables of its results so far.
    let so_far = Mutex::new(Vec::new());
    let outcomes = run(&product, &plan, |outcome| {
        print(outcome);
        let mut so_far = so_far.lock().expect("no worker panics with the lock");
        so_far.push(outcome.clone());
        if so_far.len().is_multiple_of(100) {
            write(&out, &so_far, plan.seed, &version).unwrap_or_else(|error| eprintln!("table2: {error}"));
        }
    })?;
    write(&out, &outcomes, plan.seed, &version)?;
    println!("written to {}", out.join("table2.md").display());
    Ok(())
}

fn profile(text: &str) -> std::result::Result<Profile, String> {
    match (text, text.parse()) {
        ("LDPC", _) => Ok(Profile::LDPC),
        ("FINGERPRINT", _) => Ok(Profile::FINGERPRINT),
        (_, Ok(chip_rate)) => Ok(Profile::repetition(chip_rate)),
        _ => Err("say FINGERPRINT, LDPC, or a chip rate".into()),
    }
}

/// Returns files unchanged, and folders as the GeoPackages in them.
fn geopackages(paths: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut maps = Vec::new();
    for path in paths {
        if !path.is_dir() {
            maps.push(path.clone());
            continue;
        }
        let files = path.read_dir()?.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
        let mut files: Vec<PathBuf> =
            files.into_iter().filter(|file| file.extension().is_some_and(|e| e == "gpkg")).collect();
        files.sort();
        maps.extend(files);
    }
    if maps.is_empty() {
        return Err("there is no GeoPackage in the folders given".into());
    }
    Ok(maps)
}

fn print(o: &Outcome) {
    let errors = o.bit_errors.map_or("not registered".into(), |errors| format!("{errors} of {}", o.bits));
    println!(
        "{:20} {:4} {:12} {:6} {:12} {errors}, {} ({:.1} s)",
        o.map,
        o.profile.name(),
        o.case,
        o.demodulator,
        o.asked,
        o.verdict.as_deref().unwrap_or(&o.reason),
        o.seconds
    );
}

fn write(folder: &Path, outcomes: &[Outcome], seed: u64, version: &str) -> Result<()> {
    std::fs::write(folder.join("table2.md"), markdown::report(outcomes, seed, version))?;
    let json = serde_json::json!({ "seed": seed, "software": version, "outcomes": outcomes });
    std::fs::write(folder.join("table2.json"), serde_json::to_string_pretty(&json)? + "\n")?;
    for (file, svg) in figures::all(outcomes)? {
        std::fs::write(folder.join(file), svg)?;
    }
    Ok(())
}
