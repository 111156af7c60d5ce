//! The parts of a report file beyond the answer.

use super::sketch::Sketch;
use crate::{inputs::digests::Inputs, words::quoted};
use serde::Serialize;

/// The places of the evidence on the map.
#[derive(Debug, Clone, Serialize)]
pub struct Evidence {
    /// The thinned map.
    #[serde(flatten)]
    pub sketch: Sketch,
    /// For every patch, the number of standard deviations by which its evidence for the message
    /// exceeds that of a random key; null where no displacement was observed. Empty when nothing
    /// was decoded or no message was expected.
    pub patch_scores: Vec<Option<f64>>,
}

/// The compared data, and the means to repeat the verification.
#[derive(Debug, Clone, Serialize)]
pub struct Provenance {
    /// The files.
    #[serde(flatten)]
    pub inputs: Inputs,
    /// Digest of the vertices of the reference.
    pub reference_vertices_sha256: String,
    /// CRS of the layers of the suspect.
    pub suspect_crs: Vec<String>,
    /// The command line.
    pub command: String,
    /// Programs and libraries that the result depends on, with their versions.
    pub versions: Vec<String>,
}

/// Returns the versions of this program and of GDAL, which reads the maps.
pub fn versions() -> Vec<String> {
    let gdal = gdal::version::VersionInfo::release_name();
    vec![format!("meshmark {}", env!("CARGO_PKG_VERSION")), format!("GDAL {gdal}")]
}

/// Returns a command line without options that only name outputs, and with the report as
/// `report.html`.
pub fn command_line(arguments: impl Iterator<Item = String>) -> String {
    let mut words = vec!["meshmark".to_string()];
    let mut arguments = arguments.skip(1);
    let mut files = Vec::new(); // after "--" no word is an option
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--" => {
                files = std::iter::once("--".into()).chain(arguments.by_ref()).map(|w| quoted(&w)).collect()
            }
            "--report" | "--evidence-map" => drop(arguments.next()),
            "--json" | "--explain" => {}
            word if word.starts_with("--report=") || word.starts_with("--evidence-map=") => {}
            word => words.push(quoted(word)),
        }
    }
    words.extend(["--report".into(), "report.html".into()]);
    words.extend(files);
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_line_can_be_given_to_a_shell_and_does_not_name_its_output() {
        let of = |words: &[&str]| command_line(words.iter().map(|w| w.to_string()));
        assert_eq!(
            of(&[
                "/opt/meshmark",
                "verify",
                "--report",
                "a.html",
                "--evidence-map",
                "a.gpkg",
                "--json",
                "it's Ä map.gpkg",
                "--report=b.html"
            ]),
            r"meshmark verify 'it'\''s Ä map.gpkg' --report report.html"
        );
        assert_eq!(
            of(&["meshmark", "verify", "it's\u{202e}a\\b\n.gpkg"]),
            r"meshmark verify $'it\'s\u202ea\\b\u000a.gpkg' --report report.html"
        );
        assert_eq!(
            of(&["meshmark", "compare", "--report", "a.html", "--", "--json", "-b.gpkg"]),
            "meshmark compare --report report.html -- --json -b.gpkg"
        );
    }
}
