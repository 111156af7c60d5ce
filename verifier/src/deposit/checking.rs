//! What of a key, references, records and recipients a deposit fixes, and what not.

use super::{Deposit, making::vertices};
use crate::{
    Error, Result,
    inputs::{digests::files_digests, texts},
};
use meshmark_core::{counted, key::SecretKey};
use meshmark_verification::{
    report::{Candidates, Standing},
    verify::check_key,
    words::printable,
};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

/// Things that are compared with a deposit, one after the other.
pub(super) struct Comparison<'a> {
    deposit: &'a Deposit,
    standing: Standing,
}

impl<'a> Comparison<'a> {
    pub(super) fn new(deposit: &'a Deposit) -> Self {
        Comparison { deposit, standing: Standing::default() }
    }

    /// Returns what the deposit fixes.
    pub(super) fn finish(self) -> Standing {
        self.standing
    }

    /// Adds what the deposit does not hold.
    pub(super) fn not_fixed(&mut self, what: &str) {
        self.standing.not_fixed.push(what.into());
    }

    /// Compares a key.
    ///
    /// # Errors
    /// Fails when the deposit commits to another key.
    pub(super) fn key(&mut self, key: &SecretKey) -> Result<()> {
        if !self.deposit.holds_key(key) {
            return Err(Error::NotDeposited { what: format!("key {}", key.id()) });
        }
        self.standing.fixed.push("key".into());
        Ok(())
    }

    /// Compares the vertices of a reference, by their digest, and its files, by theirs.
    ///
    /// # Errors
    /// Fails when the deposit has other vertices. Files may differ in what is no vertex.
    pub(super) fn reference(&mut self, path: &Path, vertices_sha256: &str, files: &[String]) -> Result<()> {
        let name = printable(&path.display().to_string());
        if !self.deposit.holds_vertices(vertices_sha256) {
            return Err(Error::NotDeposited { what: format!("reference {name}") });
        }
        self.standing.fixed.push(format!("vertices of the reference {name}"));
        let are_held = self.deposit.holds_files(vertices_sha256, files);
        let file = format!("file of the reference {name}");
        match are_held {
            true => self.standing.fixed.push(file),
            false => self.standing.not_fixed.push(format!("{file}, whose vertices are those of the deposit")),
        }
        Ok(())
    }

    /// Compares a reference of which this verification has another edition; the deposit need not hold it.
    ///
    /// # Errors
    /// Fails when the reference cannot be read.
    pub(super) fn other_reference(&mut self, path: &Path, files: &[String]) -> Result<()> {
        let vertices_sha256 = vertices_of(self.deposit, path)?;
        if vertices_sha256.is_empty() {
            let name = printable(&path.display().to_string());
            self.standing.not_fixed.push(format!("the other reference {name}"));
            return Ok(());
        }
        self.reference(path, &vertices_sha256, files)
    }

    /// Compares a record, by the digest of its file.
    ///
    /// # Errors
    /// Fails when the deposit does not hold the record.
    pub(super) fn record(&mut self, name: &str, sha256: &str) -> Result<()> {
        self.check_record(name, sha256)?;
        self.standing.fixed.push(format!("record {}", printable(name)));
        Ok(())
    }

    fn check_record(&self, name: &str, sha256: &str) -> Result<()> {
        match self.deposit.holds_record(sha256) {
            true => Ok(()),
            false => Err(Error::NotDeposited { what: format!("record {}", printable(name)) }),
        }
    }

    /// Compares the records that match, of many that were tried.
    ///
    /// # Errors
    /// Fails when the deposit does not hold one of them.
    pub(super) fn candidates(&mut self, candidates: &Candidates) -> Result<()> {
        let matching = &candidates.list[..candidates.matches];
        if matching.is_empty() {
            self.standing.not_fixed.push("the records that were tried, none of which matches".into());
        }
        matching.iter().try_for_each(|entry| self.record(&entry.record, &entry.sha256))
    }

    /// Compares a recipient.
    ///
    /// # Errors
    /// Fails when the deposit does not hold the recipient.
    pub(super) fn recipient(&mut self, key: &SecretKey, recipient: &str) -> Result<()> {
        if !self.deposit.holds_recipient(key, recipient) {
            return Err(Error::NotDeposited { what: format!("recipient \"{}\"", printable(recipient)) });
        }
        self.standing.fixed.push(format!("recipient \"{}\"", printable(recipient)));
        Ok(())
    }
}

/// Compares files with a deposit.
///
/// # Errors
/// Fails on unreadable files, and on whatever the deposit does not hold.
pub fn check(
    deposit: &Deposit,
    key: Option<&SecretKey>,
    references: &[PathBuf],
    records: Option<&Path>,
    warn: &mut dyn FnMut(&str),
) -> Result<Standing> {
    let mut comparison = Comparison::new(deposit);
    if let Some(key) = key {
        comparison.key(key)?;
    }
    for path in references {
        let files: Vec<String> = files_digests(path)?.into_iter().map(|(_, sha256)| sha256).collect();
        comparison.reference(path, &vertices_of(deposit, path)?, &files)?;
    }
    if let Some(folder) = records {
        check_records(&mut comparison, key, folder, warn)?;
    }
    Ok(comparison.finish())
}

/// Returns the digest of the vertices of a reference, read as one in the deposit was read if that is
/// the same.
fn vertices_of(deposit: &Deposit, path: &Path) -> Result<String> {
    let mut read = Vec::new();
    for known in &deposit.statement().predicate.references {
        if read.contains(&(&known.layers, &known.srs)) {
            continue;
        }
        read.push((&known.layers, &known.srs));
        match vertices(path, known.layers.as_ref(), known.srs.as_ref()) {
            Ok(found) if deposit.holds_vertices(&found.vertices_sha256) => return Ok(found.vertices_sha256),
            Err(error) if !error.is_about_options() => return Err(error),
            _ => {}
        }
    }
    Ok(String::new()) // no digest
}

fn check_records(
    comparison: &mut Comparison,
    key: Option<&SecretKey>,
    folder: &Path,
    warn: &mut dyn FnMut(&str),
) -> Result<()> {
    let records = texts::records(folder, warn)?;
    for (path, read) in &records {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if let Some(key) = key {
            let other = |source| Error::OfRecord {
                path: path.clone(),
                source: Box::new(Error::Verification(source)),
            };
            check_key(&read.record, key).map_err(other)?;
        }
        comparison.check_record(&name, &read.sha256)?;
    }
    let found = records.iter().map(|(_, read)| &read.sha256).collect::<BTreeSet<_>>().len();
    let all = comparison.deposit.statement().predicate.records.digests.len();
    comparison.standing.fixed.push(counted(found, "record"));
    if found < all {
        let missing = format!("{} of the deposit that the folder lacks", counted(all - found, "record"));
        comparison.not_fixed(&missing);
    }
    Ok(())
}
