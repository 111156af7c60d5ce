//! The request of `verify`, made from flags, key and record.

use super::arguments::VerifyArgs;
use meshmark_core::{
    key::RECIPIENT_BITS,
    options::{self, Options, Spelling},
    record::Record,
};
use meshmark_verifier::{Error, Request, Result, inputs::texts, verify::check_key};

/// Combines key, record and flags.
pub(super) fn request(args: VerifyArgs) -> Result<Request> {
    let key = texts::key(&args.key)?;
    let record = args.record.as_deref().map(texts::record).transpose()?;
    let flags = args.marking.0.iter().map(|(name, value)| (*name, value.as_str()));
    let options = Options::parse(flags)?;
    let options = match &record {
        Some(record) => {
            check_flags(&args.marking.0, record)?;
            check_key(record, &key)?;
            from_record(record)?
        }
        None => options,
    };
    Ok(Request {
        bits: options.subject.as_ref().map_or(RECIPIENT_BITS, |subject| subject.message(&key).len()),
        subject: options.subject,
        key,
        reference: args.reference,
        suspect: args.suspect,
        record,
        parameters: options.parameters,
        layers: options.layers,
        srs: options.srs,
        landmarks: args.landmark,
        registration: args.registration.into(),
        demodulator: args.demodulator.into(),
        radius_m: args.radius,
        significance: args.significance,
        sketch: args.report.is_some(),
        evidence_map: args.evidence_map.is_some(),
    })
}

/// Returns the options of a record.
fn from_record(record: &Record) -> Result<Options> {
    Ok(Options {
        key_path: None,
        subject: Some(record.subject()?),
        parameters: record.parameters()?,
        layers: record.layers.clone(),
        srs: record.srs.clone(),
        record_path: None,
    })
}

/// Checks that flags agree with the record, which they may repeat.
fn check_flags(flags: &[(&'static str, String)], record: &Record) -> Result<()> {
    let recorded = from_record(record)?;
    for (name, value) in flags {
        let alone = Options::parse([(*name, value.as_str())])?;
        let spec = options::spec(name).expect("flags are rows of the table");
        let on_record = match *name {
            // A record has the message of its recipient, too.
            "MESSAGE" => Some(record.message()?.to_hex()),
            _ => spec.text_of(&recorded),
        };
        if spec.text_of(&alone) != on_record {
            let flag = Spelling::Flag.value(name, value);
            return Err(Error::Contradiction { flag });
        }
    }
    Ok(())
}
