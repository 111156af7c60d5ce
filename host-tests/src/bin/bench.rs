//! What marking and verifying cost: `bench MAP...` prints a Markdown table with a column for every map.
//!
//! Processes are run as a user runs them: plain `ogr2ogr` and the same through the driver, in turns, then
//! `meshmark verify`. Stages are timed in this process. Nothing is asserted, for times depend on the machine
//! and on what else it does. `meshmark` and the driver are those next to this program; GDAL_DRIVER_PATH
//! names another driver.

use gdal::Dataset;
use meshmark_core::{
    embedding::embed, key::SecretKey, message::Message, options::Parameters, patches::Patches,
    spectrum::Basis,
};
use meshmark_dataset::{LabelFields, MOST_VERTICES, Selection, Survey, Target, survey};
use meshmark_host_tests::bench_distribute::Distributed;
use serde_json::Value;
use std::{
    error::Error,
    ffi::OsString,
    fs::{self, File},
    path::{Path, PathBuf},
    process::{Child, Command},
    thread::sleep,
    time::{Duration, Instant},
};
use tempfile::TempDir;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Maps of more vertices are measured twice instead of three times.
const LARGE: usize = 100_000;
/// So many patches, spread over the map, are solved for the mean.
const SOLVED: usize = 24;
/// How often a process is asked for its peak memory.
const POLL: Duration = Duration::from_millis(2);

fn main() -> Result<()> {
    let maps: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    if maps.is_empty() {
        return Err("usage: bench MAP...".into());
    }
    gdal::config::set_error_handler(|_, _, _| ()); // warnings about a map are not what is measured
    let mut columns = Vec::new();
    for map in &maps {
        eprintln!("measuring {}", map.display());
        columns.push(Column::measure(map).map_err(|error| format!("{}: {error}", map.display()))?);
    }
    print_table(&columns);
    Ok(())
}

fn key() -> SecretKey {
    SecretKey::from_bytes([7; 32])
}

/// All that is measured of one map.
struct Column {
    name: String,
    stages: Stages,
    plain: Runs,
    marked: Runs,
    verified: Runs,
    distributed: Distributed,
    /// The last report of `meshmark verify --json`.
    report: Value,
}

impl Column {
    fn measure(map: &Path) -> Result<Self> {
        let name = map.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let stages = Stages::measure(map)?;
        let work = Work::new(map)?;
        let repetitions = if stages.vertices > LARGE { 2 } else { 3 };
        let (mut plain, mut marked, mut verified) = (Runs::default(), Runs::default(), Runs::default());
        for _ in 0..repetitions {
            plain.0.push(work.run_plain()?);
            marked.0.push(work.run_marked()?);
        }
        for _ in 0..repetitions {
            verified.0.push(work.run_verify()?);
        }
        let report = serde_json::from_slice(&fs::read(work.path("report.json"))?)?;
        let distributed = Distributed::measure(&work.meshmark, &work.map, work.folder.path())?;
        Ok(Column { name, stages, plain, marked, verified, distributed, report })
    }

    /// A stage of the last verification, seconds.
    fn verify_stage(&self, stage: &str) -> f64 {
        self.report["seconds"][stage].as_f64().unwrap_or(f64::NAN)
    }
}

/// Stages in this process: seconds, the best of the repetitions.
struct Stages {
    vertices: usize,
    patches: usize,
    read: f64,
    cut: f64,
    /// One patch on one thread, the mean of some.
    solve: f64,
    embed: f64,
}

impl Stages {
    fn measure(map: &Path) -> Result<Self> {
        let parameters = Parameters::default();
        let (key, message) = (key(), Message::from_bytes(&[0xa5; 16]));
        let (read, map) = best_of(2, || read(map))?;
        let (cut, patches) = best_of(2, || Ok(Patches::new(&map.map()?, &parameters)?))?;
        let (embed, _) = best_of(2, || Ok(embed(&map.map()?, &key, &message, &parameters)?))?;
        Ok(Stages {
            vertices: map.vertices.len(),
            patches: patches.as_slice().len(),
            read,
            cut,
            solve: mean_solve(&patches, patches.carriers(message.len(), &parameters)? + 1)?,
            embed,
        })
    }
}

/// The fewest seconds that `f` takes, and what it returns.
fn best_of<T>(repetitions: usize, mut f: impl FnMut() -> Result<T>) -> Result<(f64, T)> {
    let mut timed = || {
        let since = Instant::now();
        f().map(|value| (since.elapsed().as_secs_f64(), value))
    };
    let mut best = timed()?;
    for _ in 1..repetitions {
        best.0 = best.0.min(timed()?.0);
    }
    Ok(best)
}

