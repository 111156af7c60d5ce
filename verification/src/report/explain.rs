//! The output of `--explain`: the report in sentences, for readers who depend on it.

use super::{
    DepositEntry, Digested, FingerprintEntry, Inputs, LikelihoodEntry, MarkParameters, PatchAgreement,
    Report, Standing, error_rates::error_rates,
};
use crate::words::{clipped, power_of_ten};
use meshmark_core::counted;
use meshmark_detection::decision::{Null, Verdict};
use std::fmt::Write as _;

/// Returns the report in sentences.
pub fn explain(inputs: &Inputs, report: &Report) -> String {
    let sections = [
        ("What was compared", compared(inputs, report)),
        ("What was found", found(report)),
        ("What that says about whose copy it is", likelihood(report)),
        (what_is_bound(report), bound(report)),
        ("What was not tested", not_tested(report)),
        ("How often such findings are wrong", error_rates(report)),
        ("What makes this evidence", deposit(Some(inputs), report)),
    ];
    let mut text = String::new();
    for (title, sentences) in sections.into_iter().filter(|(_, sentences)| !sentences.is_empty()) {
        let _ = writeln!(text, "{title}");
        sentences.iter().for_each(|sentence| {
            let _ = writeln!(text, "  {sentence}");
        });
    }
    text
}

/// Returns the heading of what a mark names.
fn what_is_bound(report: &Report) -> &'static str {
    match &report.parameters.mark {
        MarkParameters::Message(_) => "What the message is bound to",
        MarkParameters::Fingerprint(_) => "What the secret signs are bound to",
    }
}

fn compared(inputs: &Inputs, report: &Report) -> Vec<String> {
    let (v, p) = (&report.vertices, &report.parameters);
    let suspect_crs = match report.suspect_crs.as_slice() {
        [] => "no layer".into(),
        crs => crs.join(" and "),
    };
    let mut sentences = vec![
        format!(
            "The suspect {} has {} in {suspect_crs}.",
            inputs.suspect.path,
            counted(v.suspect, "distinct vertex")
        ),
        format!(
            "The reference {} has {} in {}.",
            inputs.reference.path,
            counted(v.reference, "distinct vertex"),
            p.crs.as_deref().unwrap_or("no CRS")
        ),
    ];
    sentences.extend(other_crs(report));
    sentences.push(format!("The key {} has the public id {}.", inputs.key.path, p.key_id));
    sentences.push(match &inputs.record {
        Some(record) => format!("The record {} belongs to this key and this reference.", record.path),
        None if report.candidates.is_some() => {
            "Records of this key and this reference were tried; none of them matches, and none is named."
                .into()
        }
        None => "There was no record: how the map was marked was taken from the command line.".into(),
    });
    sentences.push(format!("File of the suspect: {}. {UNTOUCHED}", inputs.suspect.digest));
    sentences.extend(same_file(inputs));
    sentences
}

/// The command fails otherwise.
pub(crate) const UNTOUCHED: &str = "It was examined as a private copy, and had the same digest afterwards.";

/// Returns a notice where suspect and reference are the same.
pub(crate) fn same_file(inputs: &Inputs) -> Option<String> {
    (inputs.suspect.digest == inputs.reference.digest).then(|| {
        "Suspect and reference have the same digest: the suspect is the unmarked map itself, or was given by mistake."
            .into()
    })
}

/// Returns sentences about the deposit of key and reference, whose files are not always known.
pub fn deposit(inputs: Option<&Inputs>, report: &Report) -> Vec<String> {
    let mut sentences = vec![
        "Whoever has the key and the reference can mark a map for any recipient, also afterwards, and can try \
         keys until one seems to fit."
            .into(),
        match &report.deposit {
            None => "So reference, key and record must have been deposited with someone else before the copy was handed \
                     out, or these digests of them:"
                .into(),
            Some(entry) => format!(
                "The deposit with SHA-256 {}, signed with {}, rules that out for what it holds, {}.",
                entry.sha256,
                entry.signer(),
                entry.since()
            ),
        },
        format!("Vertices of the reference: SHA-256 {}.", report.reference_digest),
    ];
    match inputs {
        Some(inputs) => sentences.extend(files(inputs, &report.parameters.key_id)),
        None => sentences.push(format!("The id of the key: {}.", report.parameters.key_id)),
    }
    let standing = report.deposit.iter().map(|entry| &entry.standing);
    for Standing { fixed, not_fixed } in standing {
        sentences.push(format!("The deposit holds: {}.", fixed.join(", ")));
        sentences.extend(not_fixed.iter().map(|what| format!("The deposit does not hold: {what}.")));
    }
    sentences
}

/// Returns the digests of files.
fn files(inputs: &Inputs, key_id: &str) -> Vec<String> {
    let mut sentences = vec![
        format!("File of the reference: {}.", inputs.reference.digest),
        format!("File of the key: {}; its id is {key_id}.", inputs.key.digest),
    ];
    let other = |other: &Digested| format!("File of the other reference {}: {}.", other.path, other.digest);
    sentences.extend(inputs.other_references.iter().map(other));
    let record = inputs.record.as_ref();
    sentences.extend(record.map(|record| format!("File of the record: {}.", record.digest)));
    sentences
}

