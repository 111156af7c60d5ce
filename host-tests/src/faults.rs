//! Faults during the writing of a marked map, and the state that must hold afterwards.

use crate::{
    plugin::{Host, Run},
    process,
};
use std::{
    fs,
    path::{Path, PathBuf},
};

const SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/faults/fault.c");

/// A fault. Only calls that change files count.
#[derive(Debug, Clone, Copy)]
pub enum Fault {
    /// The process is killed at the n-th call.
    Kill(usize),
    /// The process is killed after this number of seconds.
    KillAfter(f64),
    /// The disk is full from the n-th call on.
    FullDisk(usize),
    /// No file can be larger than this number of bytes.
    FileSize(usize),
}

/// A host with faults, a small map, and perhaps an existing target.
pub struct Scene {
    /// The host.
    pub host: Host,
    preload: PathBuf,
    target: String,
    options: Vec<String>,
    /// The content of the target before.
    before: Option<Vec<u8>>,
}

/// The outcome of a scene.
#[derive(Debug, PartialEq, Clone, Copy)]
pub enum Outcome {
    /// The complete output is there.
    Complete,
    /// Everything is unchanged.
    Previous,
}

impl Scene {
    /// Prepares a scene; with `replaces` the target exists, and OVERWRITE=YES.
    ///
    /// # Panics
    /// Panics when the C compiler fails.
    pub fn new(target: &str, replaces: bool) -> Self {
        let host = Host::new();
        fs::write(host.path("in.geojson"), points(400, "")).unwrap();
        let preload = host.plugins().join("fault.so");
        compile(&preload);
        let mut options: Vec<String> = [
            "-dsco",
            "PATCH_SIZE=130",
            "-dsco",
            "MESSAGE=0123456789abcdef0123456789abcdef",
            "-dsco",
            "CODE=REPETITION",
            "-dsco",
            "CHIP_RATE=1",
        ]
        .map(String::from)
        .into();
        let before = replaces.then(|| {
            let format = if target.ends_with(".shp") { "ESRI Shapefile" } else { "GPKG" };
            host.run("ogr2ogr", &["-f", format, target, "in.geojson", "-nln", "before"]).succeeds();
            fs::read(host.path(target)).unwrap()
        });
        if replaces {
            options.extend(["-dsco".to_string(), "OVERWRITE=YES".into()]);
        }
        Scene { host, preload, target: target.into(), options, before }
    }

    /// Writes the map with a fault.
    pub fn write(&self, fault: Option<Fault>) -> Run {
        let options: Vec<&str> = self.options.iter().map(String::as_str).collect();
        let arguments = Host::create_arguments(&self.target, "in.geojson", &options);
        run(&self.host, &self.preload, "ogr2ogr", &arguments, fault)
    }

    /// Returns the number of calls that change files when nothing fails.
    pub fn count_calls(&self) -> usize {
        self.write(None).succeeds();
        calls(&self.host)
    }

    /// Asserts that the output is complete or unchanged, and returns which.
    #[track_caller]
    pub fn outcome(&self, context: &str) -> Outcome {
        let now = fs::read(self.host.path(&self.target)).ok();
        if now == self.before {
            return Outcome::Previous;
        }
        assert!(now.is_some(), "{context}: what was there is lost");
        let (run, report) = self.host.verify("ref.gpkg", &["--record", "record.json", &self.target]);
        assert_eq!((run.code, &report["bit_errors"]), (Some(0), &0.into()), "{context}: {}", run.stderr);
        Outcome::Complete
    }

    /// Writes with a fault, asserts everything that must hold, and returns the outcome.
    #[track_caller]
    pub fn survives(&self, fault: Fault) -> Outcome {
        let run = self.write(Some(fault));
        let context = format!("{fault:?}: {:?} {}", run.code, run.stderr);
        let outcome = self.outcome(&context);
        match fault {
            Fault::Kill(_) | Fault::KillAfter(_) => self.check_next_run(outcome, &context),
            Fault::FullDisk(_) | Fault::FileSize(_) => {
                assert_eq!(run.code == Some(0), outcome == Outcome::Complete, "{context}");
                self.check_no_leftovers(outcome, &context);
            }
        }
        outcome
    }