fn mean_solve(patches: &Patches, columns: usize) -> Result<f64> {
    let step = patches.as_slice().len().div_ceil(SOLVED);
    let some: Vec<_> = patches.as_slice().iter().step_by(step).collect();
    let since = Instant::now();
    for patch in &some {
        std::hint::black_box(Basis::low_frequencies(patch, columns)?);
    }
    Ok(since.elapsed().as_secs_f64() / some.len() as f64)
}

/// Reads a map as the driver does.
fn read(map: &Path) -> Result<Survey> {
    let selection = Selection {
        layers: None,
        srs: None,
        labels: LabelFields::None,
        target: Target::Own,
        most_vertices: MOST_VERTICES,
        last_failure: &|| None,
    };
    Ok(survey(&Dataset::open(map)?, &selection)?)
}

/// A folder for the outputs, and where the programs are.
struct Work {
    map: PathBuf,
    folder: TempDir,
    meshmark: PathBuf,
    plugins: PathBuf,
}

impl Work {
    fn new(map: &Path) -> Result<Self> {
        let here = std::env::current_exe()?.parent().ok_or("this program has no folder")?.to_path_buf();
        let plugins = std::env::var_os("GDAL_DRIVER_PATH").map_or(here.join("gdalplugins"), PathBuf::from);
        let meshmark = here.join("meshmark");
        for needed in [&meshmark, &plugins] {
            if !needed.exists() {
                return Err(format!("{} is missing: run `make build` first", needed.display()).into());
            }
        }
        let work = Work { map: map.canonicalize()?, folder: tempfile::tempdir()?, meshmark, plugins };
        fs::write(work.path("key.json"), key().to_json().as_bytes())?;
        Ok(work)
    }

    fn path(&self, file: &str) -> PathBuf {
        self.folder.path().join(file)
    }

    fn run_plain(&self) -> Result<Run> {
        self.run(self.ogr2ogr("plain.gpkg")?.arg(&self.map), &[0])
    }

    fn run_marked(&self) -> Result<Run> {
        let mut source = OsString::from("MESHMARK:");
        source.push(&self.map);
        let options = ["-oo", "KEY=key.json", "-oo", "RECIPIENT=bench"];
        self.run(self.ogr2ogr("marked.gpkg")?.arg(source).args(options), &[0])
    }

    /// `ogr2ogr` to a file that is not there, so that every run does the same work.
    fn ogr2ogr(&self, output: &str) -> Result<Command> {
        if self.path(output).exists() {
            fs::remove_file(self.path(output))?;
        }
        let mut command = Command::new("ogr2ogr");
        command.env("GDAL_DRIVER_PATH", &self.plugins);
        command.args(["-f", "GPKG", output]);
        Ok(command)
    }

    fn run_verify(&self) -> Result<Run> {
        let mut command = Command::new(&self.meshmark);
        command.stdout(File::create(self.path("report.json"))?);
        command.args(["verify", "--json", "--key", "key.json", "--recipient", "bench", "--reference"]);
        self.run(command.arg(&self.map).arg("marked.gpkg"), &[0, 1, 3]) // the exit codes of the verdicts
    }

    /// Runs a process to its end, with one of these exit codes, and watches its memory.
    fn run(&self, command: &mut Command, exit_codes: &[i32]) -> Result<Run> {
        let messages = self.path("messages.txt");
        command.current_dir(self.folder.path()).stderr(File::create(&messages)?);
        let since = Instant::now();
        let mut child = command.spawn().map_err(|error| format!("{command:?}: {error}"))?;
        let mut peak_bytes = 0.0;
        // A process that has ended keeps its processor time, not its memory, until it is waited for.
        while !has_ended(&child) {
            peak_bytes = peak_memory(&child).unwrap_or(peak_bytes);
            sleep(POLL);
        }
        let seconds = since.elapsed().as_secs_f64();
        let processor = processor_seconds(&child).unwrap_or(f64::NAN);
        let status = child.wait()?;
        if !status.code().is_some_and(|code| exit_codes.contains(&code)) {
            return Err(format!("{command:?}: {status}\n{}", fs::read_to_string(messages)?).into());
        }
        Ok(Run { seconds, processor, peak_bytes })
    }
}

/// One run of a process.
#[derive(Clone, Copy)]
struct Run {
    seconds: f64,
    /// Seconds of processor time, user and system, all threads.
    processor: f64,
    peak_bytes: f64,
}

/// The fields of /proc/PID/stat from the third, the state, on (proc(5)).
fn stat(child: &Child) -> Option<Vec<String>> {
    let text = fs::read_to_string(format!("/proc/{}/stat", child.id())).ok()?;
    let (_, after_name) = text.rsplit_once(')')?;
    Some(after_name.split_whitespace().map(String::from).collect())
}

fn has_ended(child: &Child) -> bool {
    stat(child).is_none_or(|fields| fields[0] == "Z" || fields[0] == "X")
}

