//! The product as its users have it: the driver inside `ogr2ogr`, and the command `meshmark`.

use crate::{Result, attacks::Random, built};
use meshmark_core::{key::SecretKey, options::Spelling};
use serde::{Deserialize, Serialize};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    process::{Command, Output},
};

/// A build of driver and command.
#[derive(Debug, Clone)]
pub struct Product {
    meshmark: PathBuf,
    plugins: PathBuf,
    /// Further options of the driver, NAME=value, that shape every mark.
    options: Vec<String>,
}

/// What the mark carries, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Profile {
    pub code: &'static str,
    pub chip_rate: usize,
}

impl Profile {
    /// Returns repetition as in the paper: every bit is c chips.
    pub const fn repetition(chip_rate: usize) -> Self {
        Profile { code: "REPETITION", chip_rate }
    }

    /// LDPC: 256 code bits of one chip each, with the displacement of c = 2.
    pub const LDPC: Profile = Profile { code: "LDPC", chip_rate: 1 };

    /// The fingerprint of the recipient, with the defaults.
    pub const FINGERPRINT: Profile = Profile { code: "FINGERPRINT", chip_rate: 0 };

    /// Returns the options that ask for it.
    fn options(self) -> Vec<(&'static str, String)> {
        match self {
            Profile::FINGERPRINT => Vec::new(),
            Profile { code, chip_rate } => {
                vec![("CODE", code.into()), ("CHIP_RATE", chip_rate.to_string())]
            }
        }
    }

    /// Returns a short name.
    pub fn name(&self) -> String {
        match self {
            &Profile::FINGERPRINT => "fingerprint".into(),
            &Profile::LDPC => "LDPC".into(),
            other => format!("c={}", other.chip_rate),
        }
    }
}

/// The settings of a marked copy.
#[derive(Debug, Clone, Copy)]
pub struct Marking<'a> {
    pub key: &'a Path,
    pub recipient: &'a str,
    pub profile: Profile,
    /// Grid of the output, CRS units.
    pub precision: f64,
}

