//! The evidence of a matched suspect about a mark: of a message, or of the fingerprints of a key.

use super::request::{Request, Sought};
use crate::Stages;
use meshmark_core::{
    agreement::{Agreement, Evidence},
    deformation::Deformation,
    demodulation::Demodulation,
    estimation::Estimates,
    fingerprint::{Fingerprint, pilots, recipient_signs},
    key::SecretKey,
    part::Parts,
};
use meshmark_detection::{
    Demodulated, Estimated, Matched, Observations,
    decision::{
        Decoys,
        fingerprints::{Answer, Grounds},
        recipients::Standing,
    },
    matching::{Matches, Radius},
    power::Power,
};
use std::collections::BTreeMap;

/// The evidence about the mark that is sought.
pub enum Found {
    /// About a message.
    Message(MessageEvidence),
    /// About fingerprints.
    Fingerprint(FingerprintEvidence),
}

/// The evidence about a message under a key, before the comparison with one.
pub struct MessageEvidence {
    /// The demodulated evidence.
    pub demodulation: Demodulation,
    /// What a present mark would show.
    pub power: Power,
    /// Scores of decoy keys.
    pub decoys: Option<Decoys>,
}

/// The evidence about the fingerprints of recipients.
pub struct FingerprintEvidence {
    /// The estimates of all signs.
    pub estimates: Estimates,
    /// The parts of the map, on which the signs depend.
    pub parts: Parts,
    /// The standing of each recipient, and the answer about it.
    pub recipients: Vec<(Standing, Answer)>,
    /// What the answers rest on.
    pub grounds: Grounds,
    /// The agreement of the key's pilots.
    pub pilots: Agreement,
    /// Scores of decoy recipients; none where no displacement was observed.
    pub recipient_decoys: Option<Decoys>,
    /// Scores of decoy keys; none where no displacement was observed.
    pub key_decoys: Option<Decoys>,
    /// Standard deviation of the noise, metres.
    pub noise_m: f64,
}

/// What was observed besides the mark.
pub struct Surroundings {
    /// The matching radius after tracking of the deformation.
    pub radius: Radius,
    /// The matches after tracking of the deformation.
    pub matches: Matches,
    /// The estimated deformation; none with the demodulator of the paper.
    pub deformation: Option<Deformation>,
    /// The weight of every reference vertex.
    pub weights: Vec<f64>,
    /// What the displacements were observed on.
    pub observations: Observations,
}

/// Returns the evidence for the mark of a request; nothing where matches are chance.
pub fn collect(
    request: &Request,
    matched: &Matched,
    stages: &mut Stages,
) -> meshmark_core::Result<Option<(Found, Surroundings)>> {
    if matched.is_chance(request.settings.demodulator) {
        return Ok(None);
    }
    let found = match &request.sought {
        Sought::Message { bits } => of_message(request, *bits, matched, stages)?,
        Sought::Fingerprint { recipients, tried, .. } => {
            of_fingerprints(request, (recipients, *tried), matched, stages)?
        }
    };
    Ok(Some(found))
}

/// Demodulates, and measures what a present mark would show.
fn of_message(
    request: &Request,
    bits: usize,
    matched: &Matched,
    stages: &mut Stages,
) -> meshmark_core::Result<(Found, Surroundings)> {
    let (mark, demodulator) = (request.mark(bits), request.settings.demodulator);
    let seen = stages.listen(|listener| matched.demodulate(mark, demodulator, listener))?;
    let power = stages.listen(|listener| Power::measure(matched, &seen, mark, demodulator, listener))?;
    let Demodulated { found: demodulation, radius, matches, deformation, weights, observations, decoys } =
        seen;
    let surroundings = Surroundings { radius, matches, deformation, weights, observations };
    Ok((Found::Message(MessageEvidence { demodulation, power, decoys }), surroundings))
}

