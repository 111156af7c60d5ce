//! The list of recipients: a CSV file with a column `recipient`, or of a single column.

use crate::{Error, Result, inputs::plain};
use csv::{ReaderBuilder, StringRecord, Trim};
use meshmark_core::{
    options::{composed, recipient_fault},
    visible,
};
use meshmark_marking::spelling_warning;
use std::{
    collections::{BTreeMap, btree_map::Entry},
    io::Read,
    path::Path,
};

const HEADER: &str = "recipient";

/// Words that may be a header, in any case and also in the plural. In a list of one column such a
/// word may also be the name of a recipient.
const LIKE_HEADERS: &[&str] = &[
    "recipient name",
    "recipient_name",
    "name",
    "customer",
    "client",
    "company",
    "organisation",
    "organization",
    "licensee",
    "user",
    "person",
    "contact",
    "receiver",
    "addressee",
    "partner",
    "buyer",
    "subscriber",
];

/// Delimiters that spreadsheets write between columns.
const DELIMITERS: [u8; 3] = [b',', b';', b'\t'];

/// A list has a few megabytes; the limit stops endless input such as /dev/zero.
const LONGEST_LIST: u64 = 64 << 20;

/// Reads the recipients in their order, each once, without blank lines; `warn` receives the
/// repeated ones.
pub fn read(path: &Path, warn: &mut dyn FnMut(&str)) -> Result<Vec<String>> {
    let name = path.display();
    let bad = |reason: String| Error::Recipients { path: path.into(), reason };
    let mut bytes = Vec::new();
    let file = plain::open(path).and_then(|file| file.take(LONGEST_LIST + 1).read_to_end(&mut bytes));
    file.map_err(|source| Error::TextUnread { what: "list of recipients", path: path.into(), source })?;
    if bytes.len() as u64 > LONGEST_LIST {
        return Err(bad(format!("is longer than {} MiB: split it", LONGEST_LIST >> 20)));
    }
    // Spreadsheets write this byte order mark.
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    let rows = rows(text).map_err(&bad)?;
    let column = match rows.first() {
        None => return Err(bad("is empty: write one recipient a line".into())),
        Some((line, first)) => column(*line, first).map_err(&bad)?,
    };
    if let (None, Some((line, row))) = (column, rows.iter().find(|(_, row)| row.len() > 1)) {
        return Err(bad(format!(
            "has {} columns in line {line} and no header \"{HEADER}\": name the column that, or put recipients that \
             contain a comma in quotes",
            row.len()
        )));
    }
    let (mut seen, mut recipients) = (BTreeMap::new(), Vec::new());
    for (line, row) in rows.iter().skip(usize::from(column.is_some())) {
        let recipient = row.get(column.unwrap_or(0)).unwrap_or_default();
        if recipient.is_empty() {
            return Err(bad(format!("has no recipient in line {line}: fill it in, or remove the line")));
        }
        if let Some(fault) = recipient_fault(recipient) {
            return Err(bad(format!(
                "has in line {line} a recipient that {fault}: close its quotes, and save the list as UTF-8"
            )));
        }
        match seen.entry(composed(recipient)) {
            Entry::Vacant(place) => {
                if let Some(text) = spelling_warning(recipient) {
                    warn(&format!("{name}, line {line}: {text}"));
                }
                place.insert(recipient.to_string());
                recipients.push(recipient.to_string());
            }
            Entry::Occupied(first) if first.get() == recipient => warn(&format!(
                "{name}: \"{}\" is there again in line {line}, and gets one copy",
                visible(recipient)
            )),
            Entry::Occupied(_) => {
                return Err(bad(format!(
                    "has \"{}\" in line {line} in another spelling of Unicode than above (composed or decomposed), \
                     which would be two recipients: write both alike",
                    visible(recipient)
                )));
            }
        }
    }
    match recipients.is_empty() {
        true => Err(bad("has a header and no recipient: write one a line".into())),
        false => Ok(recipients),
    }
}

