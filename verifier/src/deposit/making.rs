//! The statement about a key, its references and its records.

use super::statement::{Predicate, Statement, Subject, Vertices};
use super::tree::Tree;
use crate::{
    Error, Result,
    inputs::{
        digests::files_digests,
        maps::{self, Reading},
        texts,
        versions::versions,
    },
};
use meshmark_core::{
    key::SecretKey,
    options::{Options, Subject as MarkSubject},
    recorded::Recorded,
};
use meshmark_dataset::LabelFields;
use meshmark_verification::{
    Error as Mismatch,
    verify::{ReadRecord, check_key, is_made_from},
};
use serde_json::{Value, json};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

/// What a deposit fixes.
pub struct Deposited<'a> {
    /// The secret key.
    pub key: &'a SecretKey,
    /// The references.
    pub references: &'a [PathBuf],
    /// The folder of the records.
    pub records: &'a Path,
    /// The public key that the deposit is signed with, hexadecimal.
    pub public_key: String,
}

/// Creates the statement. Every record must be of the key and of one of the references; `warn`
/// receives the names of files that are no records.
///
/// # Errors
/// Fails on unreadable input, on a record that does not belong, and on a folder without records.
pub fn make(deposited: &Deposited, warn: &mut dyn FnMut(&str)) -> Result<Statement> {
    let Deposited { key, references, records: folder, public_key } = deposited;
    let records = texts::records(folder, warn)?;
    if records.is_empty() {
        return Err(Error::NoRecord { folder: (*folder).into() });
    }
    records.iter().try_for_each(|(path, read)| {
        check_key(&read.record, key)
            .map_err(|source| Error::OfRecord { path: path.clone(), source: Box::new(source.into()) })
    })?;
    let vertices = vertices_of_all(references, &records)?;
    let of_none = |(_, read): &&(PathBuf, ReadRecord)| {
        !vertices.iter().any(|one| is_made_from(&read.record, &one.vertices_sha256))
    };
    if let Some((path, _)) = records.iter().find(of_none) {
        let source = Box::new(Mismatch::NoReferenceOfRecord { references: references.len() }.into());
        return Err(Error::OfRecord { path: path.clone(), source });
    }
    let recipient = |read: &ReadRecord| {
        let options = read.record.options().ok()?;
        Some(key.blinded(options.subject.as_ref().and_then(MarkSubject::recipient)?))
    };
    let mut marks: Vec<Value> = records.iter().map(|(_, read)| mark_of(&read.record)).collect();
    marks.sort_by_key(Value::to_string); // whatever the names of the files
    marks.dedup();
    let predicate = Predicate {
        software: versions(),
        public_key: public_key.clone(),
        key_commitment: key.commitment(),
        references: vertices,
        marks,
        records: Tree::new(records.iter().map(|(_, read)| read.sha256.clone()).collect()),
        recipients: Tree::new(records.iter().filter_map(|(_, read)| recipient(read)).collect()),
    };
    Ok(Statement::new(subjects(references)?, predicate))
}

/// Returns the files of the references with their digests.
fn subjects(references: &[PathBuf]) -> Result<Vec<Subject>> {
    let mut subjects = Vec::new();
    for path in references {
        let files = files_digests(path)?;
        if files.is_empty() {
            return Err(Error::NoFileToDeposit { path: path.clone() });
        }
        let new = files
            .into_iter()
            .map(|(name, sha256)| Subject { name, digest: BTreeMap::from([("sha256".to_string(), sha256)]) });
        add_new(&mut subjects, new);
    }
    Ok(subjects)
}

/// Adds what is not there yet: who names a reference twice deposits it once.
fn add_new<T: PartialEq>(all: &mut Vec<T>, more: impl IntoIterator<Item = T>) {
    for one in more {
        if !all.contains(&one) {
            all.push(one);
        }
    }
}

/// Returns the vertices of every reference: of the layers that its records name, or of all layers
/// where it has no record.
fn vertices_of_all(references: &[PathBuf], records: &[(PathBuf, ReadRecord)]) -> Result<Vec<Vertices>> {
    let mut readings: Vec<(Option<Vec<String>>, Option<String>)> = Vec::new();
    for (_, read) in records {
        let Options { layers, srs, .. } = read.record.options()?;
        if !readings.contains(&(layers.clone(), srs.clone())) {
            readings.push((layers, srs));
        }
    }
    let mut all = Vec::new();
    for path in references {
        let mut found = Vec::new();
        for (layers, srs) in &readings {
            match vertices(path, layers.as_ref(), srs.as_ref()) {
                Ok(vertices) => found.push(vertices),
                Err(error) if error.is_about_options() => {} // these records are of another reference
                Err(error) => return Err(error),
            }
        }
        found.retain(|one| records.iter().any(|(_, read)| is_made_from(&read.record, &one.vertices_sha256)));
        if found.is_empty() {
            found.push(vertices(path, None, None)?);
        }
        add_new(&mut all, found);
    }
    Ok(all)
}

/// Reads the vertices of a reference.
pub fn vertices(path: &Path, layers: Option<&Vec<String>>, srs: Option<&String>) -> Result<Vertices> {
    let reading = Reading {
        layers: layers.map(Vec::as_slice),
        srs: srs.map(String::as_str),
        recorded_crs: None,
        landmarks: LabelFields::None,
        geometries: false,
    };
    let survey = maps::reference(path, &reading)?;
    Ok(Vertices {
        reference: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        layers: layers.cloned(),
        srs: srs.cloned(),
        vertices: survey.data.vertices.len(),
        vertices_sha256: survey.data.vertices.digest(),
    })
}

/// Returns the parameters of a mark.
fn mark_of(record: &Recorded) -> Value {
    match record {
        Recorded::Message(record) => {
            json!({ "version": record.meshmark_record, "parameters": record.parameters })
        }
        Recorded::Fingerprint(record) => {
            json!({ "version": record.meshmark_record, "parameters": record.mark })
        }
    }
}