/// Returns what a verification leaves open.
pub(crate) fn not_tested(report: &Report) -> Vec<String> {
    let time = match &report.deposit {
        Some(DepositEntry { since: Some(_), .. }) => "When the mark was made.",
        _ => "When the mark was made, and whether key and record are older than the suspect.",
    };
    let others = match (&report.candidates, &report.parameters.mark) {
        (None, _) => {
            "Other recipients, and mixtures of their copies: one copy was tried, where --records tries all."
        }
        (_, MarkParameters::Message(_)) => {
            "Mixtures of more copies than an average of a few, and copies of which there is no record."
        }
        (_, MarkParameters::Fingerprint(_)) => {
            "Copies of which there is no record, and mixtures of so many copies that none of them shows by itself."
        }
    };
    [
        "Who passed the map on: the mark identifies the copy it was made from.",
        others,
        "Whether somebody else had the key, who could mark copies as well.",
        "Attributes, styles and which features are there: the mark is in the coordinates alone.",
        time,
        "Other keys and other references: the p-values hold for one key and one reference fixed beforehand.",
    ]
    .map(String::from)
    .to_vec()
}

/// Returns sentences about the likelihood ratios; none where there are none.
pub(crate) fn likelihood(report: &Report) -> Vec<String> {
    report.likelihood.iter().flat_map(LikelihoodEntry::to_sentences).collect()
}

fn found(report: &Report) -> Vec<String> {
    let (v, p) = (&report.vertices, &report.parameters);
    let mut sentences = assumed(report);
    sentences.extend(left_out(report));
    sentences.push(format!(
        "{} of the {} reference vertices have a counterpart within {} m{}, the suspect being brought onto the reference \
         by {}{}.",
        v.matched,
        v.reference,
        p.radius_m,
        report.radius_reason(),
        report.registration.method,
        report.read_from()
    ));
    if let Some(fingerprint) = &report.fingerprint {
        sentences.extend(of_signs(fingerprint));
        sentences.extend(probabilities(report));
        sentences.push(format!("The verdict is {}: {}.", report.verdict_name(), report.reason));
        return sentences;
    }
    let Some(message) = &report.message else {
        sentences.push(format!("Nothing was demodulated: {}.", report.reason));
        return sentences;
    };
    let errors = report.bit_errors.map_or(String::new(), |errors| {
        format!(
            ", which differs from the expected message in {errors} of {} bits{}",
            report.bits.len(),
            report.bits_by_chance()
        )
    });
    let other = report.other_reading();
    sentences.push(format!("The suspect was read as the message {message}{other}{errors}."));
    sentences.extend(report.decoding().map(|how| format!("How it was decoded: {how}.")));
    sentences.extend(probabilities(report));
    sentences.push(format!("The verdict is {}: {}.", report.verdict_name(), report.reason));
    sentences
}

/// Returns sentences about the secret signs of a fingerprint.
fn of_signs(fingerprint: &FingerprintEntry) -> Vec<String> {
    let mut sentences = vec![SECRET_SIGNS.into()];
    let recipient = fingerprint.recipient.map(|signs| signs.to_text("of the recipient"));
    sentences.extend(recipient.map(|text| format!("The recipient: {text}.")));
    sentences.push(format!("The key: {}, whoever the recipient is.", fingerprint.key.to_text("of the key")));
    sentences.extend(fingerprint.patches.map(|PatchAgreement { seen, clear }| {
        format!(
            "The map is divided into patches with secret signs of their own: {clear} of the {seen} that were seen show \
             the recipient by themselves, by {} standard deviations or more.",
            PatchAgreement::CLEAR
        )
    }));
    let decoys = [
        (&fingerprint.recipient_decoys, "recipients who do not exist", "the recipient in question"),
        (&fingerprint.key_decoys, "keys that do not exist", "the key in question"),
    ];
    for (decoys, who, tested) in decoys {
        let Some(decoys) = decoys else { continue };
        let tested = decoys.tested.map_or(String::new(), |score| format!("; {tested} scores {score:.1}"));
        sentences.push(format!(
            "To check what chance does, {} {who} were tried on this suspect: they score {:.2} on average, with a \
             standard deviation of {:.2} and at most {:.1}{tested}.",
            decoys.count, decoys.mean, decoys.standard_deviation, decoys.largest
        ));
    }
    sentences
}

/// What a fingerprint is, for readers who have to judge it.
pub(crate) const SECRET_SIGNS: &str = "The mark moves the map along many patterns, each one way or the other. The key and the name of the recipient \
     determine which way, the secret sign of the pattern, and without the key these signs cannot be computed or \
     guessed. Those of somebody who had no part in the map agree with it as often as flips of a coin.";

