//! The manifest of a bundle: the command, the inputs with their digests, and the versions.

use super::{JSON, MANIFEST, PAGE};
use crate::{
    Error, Result,
    inputs::{digests, plain, texts::possible_records, versions::versions_and_program},
};
use meshmark_core::{counted, hex};
use meshmark_dataset::file_digest;
use meshmark_verification::words::printable;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::{Component, Path, PathBuf};

/// The version of this format.
const VERSION: u32 = 1;

/// What an input is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)] // the names are those of the flags
pub enum Role {
    Suspect,
    Key,
    Reference,
    Record,
    Records,
    Case,
    Deposit,
    PublicKey,
    TimeStamp,
    Authorities,
}

impl Role {
    /// Returns whether the input itself is in the bundle. The others are secret, large or of others.
    fn is_enclosed(self) -> bool {
        matches!(self, Role::Case | Role::Deposit | Role::PublicKey | Role::TimeStamp | Role::Authorities)
    }
}

/// An input of a command line.
pub type Used<'a> = (Role, &'a Path);

/// An input, as a manifest describes it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// What it is for.
    pub role: Role,
    /// Its path in the folder of the case.
    pub path: String,
    /// Its digest.
    pub digest: String,
}

/// All that is needed to make a bundle again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of this format.
    meshmark_bundle: u32,
    /// The programs that made it, with their versions.
    pub versions: Vec<String>,
    /// The arguments of `meshmark verify`, without those that name outputs.
    pub arguments: Vec<String>,
    /// The inputs.
    pub inputs: Vec<Input>,
}

impl Manifest {
    /// Describes a command and its inputs.
    ///
    /// # Errors
    /// Fails on an input that lies outside the current folder, so that nobody else has it in the same
    /// place, that is not there, or whose name is one of the bundle.
    pub fn new(arguments: Vec<String>, used: &[Used]) -> Result<Self> {
        let inputs = used.iter().map(|(role, path)| {
            let path = repeatable(*role, path)?;
            Ok(Input { role: *role, digest: digest(*role, Path::new(path))?, path: path.into() })
        });
        let inputs = inputs.collect::<Result<_>>()?;
        Ok(Manifest { meshmark_bundle: VERSION, versions: versions_and_program()?, arguments, inputs })
    }

    /// Reads a manifest.
    pub(super) fn from_json(bytes: &[u8]) -> std::result::Result<Self, String> {
        let manifest: Manifest = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
        match manifest.meshmark_bundle {
            VERSION => Ok(manifest),
            other => Err(format!("it is of version {other}, and this program reads version {VERSION}")),
        }
    }

    pub(super) fn to_json(&self) -> Vec<u8> {
        let text = serde_json::to_string_pretty(self).expect("strings are JSON");
        (text + "\n").into_bytes()
    }

    /// Returns the inputs that are in the bundle themselves.
    pub(super) fn enclosed(&self) -> impl Iterator<Item = &Input> {
        self.inputs.iter().filter(|input| input.role.is_enclosed())
    }

    /// Returns which inputs in the current folder are not those of the manifest, and why.
    pub fn other_inputs(&self) -> Vec<String> {
        let other = |input: &Input| {
            let (path, name) = (Path::new(&input.path), printable(&input.path));
            match repeatable(input.role, path).and_then(|_| digest(input.role, path)) {
                Ok(found) if found == input.digest => None,
                Ok(found) => Some(format!("{name} is another one ({found}, not {})", input.digest)),
                Err(_) if !path.exists() && input.role.is_enclosed() => {
                    Some(format!("{name} is missing, which the bundle holds: unzip it here"))
                }
                Err(_) if !path.exists() => Some(format!("{name} is missing")),
                Err(error) => Some(error.to_string()),
            }
        };
        self.inputs.iter().filter_map(other).collect()
    }
}

/// Returns the path of an input that another machine can have in the same place.
fn repeatable(role: Role, path: &Path) -> Result<&str> {
    let refused = |reason: &str| Err(Error::NotBundled { path: path.into(), reason: reason.into() });
    let Some(name) = path.to_str() else { return refused("its name is no UTF-8: rename it") };
    if !path.components().all(|part| matches!(part, Component::Normal(_))) {
        return refused(
            "it does not lie in the current folder, where others can have it as well: work in a folder that holds all \
             files of the case, and name them from there",
        );
    }
    if role.is_enclosed() && [PAGE, JSON, MANIFEST].contains(&name) {
        return refused("the bundle has a file of this name itself: rename it");
    }
    let folder_is_wanted = role == Role::Records;
    match path.is_file() || path.is_dir() && (folder_is_wanted || !role.is_enclosed()) {
        true => Ok(name),
        false => refused("it is no local file: give one"),
    }
}

/// Returns the digest of an input. That of a folder of records names none of them.
fn digest(role: Role, path: &Path) -> Result<String> {
    if role != Role::Records {
        return Ok(digests::digest(path)?.digest);
    }
    let files = possible_records(path)?;
    let digested = |file: &PathBuf| {
        plain::check("record", file)?;
        file_digest(file).map_err(|source| Error::Undigested { path: file.clone(), source })
    };
    let mut found = files.iter().map(digested).collect::<Result<Vec<_>>>()?;
    found.sort();
    let all = hex::encode(&Sha256::digest(found.join("\n")));
    Ok(format!("SHA-256 {all} of the sorted digests of {}", counted(found.len(), "file")))
}
