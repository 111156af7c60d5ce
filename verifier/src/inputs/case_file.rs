//! The case file: what an examiner writes about a case, for the report.

use crate::{Error, Result, inputs::texts};
use meshmark_verification::report::Case;
use serde::Deserialize;
use std::path::Path;

/// The file, TOML.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CaseFile {
    number: Option<String>,
    examiner: Option<String>,
    date: Option<Date>,
    #[serde(default)]
    custody: Vec<String>,
}

/// A date of TOML, or one in words.
#[derive(Deserialize)]
#[serde(untagged)]
enum Date {
    Date(toml::value::Datetime),
    Words(String),
}

/// Reads a case file.
///
/// # Errors
/// Fails on a file that is unreadable, no TOML, or has other fields.
pub fn read(path: &Path) -> Result<Case> {
    let text = texts::small("case file", path)?;
    let CaseFile { number, examiner, date, custody } = toml::from_str(&text)
        .map_err(|error| Error::CaseFile { path: path.into(), reason: error.message().into() })?;
    let date = date.map(|date| match date {
        Date::Date(date) => date.to_string(),
        Date::Words(words) => words,
    });
    Ok(Case { number, examiner, date, custody })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Case> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        read(file.path())
    }

    #[test]
    fn a_case_file_may_have_any_of_its_fields_and_no_other() {
        let case =
            parse("number = \"7/26\"\nexaminer = \"A. B.\"\ndate = 2026-11-28\ncustody = [\"a\", \"b\"]\n")
                .unwrap();
        assert_eq!(
            case,
            Case {
                number: Some("7/26".into()),
                examiner: Some("A. B.".into()),
                date: Some("2026-11-28".into()),
                custody: vec!["a".into(), "b".into()],
            }
        );
        assert_eq!(parse("date = \"28 November 2026\"").unwrap().date.as_deref(), Some("28 November 2026"));
        assert_eq!(
            parse("").unwrap(),
            Case { number: None, examiner: None, date: None, custody: Vec::new() }
        );
        for (bad, words) in
            [("numbr = \"7\"", "unknown field"), ("number = 7", "invalid type"), ("number", "")]
        {
            let error = parse(bad).unwrap_err().to_string();
            assert!(error.starts_with("the case file ") && error.contains(words), "{error}");
        }
    }
}