/// Returns the column of the recipients according to the first row; none without a header.
fn column(line: usize, first: &StringRecord) -> std::result::Result<Option<usize>, String> {
    let mut headers = first.iter().enumerate().filter(|(_, field)| is_header(field));
    match (headers.next(), headers.next()) {
        (Some(_), Some(_)) => {
            Err(format!("has two columns headed \"{HEADER}\" in line {line}: give one of them another name"))
        }
        (Some((column, _)), None) => Ok(Some(column)),
        (None, _) if first.len() == 1 && reads_like_a_header(&first[0]) => Err(format!(
            "begins with \"{}\" in line {line}, which may be a header or a recipient: head the column \"{HEADER}\", in \
             place of that line or above it",
            visible(&first[0])
        )),
        (None, _) => Ok(None),
    }
}

fn is_header(field: &str) -> bool {
    word(field) == HEADER
}

fn reads_like_a_header(field: &str) -> bool {
    LIKE_HEADERS.contains(&word(field).as_str())
}

/// Returns the word of a header in lower case and the singular, without surrounding punctuation.
fn word(field: &str) -> String {
    let is_around = |c: char| c.is_whitespace() || "#:*\"'".contains(c);
    let word = field.trim_matches(is_around).to_lowercase();
    let singular = word.strip_suffix("(s)").or_else(|| word.strip_suffix('s')).unwrap_or(&word);
    match singular.strip_suffix("ie") {
        Some(stem) => format!("{stem}y"), // companies
        None => singular.into(),
    }
}

/// Returns lines and their fields. The delimiter is the one that gives the first line a header,
/// otherwise the comma.
fn rows(text: &[u8]) -> std::result::Result<Vec<(usize, StringRecord)>, String> {
    let all = DELIMITERS.map(|delimiter| rows_between(text, delimiter));
    let has_header = |rows: &std::result::Result<Vec<(usize, StringRecord)>, String>| {
        rows.as_ref().is_ok_and(|rows| rows.first().is_some_and(|(_, first)| first.iter().any(is_header)))
    };
    let chosen = all.iter().position(has_header).unwrap_or(0);
    all.into_iter().nth(chosen).expect("it is one of them")
}

fn rows_between(text: &[u8], delimiter: u8) -> std::result::Result<Vec<(usize, StringRecord)>, String> {
    let mut reader = ReaderBuilder::new();
    let mut reader =
        reader.has_headers(false).flexible(true).trim(Trim::All).delimiter(delimiter).from_reader(text);
    // The reader counts a line before it skips the empty lines ahead of it.
    let (mut counted, mut line) = (0, 1);
    let mut line_at = |position: Option<&csv::Position>| {
        let start = position.map_or(0, |at| at.byte() as usize);
        let empty = text[start..].iter().take_while(|byte| matches!(byte, b'\r' | b'\n')).count();
        line += (counted..start + empty).filter(|at| ends_line(text, *at)).count();
        counted = start + empty;
        line
    };
    let mut rows = Vec::new();
    for row in reader.records() {
        let row = row.map_err(|error| match error.position() {
            Some(at) => format!("is not UTF-8 in line {}: save it as UTF-8", line_at(Some(at))),
            None => format!("cannot be read: {error}"),
        })?;
        if !row.iter().all(str::is_empty) {
            rows.push((line_at(row.position()), row));
        }
    }
    Ok(rows)
}

