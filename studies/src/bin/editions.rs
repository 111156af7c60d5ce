//! Measures a series of editions: `editions MAP...` changes a share of the features of a map again
//! and again, marks every edition for one recipient on those before it, and prints a Markdown table of
//! what stands and of the evidence in each copy, and in the mean of all copies.

use clap::Parser;
use meshmark_core::{fingerprint_record::FingerprintRecord, options::join_list};
use meshmark_host_tests::{
    Result,
    attacks::Map,
    editions::{common, next, places},
    product::{Product, Report, write_key},
};
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Measure what stands in a series of editions, and the evidence in every copy.
#[derive(Parser)]
struct Arguments {
    /// Maps
    #[arg(required = true)]
    maps: Vec<PathBuf>,
    /// Number of editions
    #[arg(long, default_value_t = 12)]
    editions: u64,
    /// Share of the features that changes from one edition to the next
    #[arg(long, default_value_t = 0.05)]
    share: f64,
}

type Places = BTreeMap<[u64; 2], [f64; 2]>;

fn main() -> ExitCode {
    gdal::config::set_error_handler(|_, _, _| {});
    let arguments = Arguments::parse();
    match arguments.maps.iter().try_for_each(|map| measure(&arguments, map)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("editions: {error}");
            ExitCode::FAILURE
        }
    }
}

fn measure(arguments: &Arguments, map: &Path) -> Result<()> {
    let series = Series::new(Product::of_this_build()?)?;
    println!("{}, {:.0} % of the features change\n", map.display(), 100.0 * arguments.share);
    println!(
        "| edition | vertices | stand, of these moved otherwise | parts | attenuated | invalid, overlaps added | log10 p |"
    );
    println!("|---|---|---|---|---|---|---|");
    let mut edition = Map::read(map)?;
    let mut copies: Vec<Places> = Vec::new();
    for number in 1..=arguments.editions {
        edition.write(&series.path(number, "gpkg"))?;
        series.mark(number)?;
        let copy = Map::read(&series.copy(number))?;
        let moved = places(&edition, &copy)?;
        let record = FingerprintRecord::from_json(&fs::read_to_string(series.path(number, "json"))?)?;
        let [shared, equal] = copies.last().map_or([0, 0], |before| common(before, &moved));
        let p = series.verify(number, &series.copy(number))?.p_value_log10.unwrap_or(0.0);
        let d = &record.distortion;
        println!(
            "| {number} | {} | {shared}, {} | {} | {} | {}, {} | {p:.0} |",
            moved.len(),
            shared - equal,
            record.parts.len(),
            d.topology.attenuated_vertices,
            d.validity.newly_invalid,
            d.overlaps.new,
        );
        copies.push(moved);
        if number < arguments.editions {
            edition = next(&edition, arguments.share, number);
        }
    }
    let mean = mean(&edition, &copies);
    let file = series.folder.path().join("mean.gpkg");
    mean.write(&file)?;
    let p = series.verify(arguments.editions, &file)?.p_value_log10.unwrap_or(0.0);
    println!(
        "\nThe last edition with every vertex at the mean of its places in all copies: log10 p {p:.0}\n"
    );
    Ok(())
}

/// Returns the map with every vertex at the mean of its places in all copies that have it.
fn mean(map: &Map, copies: &[Places]) -> Map {
    map.map_coords(|from| {
        let vertex = from.map(|value| (value + 0.0).to_bits());
        let found: Vec<&[f64; 2]> = copies.iter().filter_map(|copy| copy.get(&vertex)).collect();
        [0, 1].map(|axis| found.iter().map(|place| place[axis]).sum::<f64>() / found.len() as f64)
    })
}

/// The files of a series.
struct Series {
    product: Product,
    folder: tempfile::TempDir,
    key: PathBuf,
}

impl Series {
    fn new(product: Product) -> Result<Self> {
        let folder = tempfile::tempdir()?;
        let key = folder.path().join("key.json");
        write_key(&key, 1)?;
        Ok(Series { product, folder, key })
    }

    fn path(&self, number: u64, extension: &str) -> PathBuf {
        self.folder.path().join(format!("{number}.{extension}"))
    }

    fn copy(&self, number: u64) -> PathBuf {
        self.folder.path().join(format!("copy{number}.gpkg"))
    }

    /// Marks an edition on the one before it.
    fn mark(&self, number: u64) -> Result<()> {
        let text = |path: PathBuf| path.display().to_string();
        let mut options = vec![
            ("KEY", text(self.key.clone())),
            ("RECIPIENT", "ACME GmbH".to_string()),
            ("RECORD", text(self.path(number, "json"))),
        ];
        if number > 1 {
            let references: Vec<String> = (1..number).map(|n| text(self.path(n, "gpkg"))).collect();
            options.push(("BASE", text(self.path(number - 1, "json"))));
            options.push(("BASE_REFERENCE", join_list(&references)));
        }
        self.product.export(&self.path(number, "gpkg"), &self.copy(number), options)
    }

    /// Verifies a suspect for the record of an edition, with the references of all up to it.
    fn verify(&self, number: u64, suspect: &Path) -> Result<Report> {
        let mut command = self.product.meshmark();
        command.args(["verify", "--json", "--key"]).arg(&self.key);
        for n in (1..=number).rev() {
            command.arg("--reference").arg(self.path(n, "gpkg"));
        }
        let output = command.arg("--record").arg(self.path(number, "json")).arg(suspect).output()?;
        match output.status.code() {
            Some(0 | 1 | 3) => Ok(serde_json::from_slice(&output.stdout)?),
            code => Err(format!("exit code {code:?}: {}", String::from_utf8_lossy(&output.stderr)).into()),
        }
    }
}
