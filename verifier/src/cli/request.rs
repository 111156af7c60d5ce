//! The requests of `verify`, made from flags, key and record.

use super::{arguments::VerifyArgs, printing::warn};
use meshmark_detection::matching::RadiusChoice;
use meshmark_verification::verify::{self, Request, Settings};
use meshmark_verifier::{
    Result,
    inputs::{passphrase::Passphrase, texts},
};

/// Combines key, record and flags. Without a record, flags that fit both versions of the mark ask for
/// either.
pub(super) fn requests(args: &VerifyArgs) -> Result<Vec<Request>> {
    let passphrase = Passphrase::of_child(args.opening.passphrase_file.as_deref());
    let settings = Settings {
        key: texts::key(&args.key, &passphrase, &mut warn)?,
        registration: args.registration.into(),
        demodulator: args.demodulator.into(),
        radius: args.radius.map_or(RadiusChoice::FromData, RadiusChoice::Given),
        significance: args.significance,
        sketch: args.report.is_some() || args.bundle.is_some(),
        evidence_map: args.evidence_map.is_some(),
        exact_displacements: args.exact_displacements,
    };
    let record = args.record.as_deref().map(texts::record).transpose()?;
    let flags: Vec<_> = args.marking.0.iter().map(|(name, value)| (*name, value.as_str())).collect();
    Ok(verify::requests(&settings, &flags, record.as_ref())?)
}
