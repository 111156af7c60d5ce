//! The request of `verify`, made from flags, key and record.

use super::{arguments::VerifyArgs, printing::warn};
use meshmark_core::{
    key::{RECIPIENT_BITS, SecretKey},
    options::{Options, Spelling, Subject},
    recorded::Recorded,
};
use meshmark_detection::{Demodulator, matching::RadiusChoice};
use meshmark_verifier::{
    Error, Request, Result,
    inputs::{
        passphrase::Passphrase,
        private_copy::PrivateCopy,
        texts::{self, ReadRecord},
    },
    verify::{Sought, check_key, lineage_of},
};

/// Combines key, record and flags. Without a record, flags that fit both versions of the mark ask for
/// either.
pub(super) fn requests(args: &VerifyArgs, suspect: &PrivateCopy) -> Result<Vec<Request>> {
    let passphrase = Passphrase::of_child(args.opening.passphrase_file.as_deref());
    let key = texts::key(&args.key, &passphrase, &mut warn)?;
    let record = args.record.as_deref().map(texts::record).transpose()?;
    let flags = args.marking.0.iter().map(|(name, value)| (*name, value.as_str()));
    let possible = match &record {
        Some(ReadRecord { record, .. }) => {
            Options::parse(flags)?;
            check_flags(&args.marking.0, record)?;
            check_key(record, &key)?;
            vec![record.options()?]
        }
        None => possible_options(flags.collect(), args.demodulator.into())?,
    };
    let tried = possible.len();
    let request = |options: Options| {
        Ok(Request {
            sought: sought(&options, &key, args.demodulator.into(), tried)?,
            lineage: record.as_ref().map(|read| lineage_of(&read.record)).unwrap_or_default(),
            part_size: options.part_size,
            tried,
            subject: options.subject,
            key: key.clone(),
            reference: args.reference.first().expect("one is required").clone(),
            suspect: suspect.clone(),
            record: record.clone(),
            parameters: options.parameters,
            layers: options.layers,
            srs: options.srs,
            landmarks: args.landmark.clone(),
            registration: args.registration.into(),
            demodulator: args.demodulator.into(),
            radius: args.radius.map_or(RadiusChoice::FromData, RadiusChoice::Given),
            significance: args.significance,
            sketch: args.report.is_some() || args.bundle.is_some(),
            evidence_map: args.evidence_map.is_some(),
            exact_displacements: args.exact_displacements,
        })
    };
    possible.into_iter().map(request).collect()
}

/// Returns the options of the marks that flags may mean: CODE, CHIP_RATE, MESSAGE and the demodulator
/// of the paper mean a message, PART_SIZE means a fingerprint, and all others either.
fn possible_options(flags: Vec<(&str, &str)>, demodulator: Demodulator) -> Result<Vec<Options>> {
    let given = Options::parse(flags.iter().copied())?;
    let names = |names: &[&str]| flags.iter().any(|(name, _)| names.contains(name));
    if names(&["CODE", "CHIP_RATE", "MESSAGE"]) {
        return Ok(vec![given]);
    }
    let fingerprint = match given.coefficients {
        Some(_) => given.clone(),
        None => Options::parse_for_recipients(flags.iter().copied())?,
    };
    if names(&["PART_SIZE"]) {
        return Ok(vec![fingerprint]);
    }
    let code = given.parameters.code.name();
    let message = Options::parse(flags.iter().copied().chain([("CODE", code.as_str())]))?;
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

/// Checks that flags agree with the record, which they may repeat.
fn check_flags(flags: &[(&'static str, String)], record: &Recorded) -> Result<()> {
    let recorded = record.options()?;
    let vertices = record.vertices().0;
    for (name, value) in flags {
        let alone = Options::parse([(*name, value.as_str())])?;
        // A smaller map is not cut, and its record does not say at what size it would have been.
        if *name == "PART_SIZE" && alone.parts_of(vertices) == recorded.parts_of(vertices) {
            continue;
        }
        let on_record = match (*name, record) {
            // A record of a message has that of its recipient, too.
            ("MESSAGE", Recorded::Message(record)) => Some(record.message()?.to_hex()),
            _ => recorded.text_of(name),
        };
        if alone.text_of(name) != on_record {
            let flag = Spelling::Flag.value(name, value);
            return Err(Error::Contradiction { flag });
        }
    }
    Ok(())
}