    /// Asserts that the same command, repeated, removes the files of a killed one and does the
    /// remaining work.
    #[track_caller]
    fn check_next_run(&self, outcome: Outcome, context: &str) {
        let next = self.write(None);
        // The existing reference prevents a second one then.
        let done_before = outcome == Outcome::Complete;
        assert_eq!(next.code == Some(0), !done_before, "{context}\nnext: {}", next.stderr);
        assert_eq!(self.outcome(context), Outcome::Complete);
        self.check_no_leftovers(Outcome::Complete, context);
    }

    #[track_caller]
    fn check_no_leftovers(&self, outcome: Outcome, context: &str) {
        let is_part = |name: &String| {
            let stem = Path::new(&self.target).file_stem().unwrap().to_str().unwrap();
            name.starts_with(stem) || ["ref.gpkg", "record.json"].contains(&name.as_str())
        };
        let (parts, others): (Vec<_>, Vec<_>) = self.host.names().into_iter().partition(is_part);
        assert_eq!(others, ["in.geojson", "key.json"], "{context}");
        let companions = parts.iter().filter(|name| !name.starts_with("out")).count();
        assert_eq!(companions, if outcome == Outcome::Complete { 2 } else { 0 }, "{context}: {parts:?}");
    }

    /// Restores the initial state.
    pub fn reset(&self) {
        for name in self.host.names() {
            let path = self.host.path(&name);
            match name.as_str() {
                "in.geojson" | "key.json" => {}
                _ if path.is_dir() => fs::remove_dir_all(path).unwrap(),
                _ => fs::remove_file(path).unwrap(),
            }
        }
        if let Some(before) = &self.before {
            fs::write(self.host.path(&self.target), before).unwrap();
        }
    }
}

/// Runs a program in the host's folder with a fault.
fn run(host: &Host, preload: &Path, program: &str, arguments: &[String], fault: Option<Fault>) -> Run {
    let (kind, at) = match fault {
        Some(Fault::Kill(at)) => ("kill", at.to_string()),
        Some(Fault::FullDisk(at)) => ("full", at.to_string()),
        _ => ("none", String::new()),
    };
    let before: Vec<String> = match fault {
        Some(Fault::KillAfter(seconds)) => {
            vec!["timeout".into(), "-s".into(), "KILL".into(), seconds.to_string()]
        }
        Some(Fault::FileSize(bytes)) => vec!["sh".into(), "-c".into(), limited(bytes), "sh".into()],
        _ => Vec::new(),
    };
    let before = before.iter().map(String::as_str);
    let line: Vec<&str> =
        before.clone().chain([program]).chain(arguments.iter().map(String::as_str)).collect();
    let (preload, log) = (preload.display().to_string(), log(host).display().to_string());
    let variables =
        [("LD_PRELOAD", preload.as_str()), ("FAULT", kind), ("FAULT_AT", &at), ("FAULT_LOG", &log)];
    // Only the program fails, not its shell or timer.
    let variables = if before.len() == 0 { &variables[..] } else { &[] };
    host.run_with(line[0], &line[1..], variables)
}

fn log(host: &Host) -> PathBuf {
    host.plugins().join("calls")
}

/// Returns the number of calls of the last program that changed files.
fn calls(host: &Host) -> usize {
    fs::read_to_string(log(host)).unwrap().trim().parse().unwrap()
}

/// A run of `meshmark distribute` for three recipients, with faults.
pub struct Distribution {
    /// The host.
    pub host: Host,
    preload: PathBuf,
    format: &'static str,
    /// The content of the folder of the copies when nothing fails: names, and what GDAL reads of
    /// maps.
    complete: Vec<(String, String)>,
}

impl Distribution {
    /// Prepares a distribution, and runs it once without faults.
    pub fn new(format: &'static str) -> Self {
        let host = Host::new();
        fs::write(host.path("in.geojson"), points(400, "")).unwrap();
        fs::write(host.path("list.csv"), "recipient\nACME GmbH\nOther Ltd\nThird SARL\n").unwrap();
        let preload = host.plugins().join("fault.so");
        compile(&preload);
        let mut distribution = Distribution { host, preload, format, complete: Vec::new() };
        distribution.run(None).succeeds();
        distribution.complete = distribution.contents();
        assert_eq!(distribution.complete.iter().filter(|(name, _)| name.ends_with(".json")).count(), 3);
        distribution
    }

