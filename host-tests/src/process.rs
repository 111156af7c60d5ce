//! Processes: this module measures the time and the peak memory of one, and runs the C compiler.

use crate::Result;
use serde::Serialize;
use std::{
    collections::HashMap,
    fs::{self, File},
    path::Path,
    process::{Child, Command},
    thread::sleep,
    time::{Duration, Instant},
};

/// Interval at which the peak memory of a process is read.
const POLL: Duration = Duration::from_millis(2);

/// One run of a process.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Run {
    pub seconds: f64,
    /// Seconds of processor time, user and system, of all threads and of finished children.
    pub processor_s: f64,
    /// Peak memory of the process and its children together.
    pub peak_bytes: f64,
}

impl Run {
    /// Runs a process to its end in `folder`, with one of these exit codes.
    ///
    /// # Errors
    /// Fails when it does not start or ends otherwise; the error holds its output.
    pub fn measure(command: &mut Command, folder: &Path, exit_codes: &[i32]) -> Result<Self> {
        let messages = folder.join("messages.txt");
        command.current_dir(folder).stderr(File::create(&messages)?);
        let since = Instant::now();
        let mut child = command.spawn().map_err(|error| format!("{command:?}: {error}"))?;
        let mut peaks = HashMap::new();
        // A process that has ended keeps its processor time, but not its memory, until `wait`.
        while !has_ended(&child) {
            note_peaks(child.id(), &mut peaks);
            sleep(POLL);
        }
        let seconds = since.elapsed().as_secs_f64();
        let processor_s = processor_seconds(&child).unwrap_or(f64::NAN);
        let status = child.wait()?;
        if !status.code().is_some_and(|code| exit_codes.contains(&code)) {
            return Err(format!("{command:?}: {status}\n{}", fs::read_to_string(messages)?).into());
        }
        Ok(Run { seconds, processor_s, peak_bytes: peaks.values().sum() })
    }
}

/// Compiles a C source of a test or a benchmark into a program or a library.
///
/// # Errors
/// Fails when the C compiler cannot be run or fails; the error holds its output.
pub fn compile(source: &Path, arguments: &[&str], into: &Path) -> Result<()> {
    let output = Command::new("cc").arg(source).args(arguments).arg("-o").arg(into).output();
    let output = output.map_err(|error| format!("cc cannot be run: {error}"))?;
    match output.status.success() {
        true => Ok(()),
        false => Err(String::from_utf8_lossy(&output.stderr).into()),
    }
}

/// The runs of one command.
#[derive(Debug, Default, Clone, Serialize)]
pub struct Runs(pub Vec<Run>);

impl Runs {
    /// Returns the fewest seconds.
    pub fn best_s(&self) -> f64 {
        self.0.iter().map(|run| run.seconds).fold(f64::NAN, f64::min)
    }

    /// Returns the fewest seconds of processor time.
    pub fn processor_s(&self) -> f64 {
        self.0.iter().map(|run| run.processor_s).fold(f64::NAN, f64::min)
    }

    /// Returns the most memory.
    pub fn peak_bytes(&self) -> f64 {
        self.0.iter().map(|run| run.peak_bytes).fold(f64::NAN, f64::max)
    }
}

/// Returns the fields of /proc/PID/stat from the third, the state, on (proc(5)).
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
    Some((ticks(11)? + ticks(12)? + ticks(13)? + ticks(14)?) / TICKS_PER_SECOND)
}

/// Keeps the peak memory of a process and of its children.
fn note_peaks(process: u32, peaks: &mut HashMap<u32, f64>) {
    if let Some(bytes) = peak_memory(process) {
        peaks.insert(process, bytes);
    }
    let children = fs::read_to_string(format!("/proc/{process}/task/{process}/children"));
    for child in children.unwrap_or_default().split_whitespace().filter_map(|id| id.parse().ok()) {
        note_peaks(child, peaks);
    }
}

fn peak_memory(process: u32) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024.0 * line.split_whitespace().next()?.parse::<f64>().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_is_waited_for_and_its_failure_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let shell = |script: &str, codes: &[i32]| {
            Run::measure(Command::new("sh").args(["-c", script]), folder.path(), codes)
        };
        let run = shell("sleep 0.05", &[0]).unwrap();
        assert!(run.seconds >= 0.05 && run.peak_bytes > 1e5, "{run:?}");
        let error = shell("echo no such map >&2; exit 2", &[0, 1]).unwrap_err().to_string();
        assert!(error.contains("no such map"), "{error}");
    }
}
