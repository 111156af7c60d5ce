//! The agreement of secret signs, as part of the report.

use meshmark_core::agreement::Agreement;
use meshmark_detection::decision::{Decoys, recipients};
use serde::Serialize;

/// The evidence about a fingerprint.
#[derive(Debug, Clone, Serialize)]
pub struct FingerprintEntry {
    /// The signs of the recipient; null where none is named.
    pub recipient: Option<SignAgreement>,
    /// The pilots: the signs of the key alone, which all copies have.
    pub key: SignAgreement,
    /// The patches whose signs were observed; null without a recipient.
    pub patches: Option<PatchAgreement>,
    /// Scores of decoy recipients; null where no displacement was observed.
    pub recipient_decoys: Option<Decoys>,
    /// Scores of decoy keys; null where no displacement was observed.
    pub key_decoys: Option<Decoys>,
}

/// How far secret signs agree with a suspect.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct SignAgreement {
    /// Number of signs that the suspect shows.
    pub signs: usize,
    /// Number of them that agree.
    pub agreeing: usize,
    /// Number that would agree by chance, on average.
    pub by_chance: f64,
    /// The standard deviation of that number.
    pub by_chance_deviation: f64,
    /// The weighted agreement, in standard deviations of that of random signs.
    pub score: f64,
    /// log₁₀ of a bound of the probability of this score by chance.
    pub p_log10: f64,
}

/// How many patches agree by themselves.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct PatchAgreement {
    /// Number of patches of which something was observed.
    pub seen: usize,
    /// Number of them whose score alone is at least [`PatchAgreement::CLEAR`] standard deviations.
    pub clear: usize,
}

impl FingerprintEntry {
    /// Returns whether a mark of the key is present, whoever its recipient is.
    pub fn shows_key(&self) -> bool {
        recipients::shows_key(self.key.score)
    }

    /// Returns lines of text.
    pub(crate) fn to_lines(&self) -> Vec<String> {
        if self.key.signs == 0 {
            return vec!["signs:        no secret sign shows, for nothing moved".into()];
        }
        let recipient =
            self.recipient.map(|signs| format!("signs:        {}", signs.to_text("of the recipient")));
        let key = format!("key:          {}", self.key.to_text("of the key"));
        let patches = self.patches.map(|PatchAgreement { seen, clear }| {
            let least = PatchAgreement::CLEAR;
            format!(
                "patches:      {clear} of {seen} show the recipient by themselves, by {least} standard deviations or more"
            )
        });
        recipient.into_iter().chain([key]).chain(patches).collect()
    }
}

impl From<Agreement> for SignAgreement {
    fn from(agreement: Agreement) -> Self {
        let [by_chance, by_chance_deviation] = agreement.by_chance();
        let Agreement { score, signs, agreeing } = agreement;
        let p_log10 = recipients::p_log10(score);
        SignAgreement { signs, agreeing, by_chance, by_chance_deviation, score, p_log10 }
    }
}

impl SignAgreement {
    /// Describes the agreement of the signs of somebody.
    pub(crate) fn to_text(self, whose: &str) -> String {
        let SignAgreement { signs, agreeing, by_chance, by_chance_deviation, .. } = self;
        format!(
            "of {signs} secret signs {whose} {agreeing} agree; by chance {by_chance:.0} ± {by_chance_deviation:.0} would"
        )
    }
}

impl PatchAgreement {
    /// A patch whose score reaches this many standard deviations shows a recipient by itself.
    pub const CLEAR: f64 = 4.0;

    /// Counts the patches, given the score of each; `None` where nothing was observed.
    pub fn new(scores: &[Option<f64>]) -> Self {
        let seen = scores.iter().flatten();
        let clear = seen.clone().filter(|score| **score >= Self::CLEAR).count();
        PatchAgreement { seen: seen.count(), clear }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_are_in_numbers_with_those_of_chance() {
        let agreement = SignAgreement::from(Agreement { score: 95.0, signs: 10_240, agreeing: 9812 });
        let text = "of 10240 secret signs of the key 9812 agree; by chance 5120 ± 51 would";
        assert_eq!(agreement.to_text("of the key"), text);
        assert!(agreement.p_log10 < -1000.0);
        let patches = PatchAgreement::new(&[Some(4.0), Some(3.9), None, Some(-4.0)]);
        assert_eq!((patches.seen, patches.clear), (3, 1));
    }
}
