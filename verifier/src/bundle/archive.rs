//! The archive of a bundle: files without compression and without times, in a fixed order.

use super::{JSON, MANIFEST, Manifest, PAGE};
use crate::{Error, Result, inputs::texts};
use std::{
    collections::BTreeMap,
    io::{Cursor, Read, Write},
    path::Path,
};
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter, result::ZipError, write::SimpleFileOptions};

/// The files of a bundle.
#[derive(Debug, PartialEq)]
pub struct Bundle {
    manifest: Manifest,
    files: BTreeMap<String, Vec<u8>>,
}

impl Bundle {
    /// Collects the two forms of a report and what vouches for them.
    ///
    /// # Errors
    /// Fails when an enclosed file cannot be read.
    pub fn new(manifest: Manifest, page: String, json: String) -> Result<Self> {
        let mut files = BTreeMap::from([
            (PAGE.to_string(), page.into_bytes()),
            (JSON.to_string(), json.into_bytes()),
            (MANIFEST.to_string(), manifest.to_json()),
        ]);
        for input in manifest.enclosed() {
            files.insert(input.path.clone(), texts::bytes("input", Path::new(&input.path))?);
        }
        Ok(Bundle { manifest, files })
    }

    /// Returns the archive.
    ///
    /// # Errors
    /// Fails on a name that no archive can hold.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let packed = || -> std::result::Result<Vec<u8>, ZipError> {
            let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
            let options = SimpleFileOptions::default()
                .compression_method(CompressionMethod::Stored)
                .last_modified_time(DateTime::default())
                .unix_permissions(0o644);
            for (name, bytes) in &self.files {
                archive.start_file(name.as_str(), options)?;
                archive.write_all(bytes)?;
            }
            Ok(archive.finish()?.into_inner())
        };
        packed().map_err(|error| Error::unwritten("the bundle", std::io::Error::other(error)))
    }

    /// Reads an archive.
    ///
    /// # Errors
    /// Fails on a file that is no bundle.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = texts::bytes("bundle", path)?;
        unpacked(bytes).map_err(|reason| Error::NoBundle { path: path.into(), reason })
    }

    /// Returns the manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Returns the number of its files.
    pub fn count(&self) -> usize {
        self.files.len()
    }

    /// Returns whether a file is this archive and nothing else: a second entry of one name, a comment and
    /// bytes around the archive would show something to those who unpack it with another program.
    ///
    /// # Errors
    /// Fails when the file cannot be read.
    pub fn is_all_of(&self, path: &Path) -> Result<bool> {
        Ok(texts::bytes("bundle", path)? == self.to_bytes()?)
    }

    /// Returns the names of the files that are not the same in another bundle.
    pub fn differing<'a>(&'a self, other: &'a Bundle) -> Vec<&'a str> {
        let names =
            self.files.keys().chain(other.files.keys().filter(|name| !self.files.contains_key(*name)));
        names.filter(|name| self.files.get(*name) != other.files.get(*name)).map(String::as_str).collect()
    }
}

fn unpacked(bytes: Vec<u8>) -> std::result::Result<Bundle, String> {
    // Entries may name the same bytes, so that a small archive unpacks without end.
    let mut left = bytes.len();
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| error.to_string())?;
    let mut files = BTreeMap::new();
    for number in 0..archive.len() {
        let mut file = archive.by_index(number).map_err(|error| error.to_string())?;
        let size = usize::try_from(file.size()).unwrap_or(usize::MAX);
        left = left.checked_sub(size).ok_or("its entries are larger than the file: they overlap")?;
        let mut bytes = Vec::new();
        file.by_ref().take(size as u64).read_to_end(&mut bytes).map_err(|error| error.to_string())?;
        let name = file.name().map_err(|error| error.to_string())?.into_owned();
        files.insert(name, bytes);
    }
    let manifest = files.get(MANIFEST).ok_or("it has no manifest.json")?;
    let manifest = Manifest::from_json(manifest).map_err(|reason| format!("its manifest.json: {reason}"))?;
    Ok(Bundle { manifest, files })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns an archive of `count` entries that all have the same bytes of this size.
    fn sharing(count: u16, size: usize) -> Vec<u8> {
        const END: usize = 22;
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        archive.start_file("00000", stored).unwrap();
        archive.write_all(&vec![0; size]).unwrap();
        let one = archive.finish().unwrap().into_inner();
        let mut end = one[one.len() - END..].to_vec();
        let directory = u32::from_le_bytes(end[16..20].try_into().unwrap()) as usize;
        let entry = &one[directory..one.len() - END];
        let mut all = one[..directory].to_vec();
        for number in 0..count {
            let mut entry = entry.to_vec();
            entry[46..51].copy_from_slice(format!("{number:05}").as_bytes());
            all.extend(entry);
        }
        let of_directory = (all.len() - directory) as u32;
        end[8..10].copy_from_slice(&count.to_le_bytes());
        end[10..12].copy_from_slice(&count.to_le_bytes());
        end[12..16].copy_from_slice(&of_directory.to_le_bytes());
        [all, end].concat()
    }

    #[test]
    fn an_archive_whose_entries_overlap_is_refused_before_it_is_unpacked() {
        assert_eq!(unpacked(sharing(1, 1000)), Err("it has no manifest.json".into()));
        let reason = unpacked(sharing(200, 1_000_000)).unwrap_err();
        assert!(reason.contains("overlap"), "{reason}");
    }
}
