//! A verification and a deposit: what of all that the verification used is fixed.

use super::{DepositFiles, Opened, checking::Comparison};
use crate::{Result, inputs::digests::files_digests};
use meshmark_verification::{
    report::{DepositEntry, Report},
    verify::Request,
};
use std::path::{Path, PathBuf};

/// A deposit, and the digests of the references, made before anything else reads these.
pub struct Expected {
    opened: Opened,
    references: Vec<(PathBuf, Vec<String>)>,
}

impl Expected {
    /// Reads a deposit, before the verification.
    ///
    /// # Errors
    /// Fails as [`Opened::read`] does, and on an unreadable reference.
    pub fn read(files: &DepositFiles, references: &[PathBuf]) -> Result<Self> {
        let digested = |path: &PathBuf| {
            let files = files_digests(path)?;
            Ok((path.clone(), files.into_iter().map(|(_, sha256)| sha256).collect()))
        };
        let references = references.iter().map(digested).collect::<Result<_>>()?;
        Ok(Expected { opened: Opened::read(files)?, references })
    }

    /// Compares the deposit with what a verification used: the key, the vertices and the records that
    /// it read, and not what files say of themselves. `record` is the file of its only record.
    ///
    /// # Errors
    /// Fails when the deposit does not hold the key, the reference, or a record that matches.
    pub fn compare(&self, request: &Request, record: Option<&Path>, report: &Report) -> Result<DepositEntry> {
        let Opened { deposit, is_signer_known, stamp } = &self.opened;
        let mut comparison = Comparison::new(deposit);
        comparison.key(&request.settings.key)?;
        let (own, files) = &self.references[report.reference];
        comparison.reference(own, &report.reference_digest, files)?;
        for (path, files) in self.references.iter().filter(|(path, _)| path != own) {
            comparison.other_reference(path, files)?;
        }
        match (record.zip(request.record.as_ref()), &report.candidates) {
            (Some((path, read)), _) => comparison.record(&path.display().to_string(), &read.sha256)?,
            (None, Some(candidates)) => comparison.candidates(candidates)?,
            (None, None) => {
                if let Some(recipient) = &report.parameters.recipient {
                    comparison.recipient(&request.settings.key, recipient)?;
                }
                comparison.not_fixed("how the map was marked, which the command line says");
            }
        }
        let (since, authority) = stamp.clone().map(|stamp| (stamp.time, stamp.authority)).unzip();
        Ok(DepositEntry {
            sha256: deposit.sha256(),
            public_key: deposit.signer().to_hex(),
            public_key_given: *is_signer_known,
            since,
            authority,
            standing: comparison.finish(),
        })
    }
}
