//! The marks that a verification looks for, from options and a record.

use super::{
    belonging::check_key,
    request::{ReadRecord, Request, Settings, Sought, lineage_of},
};
use crate::{Error, Result};
use meshmark_core::{
    key::{RECIPIENT_BITS, SecretKey},
    options::{Options, Subject},
    recorded::Recorded,
};
use meshmark_detection::Demodulator;

/// Combines settings, options and a record. Without a record, options that fit both versions of the mark
/// ask for either.
///
/// # Errors
/// Fails on options that are not legal or contradict the record, and on a record of another key.
pub fn requests(
    settings: &Settings,
    options: &[(&str, &str)],
    record: Option<&ReadRecord>,
) -> Result<Vec<Request>> {
    let Settings { key, demodulator, .. } = settings;
    let possible = match record {
        Some(ReadRecord { record, .. }) => {
            let given = Options::parse(options.iter().copied())?;
            check_options(options, record)?;
            check_key(record, key)?;
            let recorded = record.options()?;
            vec![Options { srs: given.srs.or(recorded.srs), ..recorded }]
        }
        None => possible_options(options, *demodulator)?,
    };
    let tried = possible.len();
    let request = |options: Options| {
        Ok(Request {
            settings: settings.clone(),
            sought: sought(&options, key, *demodulator, tried)?,
            lineage: record.map(|read| lineage_of(&read.record)).unwrap_or_default(),
            part_size: options.part_size,
            tried,
            subject: options.subject,
            record: record.cloned(),
            parameters: options.parameters,
            layers: options.layers,
            srs: options.srs,
            recorded_crs: record.and_then(|read| read.record.crs()).map(String::from),
        })
    };
    possible.into_iter().map(request).collect()
}

/// Returns the options of the marks that given ones may mean: CODE, CHIP_RATE, MESSAGE and the demodulator
/// of the paper mean a message, PART_SIZE means a fingerprint, and all others either.
fn possible_options(options: &[(&str, &str)], demodulator: Demodulator) -> Result<Vec<Options>> {
    let given = Options::parse(options.iter().copied())?;
    let names = |names: &[&str]| options.iter().any(|(name, _)| names.contains(name));
    if names(&["CODE", "CHIP_RATE", "MESSAGE"]) {
        return Ok(vec![given]);
    }
    let fingerprint = match given.coefficients {
        Some(_) => given.clone(),
        None => Options::parse_for_recipients(options.iter().copied())?,
    };
    if names(&["PART_SIZE"]) {
        return Ok(vec![fingerprint]);
    }
    let code = given.parameters.code.name();
    let message = Options::parse(options.iter().copied().chain([("CODE", code.as_str())]))?;
    if demodulator == Demodulator::Paper {
        return Ok(vec![message]);
    }
    Ok(vec![fingerprint, message])
}

/// Returns what the mark of these options carries.
fn sought(options: &Options, key: &SecretKey, demodulator: Demodulator, tried: usize) -> Result<Sought> {
    Ok(match options.coefficients {
        Some(_) if demodulator == Demodulator::Paper => return Err(Error::PaperOfFingerprint),
        Some(coefficients) => {
            let recipient = options.subject.as_ref().and_then(Subject::recipient);
            let recipients = recipient.map(String::from).into_iter().collect();
            Sought::Fingerprint { coefficients, recipients, tried }
        }
        None => {
            let bits = options.subject.as_ref().map(|subject| subject.message(key).len());
            Sought::Message { bits: bits.unwrap_or(RECIPIENT_BITS) }
        }
    })
}

/// Checks that options agree with the record, which they may repeat.
fn check_options(options: &[(&str, &str)], record: &Recorded) -> Result<()> {
    let recorded = record.options()?;
    let vertices = record.vertices().0;
    for (name, value) in options {
        let alone = Options::parse([(*name, *value)])?;
        // A smaller map is not cut, and its record does not say at what size it would have been.
        if *name == "PART_SIZE" && alone.parts_of(vertices) == recorded.parts_of(vertices) {
            continue;
        }
        // Other texts may mean the same CRS, and where the map was marked without one, its file may have
        // one that it does not state (references.rs).
        if *name == "SRS" {
            continue;
        }
        let on_record = match (*name, record) {
            // A record of a message has that of its recipient, too.
            ("MESSAGE", Recorded::Message(record)) => Some(record.message()?.to_hex()),
            _ => recorded.text_of(name),
        };
        if alone.text_of(name) != on_record {
            return Err(Error::Contradiction { option: name.to_string(), value: value.to_string() });
        }
    }
    Ok(())
}
