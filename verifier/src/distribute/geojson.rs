//! GeoJSON as GDAL writes it, one feature a line: joins the lines of one file with the positions of
//! another.

use crate::{Error, Result};
use meshmark_dataset::{
    Action, file_error,
    geojson_text::{Place, ordinates, places},
};
use std::{
    fs::File,
    io::{self, BufRead, BufReader, BufWriter, ErrorKind, Write},
    path::Path,
};

/// The key of the bounding box of a collection, which is on a line of its own.
const BOX_OF_ALL: &[u8] = b"\"bbox\":";

/// Writes `file`: `plain` with x and y of its positions taken from the same features of `marked`,
/// and with adapted bounding boxes.
pub fn write(plain: &Path, marked: &Path, file: &Path) -> Result<()> {
    let open =
        |path| File::open(path).map(BufReader::new).map_err(|error| file_error(Action::Reading, path, error));
    let (plain, marked) = (open(plain)?, open(marked)?);
    let written = File::create(file).and_then(|to| join(plain, marked, BufWriter::new(to)));
    match written {
        Err(error) if error.kind() == ErrorKind::InvalidData => Err(Error::MapChanged),
        Err(error) => Err(file_error(Action::Writing, file, error).into()),
        Ok(()) => Ok(()),
    }
}

/// Calls `f` with every feature of a file.
pub fn for_each_feature(path: &Path, mut f: impl FnMut(&[u8])) -> Result<()> {
    let failed = |error| file_error(Action::Reading, path, error);
    let (mut file, mut line) = (File::open(path).map(BufReader::new).map_err(failed)?, Vec::new());
    while next(&mut file, &mut line).map_err(failed)? {
        if is_feature(&line) {
            f(&line);
        }
    }
    Ok(())
}

fn join(mut plain: impl BufRead, mut marked: impl BufRead, mut to: impl Write) -> io::Result<()> {
    let (mut line, mut other) = (Vec::new(), Vec::new());
    while next(&mut plain, &mut line)? {
        let is_box = line.starts_with(BOX_OF_ALL);
        if !is_box && !is_feature(&line) {
            to.write_all(&line)?;
            continue;
        }
        let is_wanted = |line: &[u8]| is_feature(line) || is_box && line.starts_with(BOX_OF_ALL);
        while next(&mut marked, &mut other)? && !is_wanted(&other) {}
        let joined = match is_box {
            false => feature(&line, &other),
            true => other.starts_with(BOX_OF_ALL).then(|| other.clone()),
        };
        to.write_all(&joined.ok_or(ErrorKind::InvalidData)?)?;
    }
    while next(&mut marked, &mut other)? {
        if is_feature(&other) {
            return Err(ErrorKind::InvalidData.into());
        }
    }
    to.flush()
}

/// Reads the next line; returns false at the end.
fn next(from: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<bool> {
    line.clear();
    Ok(from.read_until(b'\n', line)? > 0)
}

/// Lines of other members of a collection begin with a quote, and its last line with a bracket.
fn is_feature(line: &[u8]) -> bool {
    line.starts_with(b"{ ")
}

/// Returns the line of a feature with the positions of another one; none when the two do not
/// correspond.
fn feature(line: &[u8], marked: &[u8]) -> Option<Vec<u8>> {
    let of_place = |place| match place {
        Place::Position(range) => Some(ordinates(&marked[range]).collect()),
        Place::BoundingBox(_) => None,
    };
    let positions: Vec<Vec<&[u8]>> = places(marked)?.into_iter().filter_map(of_place).collect();
    let mut rest = positions.iter();
    let (mut joined, mut at) = (Vec::with_capacity(line.len()), 0);
    for place in places(line)? {
        let (Place::Position(range) | Place::BoundingBox(range)) = &place;
        joined.extend(&line[at..range.start]);
        at = range.end;
        let list: Vec<&[u8]> = ordinates(&line[range.clone()]).collect();
        let list = match place {
            Place::Position(_) => {
                let position = rest.next()?;
                position.iter().chain(list.get(position.len()..)?).copied().collect()
            }
            Place::BoundingBox(_) => bounding_box(list, &positions)?,
        };
        joined.extend([b"[ ", list.join(&b", "[..]).as_slice(), b" ]"].concat());
    }
    joined.extend(&line[at..]);
    rest.next().is_none().then_some(joined)
}

/// Returns a bounding box with the least and the largest x and y of the positions.
fn bounding_box<'a>(mut list: Vec<&'a [u8]>, positions: &[Vec<&'a [u8]>]) -> Option<Vec<&'a [u8]>> {
    let half = list.len() / 2;
    if half < 2 {
        return None;
    }
    for axis in [0, 1] {
        let value = |number: &&[u8]| str::from_utf8(number).ok()?.parse::<f64>().ok();
        let along = positions.iter().filter_map(|position| position.get(axis).copied());
        let mut along: Vec<(f64, &[u8])> =
            along.map(|number| Some((value(&number)?, number))).collect::<Option<_>>()?;
        along.sort_by(|a, b| a.0.total_cmp(&b.0));
        list[axis] = along.first()?.1;
        list[half + axis] = along.last()?.1;
    }
    Some(list)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joined(plain: &str, marked: &str) -> io::Result<String> {
        let mut to = Vec::new();
        join(plain.as_bytes(), marked.as_bytes(), &mut to)?;
        Ok(String::from_utf8(to).unwrap())
    }

    #[test]
    fn positions_and_bounding_boxes_change_and_nothing_else() {
        let plain = "{\n\"name\": \"\\\"geometry\\\": {\",\n\"bbox\": [ 1, 2, 3, 4 ],\n\"features\": [\n\
                     { \"properties\": { \"coordinates\": [ 1, 2 ] }, \"bbox\": [ 1, 2, 0, 3, 4, 0 ], \"geometry\": \
                     { \"coordinates\": [ [ 1, 2, 0, 9 ], [ 3, 4, 0, 8 ] ], \"more\": [ 1, 2 ] } },\n\
                     { \"id\": 7, \"geometry\": null }\n]\n}\n";
        let marked = "{\n\"bbox\": [ 5, 6, 7, 8 ],\n\"features\": [\n\
                      { \"bbox\": [ 5, 6, 7, 8 ], \"geometry\": { \"coordinates\": [ [ 7, 6, 0 ], [ 5, 8, 0 ] ] } },\n\
                      { \"geometry\": null }\n]\n}\n";
        let expected = plain
            .replace("[ 1, 2, 3, 4 ]", "[ 5, 6, 7, 8 ]")
            .replace("[ 1, 2, 0, 3, 4, 0 ]", "[ 5, 6, 0, 7, 8, 0 ]")
            .replace("[ 1, 2, 0, 9 ], [ 3, 4, 0, 8 ]", "[ 7, 6, 0, 9 ], [ 5, 8, 0, 8 ]");
        assert_eq!(joined(plain, marked).unwrap(), expected);
    }

    #[test]
    fn other_features_are_an_error() {
        let line = |positions: &str| format!("{{ \"geometry\": {{ \"coordinates\": [ {positions} ] }} }}\n");
        let [one, two] = ["[ 1, 2 ]", "[ 1, 2 ], [ 3, 4 ]"].map(line);
        assert!(joined(&one, &two).is_err() && joined(&two, &one).is_err() && joined(&two, &two).is_ok());
        let twice = one.repeat(2);
        assert!(joined(&one, &twice).is_err() && joined(&twice, &one).is_err());
    }
}
