//! The driver as a user has it: GDAL's own programs, the plugin in a folder, and a key file.

use crate::{built, product::marking_arguments};
use meshmark_core::key::SecretKey;
use std::{
    fs::{self, Permissions},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::Command,
};
use tempfile::TempDir;

/// Returns the plugin that cargo built; the command `meshmark` is beside it.
///
/// # Panics
/// Panics when one of them is missing or older than its sources.
pub fn library() -> PathBuf {
    let folder = built::folder().unwrap();
    let library = folder.join("libmeshmark_plugin.so");
    for (file, rule) in [(&library, "libmeshmark_plugin.d"), (&folder.join("meshmark"), "meshmark.d")] {
        built::check(file, &folder.join(rule)).unwrap_or_else(|error| panic!("{error}"));
    }
    library
}

/// Returns the path of a fixture.
pub fn fixture(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures")).join(name)
}

/// A folder of its own with the key `key.json`, in which GDAL's programs find the plugin.
pub struct Host {
    work: TempDir,
    plugins: TempDir,
}

impl Default for Host {
    fn default() -> Self {
        Self::new()
    }
}

impl Host {
    /// Creates the folder.
    pub fn new() -> Self {
        let host = Host { work: tempfile::tempdir().unwrap(), plugins: tempfile::tempdir().unwrap() };
        std::os::unix::fs::symlink(library(), host.plugins.path().join("ogr_MESHMARK.so")).unwrap();
        fs::write(host.path("key.json"), host.key().to_json().as_bytes()).unwrap();
        fs::set_permissions(host.path("key.json"), Permissions::from_mode(0o600)).unwrap();
        host
    }

    /// Returns the key in `key.json`.
    pub fn key(&self) -> SecretKey {
        SecretKey::from_bytes([0xc5; 32])
    }

    /// Returns the key's secret as the key file has it; no other file may hold it.
    pub fn secret(&self) -> String {
        "c5".repeat(32)
    }

    /// Returns the folder.
    pub fn folder(&self) -> &Path {
        self.work.path()
    }

    /// Returns the folder in which GDAL's programs find the plugin.
    pub fn plugins(&self) -> &Path {
        self.plugins.path()
    }

    /// Returns the names of the files in the folder, sorted.
    pub fn names(&self) -> Vec<String> {
        self.files().into_iter().map(|(name, _)| name).collect()
    }

