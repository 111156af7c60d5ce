//! The copies to make: the names of their files, and whether they are finished.

use super::opening::open;
use crate::{Error, Result};
use gdal::vector::LayerAccess;
use meshmark_core::{
    fingerprint_record::{Divided, FingerprintRecord},
    key::SecretKey,
    message::Message,
    options::{Options, Subject},
    record::{Record, Reference},
    recorded::Recorded,
};
use meshmark_dataset::{Survey, formats::Format};
use meshmark_marking::{self as marking, Bases, Lineage};
use sha2::{Digest, Sha256};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Returns whether GDAL opens a copy, and its layers have the feature counts of the map.
fn has_features(file: &Path, driver: &str, map: &Survey) -> bool {
    let Ok(dataset) = open(file, driver) else { return false };
    map.features
        .iter()
        .all(|(&layer, &count)| dataset.layer(layer).is_ok_and(|layer| layer.feature_count() == count))
}

/// The longest part of a file name that comes from the recipient, characters.
const LONGEST_SLUG: usize = 40;

/// The copy of a recipient.
pub struct MarkedCopy {
    /// The recipient.
    pub recipient: String,
    /// The main file.
    pub file: PathBuf,
    /// The record.
    pub record: PathBuf,
    driver: &'static str,
}

impl MarkedCopy {
    /// Names the files of the copy for a recipient in a folder.
    pub fn new(recipient: String, folder: &Path, format: &Format) -> Self {
        let stem = stem(&recipient);
        let path = |ending: &str| folder.join(format!("{stem}{ending}"));
        MarkedCopy { file: path(format.ending()), record: path(".json"), recipient, driver: format.driver }
    }

    /// Returns the bits that the code carries in the copy.
    pub fn carried(&self, key: &SecretKey) -> Message {
        self.subject().carried(key)
    }

    /// Returns the subject of the mark.
    pub fn subject(&self) -> Subject {
        Subject::Recipient(self.recipient.clone())
    }

    /// Returns whether file and record exist and the record is that of this marking. Fails when any
    /// other file is in the place of the copy.
    pub fn is_finished(
        &self,
        options: &Options,
        key: &SecretKey,
        (map, reference, bases): (&Survey, &Reference, &Bases),
    ) -> Result<bool> {
        let refused = |path: &Path, why| Err(Error::InTheWay { path: path.into(), why });
        let has_record = self.record.symlink_metadata().is_ok();
        if has_record && !self.is_record_of_this(options, key, (reference, bases)) {
            return refused(&self.record, "is not the record of this map, key, recipient and options");
        }
        if has_record && self.file.is_file() {
            return match has_features(&self.file, self.driver, map) {
                true => Ok(true),
                false => {
                    refused(&self.file, "is damaged or was changed: it does not have the features of the map")
                }
            };
        }
        match self.in_the_way() {
            Some(path) => refused(&path, "is there and is no finished copy"),
            None => Ok(false),
        }
    }

    /// Compares everything that is determined before the marking.
    fn is_record_of_this(
        &self,
        options: &Options,
        key: &SecretKey,
        (reference, bases): (&Reference, &Bases),
    ) -> bool {
        let text = fs::read_to_string(&self.record).ok();
        let Some(found) = text.and_then(|text| Recorded::from_json(&text).ok()) else { return false };
        // Parts and census follow from the map, its bases, its anchors and the options.
        let (patches, lineage, distortion) = match &found {
            Recorded::Message(record) => (record.reference.patches, Lineage::default(), record.distortion()),
            Recorded::Fingerprint(record) => {
                let divided = Divided { parts: record.parts.clone(), census: record.census };
                (0, bases.lineage(divided), record.distortion)
            }
        };
        let reference = (Reference { patches, ..reference.clone() }, lineage);
        match (marking::recorded(options, &self.subject(), key, reference, distortion), found) {
            (Recorded::Message(expected), Recorded::Message(found)) => {
                Record { software: found.software.clone(), ..expected } == found
            }
            (Recorded::Fingerprint(mut expected), Recorded::Fingerprint(found)) => {
                expected.reference.file_sha256.clone_from(&found.reference.file_sha256);
                let (software, copy) = (found.software.clone(), found.copy.clone());
                FingerprintRecord { software, copy, ..expected } == found
            }
            _ => false,
        }
    }

    /// Returns a file whose name makes it a part of the copy, if there is one.
    fn in_the_way(&self) -> Option<PathBuf> {
        let stem = self.record.with_extension("");
        let start = format!("{}.", stem.file_name()?.to_str()?);
        let is_part = |path: &PathBuf| {
            *path != self.record
                && path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(&start))
        };
        let mut paths: Vec<PathBuf> =
            fs::read_dir(stem.parent()?).ok()?.flatten().map(|entry| entry.path()).filter(is_part).collect();
        paths.sort();
        paths.into_iter().next()
    }
}

/// Returns a file name without extension: the legible part of the recipient, and 32 bits of a hash
/// that distinguish recipients with the same legible part.
fn stem(recipient: &str) -> String {
    let mut slug = String::new();
    for letter in recipient.chars().flat_map(char::to_lowercase) {
        match letter.is_alphanumeric() {
            true => slug.push(letter),
            false if slug.ends_with('-') || slug.is_empty() => {}
            false => slug.push('-'),
        }
    }
    let slug: String = slug.chars().take(LONGEST_SLUG).collect();
    let hash = meshmark_core::hex::encode(&Sha256::digest(recipient)[..4]);
    match slug.trim_end_matches('-') {
        "" => hash,
        slug => format!("{slug}-{hash}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_name_is_a_slug_and_a_hash() {
        assert_eq!(stem("ACME GmbH"), "acme-gmbh-f384e512");
        for (recipient, slug) in [
            ("../../etc/passwd", "etc-passwd-"),
            ("Ö & Søn", "ö-søn-"),
            ("名古屋市", "名古屋市-"),
            ("a\0\nb", "a-b-"),
        ] {
            let stem = stem(recipient);
            assert!(stem.starts_with(slug) && stem.len() == slug.len() + 8, "{stem}");
        }
        assert_eq!(stem("!").len(), 8);
        assert_ne!(stem("ACME GmbH"), stem("acme gmbh"));
        assert!(stem(&"長い".repeat(500)).len() < 200);
    }
}
