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
    let mut arguments = arguments.skip(1).peekable();
    let mut words = vec!["meshmark".to_string()];
    if arguments.next_if(|first| first == EXAMINE).is_some() {
        arguments.next();
        words.push("verify".into());
    } else {
        words.extend(arguments.next());
    }
    let (options, files) = split(repeatable(arguments));
    words.extend(options.iter().map(|word| quoted(word)));
    words.extend(["--report".into(), "report.html".into()]);
    words.extend(files.iter().map(|word| quoted(word)));
    words.join(" ")
}

/// Returns the arguments of this `verify` that another machine can repeat.
pub fn own_repeatable() -> Vec<String> {
    repeatable(std::env::args_os().skip(2).map(|word| word.to_string_lossy().into_owned()))
}

/// Returns arguments without those that only name outputs, the limits of a machine, or where a
/// passphrase is.
pub fn repeatable(arguments: impl Iterator<Item = String>) -> Vec<String> {
    const WITH_VALUE: [&str; 6] =
        ["--report", "--evidence-map", "--bundle", "--passphrase-file", "--memory-limit", "--time-limit"];
    let (options, files) = split(arguments.collect());
    let (mut kept, mut options) = (Vec::new(), options.into_iter());
    while let Some(word) = options.next() {
        let has_value = |name: &&str| word.strip_prefix(*name).is_some_and(|rest| rest.starts_with('='));
        match word.as_str() {
            name if WITH_VALUE.contains(&name) => drop(options.next()),
            "--json" | "--explain" => {}
            _ if WITH_VALUE.iter().any(has_value) => {}
            _ => kept.push(word),
        }
    }
    kept.extend(files);
    kept
}

/// Divides arguments into those before "--" and the rest, of which no word is an option.
fn split(mut arguments: Vec<String>) -> (Vec<String>, Vec<String>) {
    let end = arguments.iter().position(|word| word == "--").unwrap_or(arguments.len());
    let files = arguments.split_off(end);
    (arguments, files)
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