    /// Returns the path of a file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.work.path().join(name)
    }

    /// Copies a fixture into the folder.
    pub fn copy(&self, fixture_name: &str, name: &str) {
        fs::copy(fixture(fixture_name), self.path(name)).unwrap();
    }

    /// Returns names and contents of the files in the folder.
    pub fn files(&self) -> Vec<(String, Vec<u8>)> {
        let entries = fs::read_dir(self.work.path()).unwrap().map(|entry| entry.unwrap().path());
        let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
        let mut files: Vec<_> =
            entries.map(|path| (name(&path), fs::read(&path).unwrap_or_default())).collect();
        files.sort();
        files
    }

    /// Runs a program of GDAL in the folder, with the plugin.
    pub fn run(&self, program: &str, arguments: &[&str]) -> Run {
        self.run_with(program, arguments, &[])
    }

    /// Runs a program of GDAL in the folder, with the plugin and with configuration options.
    pub fn run_with(&self, program: &str, arguments: &[&str], configuration: &[(&str, &str)]) -> Run {
        let mut command = Command::new(program);
        command.args(arguments).current_dir(self.work.path());
        for name in ["MESHMARK_KEY", "GDAL_NUM_THREADS", "CPL_DEBUG", "CPL_LOG", "OGR_SQLITE_JOURNAL"] {
            command.env_remove(name);
        }
        command.env("GDAL_DRIVER_PATH", self.plugins.path()).env("LC_ALL", "C.UTF-8");
        command.envs(configuration.iter().copied());
        let output = command.output().unwrap_or_else(|e| panic!("{program} cannot be run: {e}"));
        Run {
            line: format!("{program} {}", arguments.join(" ")),
            code: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// Returns the command line of `ogr2ogr -f MESHMARK MESHMARK:target source` with the key, a
    /// recipient, the reference `ref.gpkg`, the record `record.json` and more options.
    pub fn create_arguments(target: &str, source: &str, more: &[&str]) -> Vec<String> {
        let options = ["KEY=key.json", "RECIPIENT=ACME GmbH", "REFERENCE=ref.gpkg", "RECORD=record.json"];
        let named = |name: &str| {
            more.iter().any(|o| o.starts_with(name) || name == "RECIPIENT=" && o.starts_with("MESSAGE="))
        };
        let missing = options.iter().filter(|o| !named(&o[..=o.find('=').unwrap()]));
        let fixed = ["-f".into(), "MESHMARK".into(), format!("MESHMARK:{target}"), source.into()];
        let options = missing.flat_map(|option| ["-dsco".to_string(), option.to_string()]);
        fixed.into_iter().chain(options).chain(more.iter().map(|o| o.to_string())).collect()
    }

    /// Runs the command line of [`Host::create_arguments`].
    pub fn create(&self, target: &str, source: &str, more: &[&str]) -> Run {
        let arguments = Self::create_arguments(target, source, more);
        self.run("ogr2ogr", &arguments.iter().map(String::as_str).collect::<Vec<_>>())
    }

    /// Returns the path of the command `meshmark` that cargo built.
    pub fn meshmark(&self) -> PathBuf {
        library().with_file_name("meshmark")
    }

    /// Runs `meshmark verify --json` with the host's key; `more` holds flags and, last, the
    /// suspect.
    pub fn verify(&self, reference: &str, more: &[&str]) -> (Run, serde_json::Value) {
        let command = self.meshmark();
        let mut arguments = vec!["verify", "--json", "--key", "key.json", "--reference", reference];
        arguments.extend(more);
        let run = self.run(command.to_str().unwrap(), &arguments);
        let report = serde_json::from_str(&run.stdout).unwrap_or(serde_json::Value::Null);
        (run, report)
    }

    /// Returns the report of a suspect that must match; of a message no bit may be wrong.
    #[track_caller]
    pub fn matches(&self, reference: &str, more: &[&str]) -> serde_json::Value {
        let (run, report) = self.verify(reference, more);
        assert_eq!(run.code, Some(0), "{}{}", run.stdout, run.stderr);
        assert_eq!(report["verdict"], "match");
        assert!(report["fingerprint"].is_object() || report["bit_errors"] == 0, "{report:#}");
        assert!(report["p_value_log10"].as_f64().unwrap() < -12.0);
        report
    }

    /// Runs `ogr2ogr -f FORMAT output MESHMARK:source` with the key, a recipient and more options.
    pub fn mark(&self, format: &str, output: &str, source: &str, options: &[&str]) -> Run {
        let fixed = ["KEY=key.json", "RECIPIENT=ACME GmbH"].map(String::from);
        let fixed = marking_arguments(format, output, source, fixed);
        self.run(
            "ogr2ogr",
            &fixed.iter().map(String::as_str).chain(options.iter().copied()).collect::<Vec<_>>(),
        )
    }
}

/// The result of a program.
pub struct Run {
    line: String,
    /// Its exit code; `None` when a signal ended it.
    pub code: Option<i32>,
    /// Its standard output.
    pub stdout: String,
    /// Its standard error.
    pub stderr: String,
}

impl Run {
    /// Asserts that it succeeded without an error message.
    #[track_caller]
    pub fn succeeds(self) -> Self {
        assert_eq!(self.code, Some(0), "{}\n{}{}", self.line, self.stdout, self.stderr);
        assert!(self.errors().is_empty(), "{}\n{}", self.line, self.stderr);
        self
    }

    /// Returns the failures of GDAL among its messages, without the last one of `ogr2ogr` when a
    /// source does not open: GDAL 3.12 prints it as an `ERROR`, GDAL 3.6 as a `FAILURE`.
    pub fn errors(&self) -> Vec<&str> {
        let is_last_word = |line: &&str| line.starts_with("ERROR 1: Unable to open datasource `");
        self.stderr.lines().filter(|line| line.starts_with("ERROR ") && !is_last_word(line)).collect()
    }

    /// Returns the warnings of GDAL among its messages.
    pub fn warnings(&self) -> Vec<&str> {
        self.stderr.lines().filter(|line| line.starts_with("Warning ")).collect()
    }
}