fn processor_seconds(child: &Child) -> Option<f64> {
    const TICKS_PER_SECOND: f64 = 100.0; // USER_HZ, the same on every Linux
    let fields = stat(child)?;
    let ticks = |i: usize| fields.get(i)?.parse::<f64>().ok();
    Some((ticks(11)? + ticks(12)?) / TICKS_PER_SECOND)
}

fn peak_memory(child: &Child) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024.0 * line.split_whitespace().next()?.parse::<f64>().ok()?)
}

/// The runs of one command.
#[derive(Default)]
struct Runs(Vec<Run>);

impl Runs {
    fn sorted(&self, of: impl Fn(&Run) -> f64) -> Vec<f64> {
        let mut values: Vec<f64> = self.0.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values
    }

    fn best(&self) -> f64 {
        self.sorted(|run| run.seconds)[0]
    }

    fn median(&self) -> f64 {
        let values = self.sorted(|run| run.seconds);
        (values[(values.len() - 1) / 2] + values[values.len() / 2]) / 2.0
    }

    fn processor(&self) -> f64 {
        self.sorted(|run| run.processor)[0]
    }

    fn peak_bytes(&self) -> f64 {
        self.sorted(|run| run.peak_bytes)[self.0.len() - 1]
    }
}

/// A row of the table: what it is, and its value in a column.
type Row = (&'static str, fn(&Column) -> String);

const ROWS: &[Row] = &[
    ("distinct vertices", |c| c.stages.vertices.to_string()),
    ("patches", |c| c.stages.patches.to_string()),
    ("**`ogr2ogr -f GPKG`: plain**, best / median s", |c| best_median(&c.plain)),
    ("**through MESHMARK**, best / median s", |c| best_median(&c.marked)),
    ("ratio of the best", |c| format!("{:.1}", c.marked.best() / c.plain.best())),
    ("vertices/s through MESHMARK", |c| format!("{:.0}", c.stages.vertices as f64 / c.marked.best())),
    ("processor s, plain / MESHMARK", |c| {
        format!("{:.2} / {:.2}", c.plain.processor(), c.marked.processor())
    }),
    ("peak memory MB, plain / MESHMARK", |c| {
        format!("{:.0} / {:.0}", c.plain.peak_bytes() / 1e6, c.marked.peak_bytes() / 1e6)
    }),
    ("bytes per vertex above plain", |c| {
        format!("{:.0}", (c.marked.peak_bytes() - c.plain.peak_bytes()) / c.stages.vertices as f64)
    }),
    ("**stages of marking**: reading s", |c| seconds(c.stages.read)),
    ("mesh and patches s", |c| seconds(c.stages.cut)),
    ("one patch solved, one thread, ms", |c| format!("{:.1}", 1e3 * c.stages.solve)),
    ("embedding in all (mesh, patches, solves) s", |c| seconds(c.stages.embed)),
    ("vertices/s of embedding", |c| format!("{:.0}", c.stages.vertices as f64 / c.stages.embed)),
    ("**`meshmark verify`**, best / median s", |c| best_median(&c.verified)),
    ("reading s", |c| seconds(c.verify_stage("reading"))),
    ("patches s", |c| seconds(c.verify_stage("patches"))),
    ("registration s", |c| seconds(c.verify_stage("registration"))),
    ("matching s", |c| seconds(c.verify_stage("matching"))),
    ("deformation s", |c| seconds(c.verify_stage("deformation"))),
    ("demodulation s", |c| seconds(c.verify_stage("demodulation"))),
    ("processor s", |c| format!("{:.2}", c.verified.processor())),
    ("peak memory MB", |c| format!("{:.0}", c.verified.peak_bytes() / 1e6)),
    ("**`meshmark distribute`** to 1 / to 9 s; each further s; over plain", |c| c.distributed.cell()),
    ("verdict", |c| c.report["verdict"].as_str().unwrap_or("none").into()),
];

fn seconds(value: f64) -> String {
    format!("{value:.3}")
}

fn best_median(runs: &Runs) -> String {
    format!("{:.2} / {:.2}", runs.best(), runs.median())
}

fn print_table(columns: &[Column]) {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    println!(
        "{threads} threads ({}), GDAL {}, load {}\n",
        processor_name(),
        gdal::version::VersionInfo::release_name(),
        load()
    );
    let names: String = columns.iter().map(|c| format!(" {} |", c.name)).collect();
    println!("| |{names}\n|---|{}", "---|".repeat(columns.len()));
    for (name, value) in ROWS {
        let values: String = columns.iter().map(|c| format!(" {} |", value(c))).collect();
        println!("| {name} |{values}");
    }
}

fn processor_name() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    name.map_or("unknown processor".into(), |(_, name)| name.trim().into())
}

/// How many processes wanted to run in the last minute: more than threads means that times are too long.
fn load() -> String {
    let text = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split(' ').next().unwrap_or_default().into()
}
