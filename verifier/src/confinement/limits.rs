//! The limits of an examination: what was asked for, or what follows from the machine and the files.

use crate::inputs::size_of;
use rustix::{
    process::{Resource, Rlimit, getrlimit, setrlimit},
    system::sysinfo,
};
use std::{fs, io, path::Path, thread::available_parallelism, time::Duration};

const MB: u64 = 1_000_000;

/// The time for small files, and the rate at which the time grows with their size. A verification
/// takes a tenth of this, or less.
const LEAST_SECONDS: u64 = 600;
const BYTES_PER_SECOND: u64 = 200_000;

/// The memory for small files, and its growth with the processors and with the size of the files. The
/// matrices of a usual patch take 10 MB. A vertex takes two bytes of a very compact file, and less
/// than 800 of memory.
const LEAST_BYTES: u64 = 1_000 * MB;
const BYTES_PER_PROCESSOR: u64 = 50 * MB;
const BYTES_PER_BYTE: u64 = 400;

/// Where Linux names the limit of the memory of a container.
const OF_CONTAINER: &str = "/sys/fs/cgroup/memory.max";

/// The limits of an examination.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Memory of the process, and the size of each file that it writes.
    pub memory_mb: u64,
    /// Seconds from its start to its end.
    pub time_s: u64,
}

impl Limits {
    /// Returns the limits that are given. By default they follow from the size of the files, and the
    /// memory is at most half of that of the machine.
    pub fn new<'a>(
        memory_mb: Option<u64>,
        time_s: Option<u64>,
        files: impl IntoIterator<Item = &'a Path>,
    ) -> Self {
        let bytes: u64 = files.into_iter().map(size_of).sum();
        let of_files = bytes.saturating_mul(BYTES_PER_BYTE);
        let memory = (LEAST_BYTES + BYTES_PER_PROCESSOR * processors()).saturating_add(of_files);
        let memory_mb = memory_mb.unwrap_or_else(|| memory.min(memory_of_machine() / 2) / MB);
        let time_s = time_s.unwrap_or(LEAST_SECONDS + bytes / BYTES_PER_SECOND);
        Limits { memory_mb: memory_mb.min(inherited() / MB), time_s }
    }

    /// Returns the time.
    pub fn time(&self) -> Duration {
        Duration::from_secs(self.time_s)
    }

    /// Imposes the limits of memory and files on this process. A process that fails leaves no image of
    /// its memory, which holds the key.
    ///
    /// # Errors
    /// Fails when the operating system does not accept a limit.
    pub fn impose(&self) -> io::Result<()> {
        let bytes = self.memory_mb.saturating_mul(MB);
        for (resource, most) in [(Resource::Data, bytes), (Resource::Fsize, bytes), (Resource::Core, 0)] {
            let most = most.min(getrlimit(resource).maximum.unwrap_or(u64::MAX));
            setrlimit(resource, Rlimit { current: Some(most), maximum: Some(most) })?;
        }
        Ok(())
    }
}

fn processors() -> u64 {
    available_parallelism().map_or(1, |count| count.get() as u64)
}

/// Returns the memory of this machine or container, in bytes.
fn memory_of_machine() -> u64 {
    let machine = sysinfo();
    let all = (machine.totalram as u64).saturating_mul(machine.mem_unit.into());
    let of_container = fs::read_to_string(OF_CONTAINER).ok().and_then(|text| text.trim().parse().ok());
    all.min(of_container.unwrap_or(u64::MAX))
}

/// Returns the memory that limits of this process leave to its children, in bytes.
fn inherited() -> u64 {
    let most = |resource| getrlimit(resource).current.unwrap_or(u64::MAX);
    most(Resource::As).min(most(Resource::Data))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_those_given_or_follow_from_the_machine_and_the_files() {
        let given = Limits::new(Some(100), Some(7), []);
        assert_eq!(given, Limits { memory_mb: 100, time_s: 7 });
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a");
        fs::write(&file, vec![0; 1_000_000]).unwrap();
        let missing = folder.path().join("b");
        let by_default = Limits::new(None, None, [file.as_path(), file.as_path(), missing.as_path()]);
        let half = memory_of_machine() / 2 / MB;
        assert_eq!(by_default, Limits { memory_mb: (1800 + 50 * processors()).min(half), time_s: 610 });
        fs::File::options().write(true).open(&file).unwrap().set_len(1 << 40).unwrap();
        assert_eq!(Limits::new(None, None, [file.as_path()]).memory_mb, half);
    }
}
