//! GeoJSON as GDAL writes it, a feature a line and its geometry last: the lines of one file with the geometries of
//! another.

use super::plain::changed;
use crate::Result;
use meshmark_dataset::workplace::file_error;
use std::{
    fs::File,
    io::{self, BufRead, BufReader, BufWriter, ErrorKind, Write},
    path::Path,
};

/// What a geometry comes after. It stands in no text, where quotes have backslashes before them, and in no geometry.
const MEMBER: &[u8] = b"\"geometry\":";

/// Writes `file`: all of `plain`, but for its geometries, which are those of the same features of `geometries`.
pub fn write(plain: &Path, geometries: &Path, file: &Path) -> Result<()> {
    let open =
        |path| File::open(path).map(BufReader::new).map_err(|error| file_error("reading", path, error));
    let (plain, geometries) = (open(plain)?, open(geometries)?);
    let written = File::create(file).and_then(|to| join(plain, geometries, BufWriter::new(to)));
    match written {
        Err(error) if error.kind() == ErrorKind::InvalidData => Err(changed()),
        Err(error) => Err(file_error("writing", file, error).into()),
        Ok(()) => Ok(()),
    }
}

fn join(mut plain: impl BufRead, mut geometries: impl BufRead, mut to: impl Write) -> io::Result<()> {
    let (mut line, mut other) = (Vec::new(), Vec::new());
    while next(&mut plain, &mut line)? {
        let Some(place) = place(&line) else {
            to.write_all(&line)?;
            continue;
        };
        while next(&mut geometries, &mut other)? && self::place(&other).is_none() {}
        let Some(from) = self::place(&other) else { return Err(ErrorKind::InvalidData.into()) };
        to.write_all(&line[..place])?;
        let geometry = other[from..].trim_ascii_end();
        to.write_all(geometry.strip_suffix(b",").unwrap_or(geometry))?;
        to.write_all(
            &line[line.trim_ascii_end().strip_suffix(b",").unwrap_or(line.trim_ascii_end()).len()..],
        )?;
    }
    while next(&mut geometries, &mut other)? {
        if self::place(&other).is_some() {
            return Err(ErrorKind::InvalidData.into());
        }
    }
    to.flush()
}

/// The next line; false at the end.
fn next(from: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<bool> {
    line.clear();
    Ok(from.read_until(b'\n', line)? > 0)
}

/// Where in a line the geometry of a feature begins.
fn place(line: &[u8]) -> Option<usize> {
    let start = line.windows(MEMBER.len()).rposition(|bytes| bytes == MEMBER)?;
    Some(start + MEMBER.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joined(plain: &str, geometries: &str) -> io::Result<String> {
        let mut to = Vec::new();
        join(plain.as_bytes(), geometries.as_bytes(), &mut to)?;
        Ok(String::from_utf8(to).unwrap())
    }

    #[test]
    fn geometries_change_and_nothing_else() {
        let plain = "{\n\"name\": \"\\\"geometry\\\": {\",\n\"features\": [\n{ \"properties\": { \"geometry\": 1 }, \
                     \"geometry\": { \"x\": 1 } },\n{ \"id\": 7, \"geometry\": null }\n]\n}\n";
        let geometries =
            "{\n\"features\": [\n{ \"geometry\": { \"x\": 20 } },\n{ \"geometry\": null }\n]\n}\n";
        assert_eq!(joined(plain, geometries).unwrap(), plain.replace("\"x\": 1 ", "\"x\": 20 "));
    }

    #[test]
    fn another_number_of_features_is_an_error() {
        let [one, two] = [1, 2].map(|count| "{ \"geometry\": null }\n".repeat(count));
        assert!(joined(&one, &two).is_err() && joined(&two, &one).is_err() && joined(&two, &two).is_ok());
    }
}
