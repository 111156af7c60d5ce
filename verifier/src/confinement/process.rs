//! The child process of an examination, as its parent sees it: its start, what it prints, and why it
//! ended.

use super::Limits;
use crate::{Error, ExitCode, Result};
use signal_hook::{
    consts::{SIGINT, SIGKILL, SIGTERM, SIGXFSZ},
    iterator::Signals,
    low_level::emulate_default_handler,
};
use std::{
    ffi::OsStr,
    io::{self, BufRead, BufReader, Read, Write},
    os::unix::process::ExitStatusExt,
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel},
    thread,
    time::Instant,
};

/// A longer line of the child is none of ours.
const LONGEST_LINE: u64 = 1 << 16;

/// What the child has printed and the parent has not yet read.
const MOST_LINES: usize = 64;

/// Variables that name folders of temporary files: GDAL and SQLite may only write to that of the child.
const FOLDER_OF_TEMPORARY_FILES: &str = "TMPDIR";
const OTHER_FOLDERS: &[&str] = &["SQLITE_TMPDIR", "CPL_TMPDIR"];

/// What is printed before the process ends because there is no memory. The last one stands for an
/// exception of C++, which almost always is one about memory.
const OUT_OF_MEMORY: &[&str] = &[
    "memory allocation of",
    "bad_alloc",
    "ut of memory",
    "annot allocate memory",
    "Resource temporarily unavailable",
    "foreign exception",
];

/// The files through which a child passes the results to its parent.
pub struct Handover<'a>(pub &'a Path);

impl Handover<'_> {
    /// Returns the path of what is printed.
    pub fn answer(&self) -> PathBuf {
        self.0.join("answer")
    }

    /// Returns the path of the report file.
    pub fn report(&self) -> PathBuf {
        self.0.join("report")
    }

    /// Returns the path of the evidence map.
    pub fn evidence_map(&self) -> PathBuf {
        self.0.join("evidence_map.gpkg")
    }
}

/// The end of an examination.
pub enum End {
    /// It ended by itself with this exit code.
    Code(u8),
    /// The user ended it by this signal.
    Signal(i32),
}

enum Event {
    Line(String),
    /// The child prints nothing more.
    Silence,
    Signal(i32),
}

/// Runs `meshmark` with `arguments` as a child that examines `suspect` in `folder`, until it ends or
/// its time is over. The child reads `passphrase` from its standard input. `show` receives each line that it prints, and returns whether it is one of ours.
///
/// # Errors
/// Fails when the child cannot be started, and when a limit or a fault ended it.
pub fn examine<Argument: AsRef<OsStr>>(
    arguments: impl IntoIterator<Item = Argument>,
    passphrase: Option<&String>,
    (suspect, folder): (&Path, &Path),
    limits: &Limits,
    show: &mut dyn FnMut(&str) -> bool,
) -> Result<End> {
    let failed = |source: io::Error| Error::NotConfined { source };
    let until = Instant::now() + limits.time();
    let (sender, events) = sync_channel(MOST_LINES);
    pass_signals(sender.clone()).map_err(failed)?;
    let mut child = start(arguments, passphrase, folder).map_err(failed)?;
    let printed = child.stderr.take().expect("it is piped");
    thread::spawn(move || send_lines(BufReader::new(printed), &sender));
    let watched = watch(&events, until, show);
    if !matches!(watched, Watched::Silent { .. }) {
        drop(child.kill()); // it may have ended by now
    }
    let status = child.wait().map_err(failed)?;
    match watched {
        Watched::Signal(signal) => Ok(End::Signal(signal)),
        Watched::TimeOver => Err(Error::TimeLimit { path: suspect.into(), seconds: limits.time_s }),
        Watched::Silent { noise } => match status.code() {
            Some(code) if ExitCode::ALL.iter().any(|&known| known as i32 == code) => {
                Ok(End::Code(code as u8))
            }
            _ => Err(early_end(suspect, status, &noise, limits)),
        },
    }
}

/// Sends the signals by which the user ends this process, which first ends the child.
fn pass_signals(events: SyncSender<Event>) -> io::Result<()> {
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    thread::spawn(move || {
        for signal in signals.forever() {
            if events.send(Event::Signal(signal)).is_err() {
                drop(emulate_default_handler(signal)); // nothing is left to end
            }
        }
    });
    Ok(())
}

fn start<Argument: AsRef<OsStr>>(
    arguments: impl IntoIterator<Item = Argument>,
    passphrase: Option<&String>,
    folder: &Path,
) -> io::Result<Child> {
    let mut command = Command::new(std::env::current_exe()?);
    command.args(arguments).env(FOLDER_OF_TEMPORARY_FILES, folder);
    for variable in OTHER_FOLDERS {
        command.env_remove(variable);
    }
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    let Some(passphrase) = passphrase else { return command.spawn() }; // a key may come through stdin
    let mut child = command.stdin(Stdio::piped()).spawn()?;
    let mut input = child.stdin.take().expect("it is piped");
    drop(writeln!(input, "{passphrase}")); // a child that has ended says why
    Ok(child)
}

/// Sends the lines that a child prints, to the end.
fn send_lines(mut printed: impl BufRead, events: &SyncSender<Event>) {
    let mut line = Vec::new();
    while printed.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line).is_ok_and(|bytes| bytes > 0) {
        let text = String::from_utf8_lossy(&line).trim_end_matches('\n').to_string();
        if events.send(Event::Line(text)).is_err() {
            return;
        }
        line.clear();
    }
    drop(events.send(Event::Silence));
}

/// What ended the watch over a child.
enum Watched {
    /// It ended, or is about to, and had printed this last line that is none of ours.
    Silent {
        noise: String,
    },
    TimeOver,
    Signal(i32),
}

fn watch(events: &Receiver<Event>, until: Instant, show: &mut dyn FnMut(&str) -> bool) -> Watched {
    let mut noise = String::new();
    loop {
        match events.recv_timeout(until.saturating_duration_since(Instant::now())) {
            Ok(Event::Line(line)) if show(&line) => {}
            Ok(Event::Line(line)) => noise = if is_about_memory(&noise) { noise } else { line },
            Ok(Event::Signal(signal)) => return Watched::Signal(signal),
            Ok(Event::Silence) | Err(RecvTimeoutError::Disconnected) => return Watched::Silent { noise },
            Err(RecvTimeoutError::Timeout) => return Watched::TimeOver,
        }
    }
}

/// Returns the error of a child that did not end by itself.
fn early_end(path: &Path, status: ExitStatus, noise: &str, limits: &Limits) -> Error {
    let (path, megabytes) = (path.into(), limits.memory_mb);
    match status.signal() {
        _ if is_about_memory(noise) => Error::MemoryLimit { path, megabytes },
        Some(SIGXFSZ) => Error::FileLimit { path, megabytes },
        Some(SIGKILL) => Error::Killed { path, megabytes },
        _ => Error::EarlyEnd { path, status, megabytes },
    }
}

fn is_about_memory(noise: &str) -> bool {
    OUT_OF_MEMORY.iter().any(|words| noise.contains(words))
}