/// Returns every recipient once, and the place of each among these. Twice in a coalition, a recipient
/// would be the noise that hides himself.
fn distinct(recipients: &[String]) -> (Vec<&String>, Vec<usize>) {
    let (mut names, mut numbers) = (Vec::new(), BTreeMap::new());
    let mut number = |recipient| {
        *numbers.entry(recipient).or_insert_with(|| {
            names.push(recipient);
            names.len() - 1
        })
    };
    let places = recipients.iter().map(&mut number).collect();
    (names, places)
}

/// Estimates all signs, and decides on the recipients of a request.
fn of_fingerprints(
    request: &Request,
    (recipients, tried): (&[String], usize),
    matched: &Matched,
    stages: &mut Stages,
) -> meshmark_core::Result<(Found, Surroundings)> {
    let (parameters, significance) = (&request.parameters, request.settings.significance);
    let parts = matched.reference.parts.clone();
    let pilots = pilots(&request.settings.key, &parts);
    let (names, places) = distinct(recipients);
    let fingerprint = |recipient: &&String| Fingerprint::new(&request.settings.key, &parts, recipient);
    let fingerprints: Vec<Fingerprint> = names.iter().map(fingerprint).collect();
    let seen = stages.listen(|listener| matched.estimate(parameters, listener))?;
    let power =
        stages.listen(|listener| Power::of_fingerprint(matched, &seen, &pilots, parameters, listener))?;
    let of_pilots = Evidence::of_pilots(&seen.estimates);
    let evidence = Evidence::of_recipients(&seen.estimates);
    let (suspect, reference) = (&matched.suspect.vertices, &matched.reference.data.vertices);
    let decoys = |evidence| Decoys::of_signs(evidence, suspect, reference);
    let (recipient_decoys, key_decoys) = (decoys(&evidence), decoys(&of_pilots));
    let seen_of_key = (of_pilots.amplitude(&pilots), of_pilots.agreement(&pilots).score);
    let grounds = Grounds::new([&evidence, &of_pilots], seen_of_key, power, (tried, significance));
    let mut standings = matched.name_recipients(&seen, &fingerprints, parameters, (tried, significance))?;
    if grounds.ask_for_shares(&standings) {
        matched.look_for_shares(
            &seen,
            &fingerprints,
            &pilots,
            parameters,
            (tried, significance),
            &mut standings,
        )?;
    }
    let decide = |&place: &usize| (standings[place], grounds.decide(&standings[place]));
    let recipients = places.iter().map(decide).collect();
    let pilots = seen.key_agreement(&pilots);
    let Estimated { estimates, radius, matches, disturbance, observations, .. } = seen;
    let deformation = disturbance.deformation;
    // Points of features have no weight of a vertex.
    let weights = match observations.is_of_features() {
        true => vec![1.0; matched.reference.patches.vertex_count()],
        false => disturbance.weights,
    };
    let noise_m = deformation.noise_m;
    let surroundings =
        Surroundings { radius, matches, deformation: Some(deformation), weights, observations };
    let found = FingerprintEvidence {
        estimates,
        parts,
        recipients,
        grounds,
        pilots,
        recipient_decoys,
        key_decoys,
        noise_m,
    };
    Ok((Found::Fingerprint(found), surroundings))
}

impl FingerprintEvidence {
    /// Returns the score of a recipient in every patch alone; `None` where nothing was observed.
    pub fn patch_scores(&self, key: &SecretKey, recipient: &str) -> Vec<Option<f64>> {
        let evidence = Evidence::of_recipients(&self.estimates);
        let signs = recipient_signs(key, &self.parts, recipient);
        let score = |patch: Agreement| (patch.signs > 0).then_some(patch.score);
        evidence.patch_agreements(&signs).into_iter().map(score).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recipient_of_several_records_is_one_candidate() {
        let recipients = ["B", "A", "B", "C", "A"].map(String::from);
        let (names, places) = distinct(&recipients);
        assert_eq!(names, ["B", "A", "C"]);
        assert_eq!(places, [0, 1, 0, 2, 1]);
    }
}
