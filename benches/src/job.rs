//! Whole jobs on one map: plain `ogr2ogr`, the same through the driver, the numpy script, and
//! verification.

use crate::stages::Stages;
use meshmark_core::key::SecretKey;
use meshmark_host_tests::{
    Result,
    process::{Run, Runs},
    product::Product,
};
use serde::Serialize;
use serde_json::Value;
use std::{
    ffi::{OsStr, OsString},
    fs::{self, File},
    path::{Path, PathBuf},
    process::{Command, Stdio},
};
use tempfile::TempDir;

/// Maps with more vertices are measured once instead of twice, without the stages and the script.
const HUGE: usize = 1_000_000;

/// Number of recipients in the long list.
const MANY: usize = 9;

/// Options for patches of half the size with one chip per bit: the map has as many chips and takes
/// a quarter of the time to solve.
const SMALL_PATCHES: [&str; 6] = ["-oo", "PATCH_SIZE=256", "-oo", "CHIP_RATE=1", "-oo", "CODE=REPETITION"];

/// The programs.
#[derive(Debug, Clone)]
pub struct Programs {
    pub product: Product,
    /// A Python with the requirements of the numpy script, and the script.
    pub script: Option<[PathBuf; 2]>,
}

/// The measurements of one map.
#[derive(Debug, Serialize)]
pub struct Jobs {
    pub name: String,
    pub vertices: usize,
    pub stages: Option<Stages>,
    pub plain: Runs,
    pub marked: Runs,
    pub small_patches: Runs,
    pub script: Runs,
    pub verified: Runs,
    /// Runs of `meshmark distribute` for one recipient, and for nine.
    pub distributed: [Runs; 2],
    /// Seconds of the stages of the last verification, and its verdict.
    pub verification: Value,
    pub verdict: Value,
}

impl Jobs {
    /// Runs the jobs in turns on a map with this number of vertices.
    ///
    /// # Errors
    /// Fails when one of them fails.
    pub fn measure(programs: &Programs, map: &Path, vertices: usize) -> Result<Self> {
        let work = Work::new(programs, map)?;
        let name = map.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut jobs = Jobs {
            name,
            vertices,
            stages: (vertices <= HUGE).then(|| Stages::measure(map)).transpose()?,
            plain: Runs::default(),
            marked: Runs::default(),
            small_patches: Runs::default(),
            script: Runs::default(),
            verified: Runs::default(),
            distributed: [Runs::default(), Runs::default()],
            verification: Value::Null,
            verdict: Value::Null,
        };
        for _ in 0..if vertices > HUGE { 1 } else { 2 } {
            jobs.plain.0.push(work.plain()?);
            jobs.marked.0.push(work.marked("marked.gpkg", &[])?);
            jobs.small_patches.0.push(work.marked("small_patches.gpkg", &SMALL_PATCHES)?);
            if let (Some(script), true) = (&programs.script, vertices <= HUGE) {
                jobs.script.0.push(work.script(script)?);
            }
            jobs.verified.0.push(work.verify()?);
            if vertices <= HUGE {
                for (runs, recipients) in jobs.distributed.iter_mut().zip([1, MANY]) {
                    runs.0.push(work.distribute(recipients)?);
                }
            }
        }
        let report: Value = serde_json::from_slice(&fs::read(work.path("report.json"))?)?;
        jobs.verification = report["seconds"].clone();
        jobs.verdict = report["verdict"].clone();
        Ok(jobs)
    }

    /// Returns seconds for each further recipient of `meshmark distribute`.
    pub fn further_s(&self) -> f64 {
        (self.distributed[1].best_s() - self.distributed[0].best_s()) / (MANY - 1) as f64
    }

    /// Returns the bytes of memory per vertex beyond those of plain `ogr2ogr`.
    pub fn bytes_per_vertex(&self) -> f64 {
        (self.marked.peak_bytes() - self.plain.peak_bytes()) / self.vertices as f64
    }
}

/// A folder for the outputs.
struct Work<'a> {
    programs: &'a Programs,
    map: &'a Path,
    folder: TempDir,
}

impl<'a> Work<'a> {
    fn new(programs: &'a Programs, map: &'a Path) -> Result<Self> {
        let work = Work { programs, map, folder: tempfile::tempdir()? };
        fs::write(work.path("key.json"), SecretKey::from_bytes([7; 32]).to_json().as_bytes())?;
        Ok(work)
    }

    fn path(&self, file: &str) -> PathBuf {
        self.folder.path().join(file)
    }

    fn run(&self, command: &mut Command, exit_codes: &[i32]) -> Result<Run> {
        Run::measure(command, self.folder.path(), exit_codes)
    }

    /// Returns the path of an output after its removal, so that every run does the same work.
    fn output(&self, file: &str) -> Result<PathBuf> {
        let path = self.path(file);
        if path.exists() {
            fs::remove_file(&path)?;
        }
        Ok(path)
    }

    fn plain(&self) -> Result<Run> {
        self.ogr2ogr("plain.gpkg", self.map.as_os_str(), &[])
    }

    fn marked(&self, output: &str, options: &[&str]) -> Result<Run> {
        let mut source = OsString::from("MESHMARK:");
        source.push(self.map);
        let options = [&["-oo", "KEY=key.json", "-oo", "RECIPIENT=bench"], options].concat();
        self.ogr2ogr(output, &source, &options)
    }

    fn ogr2ogr(&self, output: &str, source: &OsStr, options: &[&str]) -> Result<Run> {
        let mut command = self.programs.product.ogr2ogr();
        command.args(["-f", "GPKG"]).arg(self.output(output)?).arg(source).args(options);
        self.run(&mut command, &[0])
    }

    fn script(&self, [python, script]: &[PathBuf; 2]) -> Result<Run> {
        let mut command = Command::new(python);
        command.arg(script).arg(self.map).arg(self.output("script.gpkg")?).arg("7");
        self.run(&mut command, &[0])
    }

    fn distribute(&self, recipients: usize) -> Result<Run> {
        let names: String = (1..=recipients).map(|number| format!("recipient {number}\n")).collect();
        fs::write(self.path("list.csv"), names)?;
        let mut command = self.programs.product.meshmark();
        command.args([
            "distribute",
            "--key",
            "key.json",
            "--recipients",
            "list.csv",
            "--output-dir",
            "copies",
        ]);
        let run = self.run(command.arg(self.map).stdout(Stdio::null()), &[0])?;
        fs::remove_dir_all(self.path("copies"))?;
        Ok(run)
    }

    fn verify(&self) -> Result<Run> {
        let mut command = self.programs.product.meshmark();
        command.stdout(File::create(self.path("report.json"))?);
        command.args(["verify", "--json", "--key", "key.json", "--recipient", "bench", "--reference"]);
        // These are the exit codes of the verdicts.
        self.run(command.arg(self.map).arg("marked.gpkg"), &[0, 1, 3])
    }
}
