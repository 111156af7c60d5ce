//! Columns of numbers in files without a name, which vanish with the process however it ends.

use meshmark_core::{
    Error, Result,
    columns::{Column, Columns},
};
use std::{
    env,
    fs::File,
    io,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
};

/// Numbers that are written or read at once.
const BLOCK: usize = 1 << 13;

/// Columns in files of the folder for large temporary files: that of TMPDIR, by default /var/tmp, which
/// is on a disk where /tmp may be in memory.
pub struct ScratchFiles;

struct ScratchFile {
    file: File,
    folder: PathBuf,
    numbers: u64,
}

impl Columns for ScratchFiles {
    fn column(&self) -> Result<Box<dyn Column>> {
        let usual = || Some(PathBuf::from("/var/tmp")).filter(|folder| folder.is_dir());
        let given = env::var_os("TMPDIR").filter(|folder| !folder.is_empty());
        let folder = given.map(PathBuf::from).or_else(usual).unwrap_or_else(env::temp_dir);
        let file = tempfile::tempfile_in(&folder).map_err(|error| failed("made", &folder, &error))?;
        Ok(Box::new(ScratchFile { file, folder, numbers: 0 }))
    }
}

impl Column for ScratchFile {
    fn append(&mut self, numbers: &[f64]) -> Result<()> {
        for block in numbers.chunks(BLOCK) {
            let bytes: Vec<u8> = block.iter().flat_map(|number| number.to_le_bytes()).collect();
            let written = self.file.write_all_at(&bytes, 8 * self.numbers);
            written.map_err(|error| failed("written", &self.folder, &error))?;
            self.numbers += block.len() as u64;
        }
        Ok(())
    }

    fn read(&self, first: usize, numbers: &mut [f64]) -> Result<()> {
        let mut bytes = vec![0; 8 * BLOCK.min(numbers.len())];
        for (number, block) in (0..).zip(numbers.chunks_mut(BLOCK)) {
            let (bytes, offset) = (&mut bytes[..8 * block.len()], 8 * (first + number * BLOCK) as u64);
            let read = self.file.read_exact_at(bytes, offset);
            read.map_err(|error| failed("read", &self.folder, &error))?;
            let values =
                bytes.chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().expect("8 bytes")));
            block.iter_mut().zip(values).for_each(|(number, value)| *number = value);
        }
        Ok(())
    }
}

fn failed(action: &str, folder: &Path, error: &io::Error) -> Error {
    let folder = folder.display();
    let reason = format!(
        "a temporary file in {folder} cannot be {action} ({error}): make room there, or name another folder by the \
         environment variable TMPDIR"
    );
    Error::Column { reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_they_were_appended() {
        let numbers: Vec<f64> = (0..3 * BLOCK).map(|i| (i as f64).sqrt() - 50.0).collect();
        let mut column = ScratchFiles.column().unwrap();
        numbers.chunks(BLOCK + 7).for_each(|some| column.append(some).unwrap());
        for (first, count) in [(0, numbers.len()), (5, 1), (BLOCK - 1, BLOCK + 2), (numbers.len(), 0)] {
            let mut read = vec![0.0; count];
            column.read(first, &mut read).unwrap();
            assert_eq!(read, numbers[first..first + count]);
        }
        let error = column.read(numbers.len(), &mut [0.0]).unwrap_err().to_string();
        assert!(error.contains("cannot be read") && error.contains("TMPDIR"), "{error}");
    }
}