/// Returns sentences about the assumptions of the registration beyond an affine map.
pub(crate) fn assumed(report: &Report) -> Vec<String> {
    let registration = &report.registration;
    let read_as = registration.read_as.as_ref().map(|read_as| {
        let why = match report.suspect_crs.iter().all(|crs| crs == "no CRS") {
            true => "has no CRS",
            false => "does not lie there under the CRS it claims",
        };
        format!("The suspect {why}; its coordinates were read as {read_as}.")
    });
    let polynomial = registration.polynomial.map(|_| {
        "An affine map left a smooth distortion, which a cubic polynomial took away: with it clearly more vertices \
         match."
            .into()
    });
    read_as.into_iter().chain(polynomial).collect()
}

/// Returns a sentence about a reference whose CRS is not its own.
pub(crate) fn other_crs(report: &Report) -> Option<String> {
    let text = report.other_crs()?;
    Some(format!("T{}.", text.strip_prefix('t')?))
}

/// Returns a sentence about what the suspect has that was not compared.
pub(crate) fn left_out(report: &Report) -> Option<String> {
    let faults = report.left_out.to_text()?;
    Some(format!("What cannot be read or has no place on the Earth was left out: {faults}."))
}

pub(crate) fn probabilities(report: &Report) -> Vec<String> {
    let mut sentences = Vec::new();
    if let Some(p) = report.p_mark_log10 {
        sentences.push(format!(
            "A key that was not used shows so much evidence for this message with a probability of {}, whatever was \
             done to the map.",
            power_of_ten(p)
        ));
    }
    if let Some(decoys) = &report.decoys {
        let tested = decoys.tested.map_or(String::new(), |t| format!("; the tested key scores {t:.1}"));
        sentences.push(format!(
            "To check that, {} decoy keys were tried on this suspect: they score {:.2} on average, with a standard \
             deviation of {:.2} and at most {:.1}{tested}.",
            decoys.count, decoys.mean, decoys.standard_deviation, decoys.largest
        ));
    }
    if let Some(p) = report.p_recipient_log10 {
        let other = match report.null_hypothesis {
            Some(Null::AnyOtherMessage) => {
                "The message was not whitened, so numbers in sequence differ in few bits. A copy with any other message, \
                 also one that differs in a single bit,"
            }
            Some(Null::RandomMessage) => {
                "A recipient of this key who has nothing to do with the copy, and so a random message,"
            }
            None => "A recipient who had no part in the copy, and so random signs,",
        };
        sentences.push(format!("{other} agrees so well with a probability of {}.", power_of_ten(p)));
    }
    if let Some(p) = report.p_any_message_log10 {
        sentences.push(format!(
            "A key that was not used shows so much evidence for any message at all with a probability of {}.",
            power_of_ten(p)
        ));
    }
    if let Some(p) = report.p_missed_log10 {
        sentences.push(format!(
            "If the suspect carried the mark, this test would miss it with a probability of at most {}, as a trial mark of another \
             key on the same suspect shows.",
            power_of_ten(p)
        ));
    }
    if let (None, 2.., Some(p)) = (&report.candidates, report.tried, report.p_value_log10) {
        sentences.push(format!(
            "There was no record to say whether the key whitened the message, and both were tried, so the larger of the \
             probabilities for key and message counts twice: {}.",
            power_of_ten(p)
        ));
    }
    if let (Some(candidates), Some(p)) = (&report.candidates, report.p_value_log10) {
        sentences.push(format!(
            "{} tried, so the larger of the probabilities for key and recipient counts {}: {}.",
            match candidates.tried {
                1 => "1 record was".into(),
                tried => format!("{tried} records were"),
            },
            counted(candidates.tried, "time"),
            power_of_ten(p)
        ));
    }
    sentences
}

/// Returns a sentence about the person that the message identifies.
pub(crate) fn bound(report: &Report) -> Vec<String> {
    if report.candidates.is_some() && report.verdict != Verdict::Match {
        return Vec::new(); // no copy of many is identified
    }
    let p = &report.parameters;
    let sentence = match (&p.recipient, &p.expected_message) {
        (Some(recipient), Some(message)) => format!(
            "The message {message} was computed again from the key and the recipient \"{}\": it is a keyed hash of \
             the two, and without the key nobody can choose it.",
            clipped(recipient)
        ),
        (Some(recipient), None) if matches!(p.mark, MarkParameters::Message(_)) => format!(
            "The message was computed again from the key and the recipient \"{}\": it is a keyed hash of the two, and \
             without the key nobody can choose it.",
            clipped(recipient)
        ),
        (Some(recipient), None) => format!(
            "The secret signs were computed again from the key and the recipient \"{}\": without the key nobody can \
             make them.",
            clipped(recipient)
        ),
        (None, Some(message)) => format!(
            "The message {message} was given as bare bits: nothing in it names a recipient, and who received it must be \
             shown by other means."
        ),
        _ if report.is_of_somebody() => {
            "The message of the record was given as bare bits: nothing in it names a recipient, and who received it must \
             be shown by other means."
                .into()
        }
        _ => "No message was expected, so no recipient is named.".into(),
    };
    vec![sentence]
}