    /// Returns the number of calls that change files when nothing fails.
    pub fn count_calls(&self) -> usize {
        self.reset();
        self.run(None).succeeds();
        calls(&self.host)
    }

    /// Removes the copies.
    pub fn reset(&self) {
        drop(fs::remove_dir_all(self.host.path("out")));
    }

    fn run(&self, fault: Option<Fault>) -> Run {
        let line = "distribute --key key.json --recipients list.csv --output-dir out --patch-size 130 --code repetition \
                    --chip-rate 1 in.geojson --format";
        let arguments: Vec<String> = line.split_whitespace().chain([self.format]).map(String::from).collect();
        run(&self.host, &self.preload, self.host.meshmark().to_str().unwrap(), &arguments, fault)
    }

    /// Runs with a fault, and asserts that every existing copy is complete and that the same
    /// command, repeated, makes the rest and leaves nothing else. Returns the number of copies
    /// before the repetition.
    #[track_caller]
    pub fn survives(&self, fault: Fault) -> usize {
        let failed = self.run(Some(fault));
        let context = format!("{fault:?}: {:?} {}", failed.code, failed.stderr);
        if matches!(fault, Fault::FullDisk(_) | Fault::FileSize(_)) {
            assert!(matches!(failed.code, Some(0 | 5 | 7)), "a full disk is not the user's: {context}");
        }
        let is_main =
            |name: &String| !name.starts_with('.') && [".gpkg", ".shp"].iter().any(|e| name.ends_with(e));
        let there = if self.host.path("out").is_dir() { self.contents() } else { Vec::new() };
        let copies: Vec<&String> = there.iter().map(|(name, _)| name).filter(|name| is_main(name)).collect();
        for name in &copies {
            let of_copy = |all: &[(String, String)]| {
                let stem = name.rsplit_once('.').unwrap().0;
                all.iter().filter(|(name, _)| name.starts_with(stem)).cloned().collect::<Vec<_>>()
            };
            assert_eq!(of_copy(&there), of_copy(&self.complete), "{context}");
        }
        let copies = copies.len();
        let next = self.run(None);
        assert_eq!(next.code, Some(0), "{context}\nnext: {}", next.stderr);
        assert_eq!(self.contents(), self.complete, "{context}");
        copies
    }

    fn contents(&self) -> Vec<(String, String)> {
        let entries = fs::read_dir(self.host.path("out")).unwrap().map(|entry| entry.unwrap().path());
        let read = |path: PathBuf| {
            let name = path.file_name().unwrap().to_str().unwrap().to_string();
            let is_map =
                !name.starts_with('.') && [".gpkg", ".shp"].iter().any(|ending| name.ends_with(ending));
            let text = match is_map {
                true => format!("{:?}", crate::contents::read(&path)),
                false if name.ends_with(".json") => fs::read_to_string(&path).unwrap(),
                false => String::new(),
            };
            (name, text)
        };
        let mut all: Vec<(String, String)> = entries.map(read).collect();
        all.sort();
        all
    }
}

/// Returns a GeoJSON map of points in degrees; `#` in the properties stands for the number of a
/// point.
pub fn points(count: usize, properties: &str) -> String {
    let feature = |i: usize| {
        let (x, y) = (25.0 + (i % 20) as f64 * 0.001 + i as f64 * 1e-5, 60.0 + (i / 20) as f64 * 0.001);
        let properties = properties.replace('#', &i.to_string());
        format!(
            r#"{{"type":"Feature","properties":{{{properties}}},"geometry":{{"type":"Point","coordinates":[{x},{y}]}}}}"#,
        )
    };
    let features: Vec<String> = (0..count).map(feature).collect();
    format!(r#"{{"type":"FeatureCollection","features":[{}]}}"#, features.join(","))
}

/// Returns a shell script that runs its arguments with a limit on the size of files, which causes
/// errors instead of signals.
fn limited(bytes: usize) -> String {
    format!("trap '' XFSZ; ulimit -f {}; exec \"$@\"", bytes / 512) // POSIX: units of 512 bytes
}

fn compile(library: &Path) {
    process::compile(Path::new(SOURCE), &["-O1", "-shared", "-fPIC", "-ldl"], library).unwrap();
}
