//! What `--explain` prints: the report in sentences, for one who must rely on it.

use crate::{
    Error, Result,
    report::{Report, power_of_ten, printable},
};
use sha2::{Digest, Sha256};
use std::{
    fmt::Write as _,
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

/// The files of a verification, digested before they are read as maps.
pub struct Inputs {
    key: Digested,
    reference: Digested,
    suspect: Digested,
}

/// A file or folder and what identifies it.
struct Digested {
    name: String,
    /// "SHA-256 …", or why there is none.
    digest: String,
}

impl Inputs {
    /// Digests the files.
    ///
    /// # Errors
    /// One of them cannot be read to its end.
    pub fn read(key: &Path, reference: &Path, suspect: &Path) -> Result<Self> {
        let (key, reference, suspect) = (digest(key)?, digest(reference)?, digest(suspect)?);
        Ok(Inputs { key, reference, suspect })
    }

    /// The report in sentences. `record` and `records` are where the record, or the records, came from.
    ///
    /// # Errors
    /// The record cannot be read any more.
    pub fn explain(&self, report: &Report, record: Option<&Path>, records: Option<&Path>) -> Result<String> {
        let best = report.candidates.as_ref().and_then(|c| c.list.first());
        let path = record.map(Path::to_path_buf).or_else(|| Some(records?.join(&best?.record)));
        let record = path.as_deref().map(digest).transpose()?;
        let sections = [
            ("What was compared", self.compared(report, record.as_ref())),
            ("What was found", found(report)),
            ("What the message is bound to", bound(report)),
            ("What was not tested", NOT_TESTED.map(String::from).to_vec()),
            ("What makes this evidence", self.deposit(report, record.as_ref())),
        ];
        let mut text = String::new();
        for (title, sentences) in sections {
            let _ = writeln!(text, "{title}");
            sentences.iter().for_each(|sentence| {
                let _ = writeln!(text, "  {sentence}");
            });
        }
        Ok(text)
    }

    fn compared(&self, report: &Report, record: Option<&Digested>) -> Vec<String> {
        let (v, p) = (&report.vertices, &report.parameters);
        let suspect_crs = match report.suspect_crs.as_slice() {
            [] => "no layer".into(),
            crs => crs.join(" and "),
        };
        let mut sentences = vec![
            format!(
                "The suspect {} has {} distinct vertices in {suspect_crs}.",
                self.suspect.name, v.suspect
            ),
            format!(
                "The reference {} has {} distinct vertices in {}.",
                self.reference.name,
                v.reference,
                p.crs.as_deref().unwrap_or("no CRS")
            ),
            format!("The key {} has the public id {}.", self.key.name, p.key_id),
        ];
        sentences.push(match record {
            Some(record) => format!("The record {} belongs to this key and this reference.", record.name),
            None => "There was no record: how the map was marked was taken from the command line.".into(),
        });
        sentences.push(format!("File of the suspect: {}.", self.suspect.digest));
        sentences
    }

    fn deposit(&self, report: &Report, record: Option<&Digested>) -> Vec<String> {
        let mut sentences = vec![
            "Whoever has the key and the reference can mark a map for any recipient, also afterwards, and can try \
             keys until one seems to fit."
                .into(),
            "So reference, key and record must have been deposited with someone else before the copy was handed \
             out, or these digests of them:"
                .into(),
            format!("Vertices of the reference: SHA-256 {}.", report.reference_digest),
            format!("File of the reference: {}.", self.reference.digest),
            format!("File of the key: {}; its id is {}.", self.key.digest, report.parameters.key_id),
        ];
        sentences.extend(record.map(|record| format!("File of the record: {}.", record.digest)));
        sentences
    }
}

const NOT_TESTED: [&str; 4] = [
    "Who passed the map on: the mark says whose copy it was made from.",
    "Attributes, styles and which features are there: the mark is in the coordinates alone.",
    "When the mark was made, and whether key and record are older than the suspect.",
    "Other keys and other references: the p-values hold for one key and one reference fixed beforehand.",
];

fn found(report: &Report) -> Vec<String> {
    let (v, p) = (&report.vertices, &report.parameters);
    let mut sentences = assumed(report);
    sentences.push(format!(
        "{} of the {} reference vertices have a counterpart within {} m, the suspect being brought onto the reference \
         by {}.",
        v.matched, v.reference, p.radius_m, report.registration.method
    ));
    let Some(message) = &report.message else {
        sentences.push(format!("Nothing was demodulated: {}.", report.reason));
        return sentences;
    };
    let errors = report.bit_errors.map_or(String::new(), |errors| {
        format!(", which differs from the expected message in {errors} of {} bits", report.bits.len())
    });
    sentences.push(format!("The suspect was read as the message {message}{errors}."));
    sentences.extend(report.decoding().map(|how| format!("How it was decoded: {how}.")));
    sentences.extend(probabilities(report));
    sentences.push(format!("The verdict is {}: {}.", report.verdict_name(), report.reason));
    sentences
}

/// What was assumed to bring the suspect onto the reference, beyond an affine map.
fn assumed(report: &Report) -> Vec<String> {
    let registration = &report.registration;
    let read_as = registration.read_as.as_ref().map(|read_as| {
        let why = match report.suspect_crs.iter().all(|crs| crs == "no CRS") {
            true => "has no CRS",
            false => "does not lie there under the CRS it claims",
        };
        format!("The suspect {why}; its coordinates were read as {read_as}.")
    });
    let polynomial = registration.polynomial.map(|_| {
        "An affine map left a smooth distortion, which a cubic polynomial took away: with it clearly more vertices \
         match."
            .into()
    });
    read_as.into_iter().chain(polynomial).collect()
}

fn probabilities(report: &Report) -> Vec<String> {
    let mut sentences = Vec::new();
    if let Some(p) = report.p_mark_log10 {
        sentences.push(format!(
            "A key that was not used shows so much evidence for this message with a probability of {}, whatever was \
             done to the map.",
            power_of_ten(p)
        ));
    }
    if let Some(decoys) = &report.decoys {
        let tested = decoys.tested.map_or(String::new(), |t| format!("; the tested key scores {t:.1}"));
        sentences.push(format!(
            "To check that, {} decoy keys were tried on this suspect: they score {:.2} on average, with a standard \
             deviation of {:.2} and at most {:.1}{tested}.",
            decoys.count, decoys.mean, decoys.standard_deviation, decoys.largest
        ));
    }
    if let Some(p) = report.p_recipient_log10 {
        sentences.push(format!(
            "A recipient of this key who has nothing to do with the copy agrees so well with a probability of {}.",
            power_of_ten(p)
        ));
    }
    if let Some(p) = report.p_any_message_log10 {
        sentences.push(format!(
            "A key that was not used shows so much evidence for any message at all with a probability of {}.",
            power_of_ten(p)
        ));
    }
    if let (Some(candidates), Some(p)) = (&report.candidates, report.p_value_log10) {
        sentences.push(format!(
            "{} records were tried, so the larger of the probabilities for key and recipient counts {} times: {}.",
            candidates.tried,
            candidates.tried,
            power_of_ten(p)
        ));
    }
    sentences
}

/// What the message says of a person.
fn bound(report: &Report) -> Vec<String> {
    let p = &report.parameters;
    let sentence = match (&p.recipient, &p.expected_message) {
        (Some(recipient), Some(message)) => format!(
            "The message {message} was computed again from the key and the recipient \"{}\": it is a keyed hash of \
             the two and cannot be chosen.",
            printable(recipient)
        ),
        (None, Some(message)) => format!(
            "The message {message} was given as bare bits: nothing in it names a recipient, and who received it must be \
             shown by other means."
        ),
        _ => "No message was expected, so no recipient is named.".into(),
    };
    vec![sentence]
}

/// SHA-256 of a file; of a folder, or a file with companions of the same name, that of the sorted list of
/// their digests as `sha256sum` prints it.
fn digest(path: &Path) -> Result<Digested> {
    let failed = |error: io::Error| {
        Error::Unreadable(format!("{} cannot be read to its end: {error}", path.display()))
    };
    let name = printable(&path.display().to_string());
    let files = files_of(path).map_err(failed)?;
    let digest = match files.as_slice() {
        [] => "it is not a local file, so it has no digest".into(),
        [file] if file == path => format!("SHA-256 {}", file_digest(file).map_err(failed)?),
        files => {
            let mut list = String::new();
            for file in files {
                let name = file.file_name().unwrap_or_default().to_string_lossy();
                let _ = writeln!(list, "{}  {name}", file_digest(file).map_err(failed)?);
            }
            format!("SHA-256 {} of the sha256sum list of its {} files", hex(list.as_bytes()), files.len())
        }
    };
    Ok(Digested { name, digest })
}

/// Formats of several files with the same name.
const WITH_COMPANIONS: &[&str] = &["shp", "shx", "dbf", "tab", "mif"];

/// The files that make up a map, sorted.
fn files_of(path: &Path) -> io::Result<Vec<PathBuf>> {
    if path.is_file() {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if !WITH_COMPANIONS.contains(&extension.as_str()) {
            return Ok(vec![path.into()]);
        }
    } else if !path.is_dir() {
        return Ok(Vec::new());
    }
    let folder = match path.parent() {
        _ if path.is_dir() => path,
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut files = Vec::new();
    for entry in folder.read_dir()? {
        let file = entry?.path();
        if file.is_file() && (path.is_dir() || file.file_stem() == path.file_stem()) {
            files.push(file);
        }
    }
    files.sort();
    Ok(files)
}

fn file_digest(path: &Path) -> io::Result<String> {
    let (mut file, mut hash) = (File::open(path)?, Sha256::new());
    let mut buffer = vec![0; 1 << 20];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(digits(&hash.finalize())),
            count => hash.update(&buffer[..count]),
        }
    }
}

fn hex(bytes: &[u8]) -> String {
    digits(&Sha256::digest(bytes))
}

fn digits(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SHA-256 of "abc" (FIPS 180-4).
    const ABC: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

    #[test]
    fn a_file_has_its_own_digest_and_a_folder_that_of_its_sorted_list() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        for name in ["b.shp", "a.dbf", "a.shp"] {
            std::fs::write(file(name), "abc").unwrap();
        }
        std::fs::write(file("map.gpkg"), "abc").unwrap();
        assert_eq!(digest(&file("map.gpkg")).unwrap().digest, format!("SHA-256 {ABC}"));
        let list = |names: &[&str]| names.iter().map(|n| format!("{ABC}  {n}\n")).collect::<String>();
        let expected = hex(list(&["a.dbf", "a.shp"]).as_bytes());
        assert_eq!(
            digest(&file("a.shp")).unwrap().digest,
            format!("SHA-256 {expected} of the sha256sum list of its 2 files")
        );
        let all = hex(list(&["a.dbf", "a.shp", "b.shp", "map.gpkg"]).as_bytes());
        assert!(digest(folder.path()).unwrap().digest.contains(&all));
        assert!(digest(&file("none")).unwrap().digest.contains("no digest"));
    }
}