/// The copy for which a suspect is verified.
#[derive(Debug, Clone, Copy)]
pub enum Asked<'a> {
    /// The copy of this record.
    Record(&'a Path),
    /// A copy with these settings.
    Marking(Marking<'a>),
}

/// The part of the output of `meshmark verify --json` that is used here.
#[derive(Debug, Clone, Deserialize)]
#[allow(missing_docs)] // the names are those of the report
pub struct Report {
    pub verdict: String,
    pub reason: String,
    pub bits: Vec<f64>,
    pub bit_errors: Option<usize>,
    pub p_value_log10: Option<f64>,
    pub p_mark_log10: Option<f64>,
    pub p_recipient_log10: Option<f64>,
    pub registration: Registration,
    pub vertices: Vertices,
    pub seconds: BTreeMap<String, f64>,
}

/// The registration of the suspect.
#[derive(Debug, Clone, Deserialize)]
#[allow(missing_docs)]
pub struct Registration {
    pub method: String,
    pub affine: [f64; 6],
    pub landmarks: usize,
    pub rms_m: Option<f64>,
}

/// Distinct vertices.
#[derive(Debug, Clone, Copy, Deserialize)]
#[allow(missing_docs)]
pub struct Vertices {
    pub reference: usize,
    pub suspect: usize,
    pub matched: usize,
}

impl Product {
    /// Returns the build in a folder: `meshmark` and `gdalplugins/ogr_MESHMARK.so`.
    ///
    /// # Errors
    /// Fails with a sentence that names the missing one.
    pub fn in_folder(folder: &Path) -> Result<Self> {
        // GDAL looks for the driver from wherever the host runs.
        let folder = folder.canonicalize().map_err(|e| format!("{}: {e}", folder.display()))?;
        let (meshmark, plugins) = (folder.join("meshmark"), folder.join("gdalplugins"));
        let product = Product { meshmark, plugins, options: Vec::new() };
        for file in [product.meshmark.clone(), product.plugins.join("ogr_MESHMARK.so")] {
            if !file.is_file() {
                return Err(format!("{} is not there: run `make build` first", file.display()).into());
            }
        }
        Ok(product)
    }

    /// Returns the build to which this program or test belongs.
    ///
    /// # Errors
    /// Fails like [`Product::in_folder`], and when a source is newer than the build.
    pub fn of_this_build() -> Result<Self> {
        let folder = built::folder()?;
        let product = Self::in_folder(&folder)?;
        built::check(&product.meshmark, &folder.join("meshmark.d"))?;
        built::check(&product.plugins.join("ogr_MESHMARK.so"), &folder.join("libmeshmark_plugin.d"))?;
        Ok(product)
    }

    /// Adds options of the driver, NAME=value.
    pub fn with_options(self, options: Vec<String>) -> Self {
        Product { options, ..self }
    }

    /// Returns the output of `meshmark --version`.
    ///
    /// # Errors
    /// Fails when the command cannot be run.
    pub fn version(&self) -> Result<String> {
        let output = self.meshmark().arg("--version").output()?;
        Ok(String::from_utf8_lossy(&output.stdout).trim().to_string())
    }

    /// Returns the path of the command `meshmark`.
    pub fn meshmark(&self) -> Command {
        Command::new(&self.meshmark)
    }

    /// Returns the folder of the driver.
    pub fn plugins(&self) -> &Path {
        &self.plugins
    }

    /// Returns the command `ogr2ogr` with the driver.
    pub fn ogr2ogr(&self) -> Command {
        let mut command = Command::new("ogr2ogr");
        command.env("GDAL_DRIVER_PATH", &self.plugins);
        command
    }

    /// Marks `source` as the driver does on export, with a record beside the marked GeoPackage.
    ///
    /// # Errors
    /// Fails with the output of `ogr2ogr`.
    pub fn mark(&self, source: &Path, marked: &Path, record: &Path, marking: Marking) -> Result<()> {
        let options = [
            ("KEY", marking.key.display().to_string()),
            ("RECIPIENT", marking.recipient.into()),
            ("PRECISION", marking.precision.to_string()),
            ("RECORD", record.display().to_string()),
        ];
        self.export(source, marked, options.into_iter().chain(marking.profile.options()))
    }

    /// Marks `source` on export to a GeoPackage with these options of the driver and those of the
    /// product.
    ///
    /// # Errors
    /// Fails with the output of `ogr2ogr`.
    pub fn export(
        &self,
        source: &Path,
        marked: &Path,
        options: impl IntoIterator<Item = (&'static str, String)>,
    ) -> Result<()> {
        let options = options.into_iter().map(|(name, value)| format!("{name}={value}"));
        let options = options.chain(self.options.iter().cloned());
        let arguments =
            marking_arguments("GPKG", &marked.display().to_string(), &source.display().to_string(), options);
        let output = self.ogr2ogr().arg("-q").args(arguments).output();
        let output = output.map_err(|e| format!("ogr2ogr cannot be run: {e}"))?;
        match output.status.success() {
            true => Ok(()),
            false => Err(format!("marking {}: {}", source.display(), printed(&output)).into()),
        }
    }

    /// Verifies a suspect, on one thread.
    ///
    /// # Errors
    /// Fails with the output of `meshmark` when it gives no verdict.
    pub fn verify(
        &self,
        key: &Path,
        reference: &Path,
        asked: Asked,
        demodulator: &str,
        registration: &str,
        suspect: &Path,
    ) -> Result<Report> {
        let mut command = self.meshmark();
        command.env("RAYON_NUM_THREADS", "1").args(["verify", "--json", "--demodulator", demodulator]);
        command.args(["--registration", registration]);
        command.arg("--key").arg(key).arg("--reference").arg(reference);
        match asked {
            Asked::Record(record) => command.arg("--record").arg(record),
            Asked::Marking(marking) => command
                .args(["--recipient", marking.recipient])
                .args(
                    marking
                        .profile
                        .options()
                        .into_iter()
                        .map(|(name, value)| Spelling::Flag.value(name, value)),
                )
                .arg(format!("--precision={}", marking.precision))
                .args(self.options.iter().map(|option| format!("--{}", option.to_lowercase()))),
        };
        let output = command.arg(suspect).output()?;
        // Codes 0 (match), 1 (no match) and 3 (inconclusive) are verdicts; all others are failures.
        match output.status.code() {
            Some(0 | 1 | 3) => Ok(serde_json::from_slice(&output.stdout)?),
            code => Err(format!("meshmark verify, exit code {code:?}: {}", printed(&output)).into()),
        }
    }
}

/// Returns the arguments with which `ogr2ogr` marks `source` on export; `options` are those of the
/// driver, NAME=value.
pub fn marking_arguments(
    format: &str,
    marked: &str,
    source: &str,
    options: impl IntoIterator<Item = String>,
) -> Vec<String> {
    let fixed = ["-f".into(), format.into(), marked.into(), format!("MESHMARK:{source}")];
    fixed.into_iter().chain(options.into_iter().flat_map(|option| ["-oo".into(), option])).collect()
}

fn printed(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).trim().to_string()
}

/// Writes a key file whose secret follows from a seed, as experiments must be repeatable.
///
/// # Errors
/// Fails when the file cannot be written.
pub fn write_key(path: &Path, seed: u64) -> Result<()> {
    let key = random_key(&mut Random::new(seed));
    Ok(std::fs::write(path, key.to_json().as_bytes())?)
}

/// Returns the next key of a stream.
pub fn random_key(random: &mut Random) -> SecretKey {
    let mut secret = [0; 32];
    secret.chunks_mut(8).for_each(|bytes| bytes.copy_from_slice(&random.seed().to_le_bytes()));
    SecretKey::from_bytes(secret)
}
