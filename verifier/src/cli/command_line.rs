//! The command line in a report, which a shell accepts.

use super::arguments::EXAMINE;
use meshmark_verifier::words::quoted;
use std::ffi::{OsStr, OsString};

/// Returns the arguments of the child that examines the suspect of this `verify` in a folder.
pub fn of_examination(folder: &OsStr) -> impl Iterator<Item = OsString> {
    let own = std::env::args_os().skip(2); // without the names of the program and the subcommand
    [EXAMINE.into(), folder.into()].into_iter().chain(own)
}

/// Returns the command line of this process in the form that a report shows.
pub fn own() -> String {
    shown(std::env::args_os().map(|word| word.to_string_lossy().into_owned()))
}

/// Returns a command line without options that only name outputs, and with the report as
/// `report.html`. That of a child is the one of its parent.
fn shown(arguments: impl Iterator<Item = String>) -> String {
    let mut words = vec!["meshmark".to_string()];
    let mut arguments = arguments.skip(1).peekable();
    if arguments.next_if(|first| first == EXAMINE).is_some() {
        arguments.next();
        words.push("verify".into());
    }
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
        let line = |words: &[&str]| shown(words.iter().map(|w| w.to_string()));
        assert_eq!(
            line(&[
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
            line(&["meshmark", "verify", "it's\u{202e}a\\b\n.gpkg"]),
            r"meshmark verify $'it\'s\u202ea\\b\u000a.gpkg' --report report.html"
        );
        assert_eq!(
            line(&["meshmark", "examine", "/tmp/folder", "--json", "examine"]),
            "meshmark verify examine --report report.html"
        );
        assert_eq!(
            line(&["meshmark", "compare", "--report", "a.html", "--", "--json", "-b.gpkg"]),
            "meshmark compare --report report.html -- --json -b.gpkg"
        );
    }
}