/// Returns whether a line ends with this byte: a line feed, a carriage return, or both in a row.
fn ends_line(text: &[u8], at: usize) -> bool {
    match text[at] {
        b'\n' => at == 0 || text[at - 1] != b'\r',
        byte => byte == b'\r',
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the recipients, and the warnings or the error.
    fn parse(text: &[u8]) -> (Vec<String>, String) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("list.csv");
        std::fs::write(&path, text).unwrap();
        let mut warnings = String::new();
        match read(&path, &mut |text| warnings.push_str(text)) {
            Ok(recipients) => (recipients, warnings),
            Err(error) => (Vec::new(), error.to_string()),
        }
    }

    #[test]
    fn a_list_has_a_header_or_one_column() {
        for text in [
            "ACME GmbH\nÖster AB\n",
            "recipient\r\nACME GmbH\r\n\r\n  Öster AB  \r\n",
            "\u{feff}Recipient\nACME GmbH\nÖster AB",
            "id,recipient\n1,ACME GmbH\n2,\"Öster AB\"\n",
            "id;recipient;note\n1;ACME GmbH;a, b\n;;\n2;Öster AB\n",
            "recipient\tid\nACME GmbH\t1\nÖster AB\t2\n",
            "recipients\nACME GmbH\nÖster AB\n",
            "# RECIPIENTS:\nACME GmbH\nÖster AB\n",
            "id,Recipients\n1,ACME GmbH\n2,Öster AB\n",
            "Recipient(s)\nACME GmbH\nÖster AB\n",
        ] {
            assert_eq!(
                parse(text.as_bytes()),
                (vec!["ACME GmbH".into(), "Öster AB".into()], String::new()),
                "{text}"
            );
        }
        assert_eq!(parse(b"\"ACME, Inc.\"\n").0, ["ACME, Inc."]);
        assert_eq!(parse(b"recipient\nCustomers\n").0, ["Customers"], "the remedy of the refusal");
    }

    #[test]
    fn a_recipient_given_again_gets_one_copy_and_a_warning() {
        let (recipients, warning) = parse(b"A\n\nB\nA \na\n");
        assert_eq!(recipients, ["A", "B", "a"]);
        assert!(warning.contains("\"A\" is there again in line 4"), "{warning}");
        let (_, warning) = parse("A\u{202e}B\nA\u{202e}B\n".as_bytes());
        assert!(warning.contains("\"A\\u{202e}B\" is there again in line 2"), "{warning}");
    }

    #[test]
    fn a_list_without_an_end_is_refused() {
        let error = read(Path::new("/dev/zero"), &mut |_| ()).unwrap_err().to_string();
        assert!(error.contains("no plain file"), "{error}");
    }

    #[test]
    fn what_is_no_list_is_refused_by_its_line() {
        for (text, error) in [
            (&b""[..], "is empty"),
            (b"\n\n", "is empty"),
            (b"recipient\n", "has a header and no recipient"),
            (b"A\nACME, Inc.\n", "2 columns in line 2 and no header \"recipient\""),
            (b"name,id\nA,1\n", "2 columns in line 1"),
            (
                b"\nCustomers\nA\n",
                "begins with \"Customers\" in line 2, which may be a header or a recipient",
            ),
            (b"Companies\nA\n", "head the column \"recipient\", in place of that line or above it"),
            (b"recipient,Recipients\nA,B\n", "two columns headed \"recipient\" in line 1"),
            (b"#\x0c#client\x0c#", "begins with \"#\\u{c}#client\\u{c}#\" in line 1"),
            (b"id,recipient\n1,A\n2,\n", "no recipient in line 3"),
            (b"A\n\xff\xfe\n", "is not UTF-8 in line 2"),
            ("Caf\u{e9}\nA\nCafe\u{301}\n".as_bytes(), "in line 3 in another spelling of Unicode"),
            (b"A\n\"B\nC\n", "in line 2 a recipient that has a line break or another control"),
            (b"A\rB\r\rC,D\r", "2 columns in line 4"),
            (b"A\r\nB\r\n\r\nC,D\r\n", "2 columns in line 4"),
            (b"recipient\r\"a\rb\"", "in line 2 a recipient that has a line break or another control"),
            (b"A\0C\0", "in line 1 a recipient that has a line break or another control"),
        ] {
            let (_, found) = parse(text);
            assert!(found.contains(error), "{}: {found}", String::from_utf8_lossy(text));
        }
    }
}
