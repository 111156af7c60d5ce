//! The request of `verify`, made from flags, key and record.

use super::arguments::VerifyArgs;
use meshmark_core::{
    key::RECIPIENT_BITS,
    options::{Options, Spelling, Subject},
    recorded::Recorded,
};
use meshmark_detection::{Demodulator, matching::RadiusChoice};
use meshmark_verifier::{
    Error, Request, Result,
    inputs::{private_copy::PrivateCopy, texts},
    verify::{Sought, check_key},
};

/// Combines key, record and flags.
pub(super) fn request(args: VerifyArgs, suspect: PrivateCopy, warn: &mut dyn FnMut(&str)) -> Result<Request> {
    let key = texts::key(&args.key, warn)?;
    let record = args.record.as_deref().map(texts::record).transpose()?;
    let flags = args.marking.0.iter().map(|(name, value)| (*name, value.as_str()));
    let options = Options::parse(flags)?;
    let options = match &record {
        Some(record) => {
            check_flags(&args.marking.0, record)?;
            check_key(record, &key)?;
            record.options()?
        }
        None => options,
    };
    let demodulator = args.demodulator.into();
    let sought = match options.coefficients {
        Some(_) if demodulator == Demodulator::Paper => return Err(Error::PaperOfFingerprint),
        Some(coefficients) => {
            let recipient = options.subject.as_ref().and_then(Subject::recipient);
            let recipients = recipient.map(String::from).into_iter().collect();
            Sought::Fingerprint { coefficients, recipients, tried: 1 }
        }
        None => {
            let bits = options.subject.as_ref().map(|subject| subject.message(&key).len());
            Sought::Message { bits: bits.unwrap_or(RECIPIENT_BITS) }
        }
    };
    Ok(Request {
        sought,
        subject: options.subject,
        key,
        reference: args.reference.into_iter().next().expect("one is required"),
        suspect,
        record,
        parameters: options.parameters,
        layers: options.layers,
        srs: options.srs,
        landmarks: args.landmark,
        registration: args.registration.into(),
        demodulator,
        radius: args.radius.map_or(RadiusChoice::FromData, RadiusChoice::Given),
        significance: args.significance,
        sketch: args.report.is_some(),
        evidence_map: args.evidence_map.is_some(),
    })
}

/// Checks that flags agree with the record, which they may repeat.
fn check_flags(flags: &[(&'static str, String)], record: &Recorded) -> Result<()> {
    let recorded = record.options()?;
    for (name, value) in flags {
        let alone = Options::parse([(*name, value.as_str())])?;
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
