//! The report as a short text.

use super::{Certainty, Faults, LikelihoodEntry, Report};
use crate::words::power_of_ten;
use meshmark_core::{code::Decoder, counted};
use meshmark_detection::{
    Observations,
    decision::{Verdict, shows_key},
    matching::RadiusReason,
};

impl Report {
    /// Returns a short text.
    pub fn to_text(&self) -> String {
        let mut lines = vec![format!("verdict:      {}: {}", self.verdict_name(), self.reason)];
        if let Some(candidates) = &self.candidates {
            lines.extend(candidates.to_lines());
        }
        if let Some(message) = &self.message {
            let errors = self.bit_errors.map_or(String::new(), |errors| {
                format!(
                    " ({errors} of {} bits differ from the expected message{})",
                    self.bits.len(),
                    self.bits_by_chance()
                )
            });
            lines.push(format!("message:      {message}{}{errors}", self.other_reading()));
            // Noise also decodes to a code word and bits, whose odds are valid only for a mark.
            lines.extend(self.decoding().map(|how| format!("code:         {how}")));
            lines.push(match self.certainty_of_mark() {
                Some(certainty) => format!("bits:         {certainty}"),
                None => "bits:         no better than guessed, for no mark of this key shows".into(),
            });
        }
        lines.extend(self.fingerprint.iter().flat_map(|fingerprint| fingerprint.to_lines()));
        lines.extend(self.p_value_lines());
        lines.extend(self.likelihood.iter().flat_map(LikelihoodEntry::to_lines));
        let v = &self.vertices;
        lines.push(format!(
            "vertices:     {} of {} reference vertices found within {} m{} among {} of the suspect{}",
            v.matched,
            v.reference,
            self.parameters.radius_m,
            self.radius_reason(),
            v.suspect,
            self.read_from()
        ));
        lines.extend(self.other_crs().map(|text| format!("CRS:          {text}")));
        lines.extend(self.deposit.iter().flat_map(|deposit| deposit.to_lines()));
        lines.extend(self.left_out.to_text().map(|faults| format!("left out:     {faults}")));
        lines.push(format!("registration: {}", self.registration.to_text()));
        lines.join("\n") + "\n"
    }

    fn p_value_lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if let (Some(p), Some(mark), Some(recipient)) =
            (self.p_value_log10, self.p_mark_log10, self.p_recipient_log10)
        {
            let tried = if self.tried > 1 { format!(", times {} tried", self.tried) } else { String::new() };
            lines.push(format!(
                "p-value:      {} (key {}, recipient {}{tried})",
                power_of_ten(p),
                power_of_ten(mark),
                power_of_ten(recipient)
            ));
        }
        if let (Some(p), Some(_)) = (self.p_value_log10, &self.fingerprint) {
            lines.push(format!("p-value:      {}", power_of_ten(p)));
        }
        if let Some(p) = self.p_missed_log10 {
            lines.push(format!(
                "power:        a mark that the suspect carries is missed with a probability of at most {}",
                power_of_ten(p)
            ));
        }
        if let Some(p) = self.p_any_message_log10.filter(|_| self.verdict != Verdict::Match) {
            let says = match self.shows_key() {
                true => "a mark of this key is present, whatever its message or code",
                false => "no mark of this key shows, whatever its message",
            };
            lines.push(format!("key:          {says} (p-value {})", power_of_ten(p)));
        }
        lines
    }

    /// Returns why the matching radius is not the least one.
    pub(crate) fn radius_reason(&self) -> &'static str {
        match self.parameters.radius_reason {
            RadiusReason::Given | RadiusReason::Least => "",
            RadiusReason::Noise => " (the least radius that holds those displaced by noise)",
            RadiusReason::Groups => " of places to which their polygon groups were shifted",
            RadiusReason::Deformation => " of places to which a deformation took them",
        }
    }

    /// Returns what the displacements were read from, where it is not the matched vertices.
    pub(crate) fn read_from(&self) -> &'static str {
        match self.parameters.observations {
            Some(Observations::Corners) => {
                "; its lines were drawn anew, so the displacements are those of corners between its lines"
            }
            Some(Observations::Centroids) => {
                "; the displacements are those of the centroids of polygons, which its points are"
            }
            Some(Observations::Boxes) => {
                "; the displacements are those of the bounding boxes of polygons, which its rings are"
            }
            Some(Observations::Vertices) | None => "",
        }
    }

    /// Returns how many bits of an unrelated message differ, where some do, as an addition to a sentence.
    pub(crate) fn bits_by_chance(&self) -> String {
        match self.bit_errors {
            Some(1..) => format!("; by chance {} would", self.bits.len() / 2),
            _ => String::new(),
        }
    }

    /// Returns the other reading of the message, where it is unknown whether the key whitened it.
    pub(crate) fn other_reading(&self) -> String {
        let other = self.unwhitened_message.as_ref().filter(|_| self.null_hypothesis.is_none());
        other.map_or(String::new(), |other| format!(", or {other} if the copy was marked with MESSAGE"))
    }

    /// Describes the LDPC decoding of a visible mark.
    pub(crate) fn decoding(&self) -> Option<String> {
        let code = self.code.filter(|_| self.shows_mark())?;
        let how = match code.decoder? {
            Decoder::Sign => return None,
            Decoder::BeliefPropagation => "belief propagation, all parity checks hold",
            Decoder::OrderedStatistics => "ordered statistics, the most likely code word of those near",
        };
        let of = code.name.channel_bits(self.bits.len()).expect("they were decoded");
        let wrong = code.channel_bit_errors.map(|wrong| format!("{wrong} of {of} code bits were wrong; "));
        Some(format!("{}read by {how}", wrong.unwrap_or_default()))
    }

    /// Describes the certainty of the bits of a visible mark.
    pub(crate) fn certainty_of_mark(&self) -> Option<String> {
        let certainty = self.certainty.filter(|_| self.shows_mark())?;
        Some(certainty.to_text(self.bits.len()))
    }

    /// Returns whether the decoded bits come from a mark rather than from noise.
    pub(crate) fn shows_mark(&self) -> bool {
        self.verdict == Verdict::Match || self.shows_key()
    }

    /// Returns whether the suspect carries some mark of the key, whatever its message.
    pub fn shows_key(&self) -> bool {
        match &self.fingerprint {
            Some(fingerprint) => fingerprint.shows_key(),
            None => shows_key(self.p_any_message_log10),
        }
    }

    /// Returns whether a copy was sought, and not a key alone.
    pub(crate) fn is_of_somebody(&self) -> bool {
        self.null_hypothesis.is_some() || self.parameters.recipient.is_some() || self.candidates.is_some()
    }

    pub(crate) fn verdict_name(&self) -> &'static str {
        match self.verdict {
            Verdict::Match => "MATCH",
            Verdict::NoMatch => "NO MATCH",
            Verdict::Inconclusive => "INCONCLUSIVE",
        }
    }
}

impl Faults {
    /// Describes the faults of a suspect that has some.
    pub(crate) fn to_text(&self) -> Option<String> {
        let count = |count: usize, what: &str| (count > 0).then(|| counted(count, what));
        let counts = [count(self.coordinates, "coordinate pair"), count(self.features, "feature")];
        let counts = counts.into_iter().flatten().collect::<Vec<_>>().join(" and ");
        let more = match self.coordinates + self.features > self.named.len() {
            true => "; and more",
            false => "",
        };
        (!counts.is_empty()).then(|| format!("{counts} of the suspect ({}{more})", self.named.join("; ")))
    }
}

impl Certainty {
    /// Describes the certainty of this number of bits.
    fn to_text(self, bits: usize) -> String {
        format!(
            "weakest right with odds {}, median {}; {} of {bits} over 1000 to 1",
            odds(self.weakest_llr),
            odds(self.median_llr),
            self.over_1000_to_1
        )
    }
}

/// Formats a log-likelihood ratio as odds, for example "1100 to 1"; it has one decimal, and the odds two digits.
fn odds(llr: f64) -> String {
    let odds = llr.exp();
    let place = 10f64.powf((odds.log10().floor() - 1.0).max(-1.0));
    match place {
        _ if odds > 1e6 => "over a million to 1".into(),
        ..1.0 => format!("{odds:.1} to 1"),
        _ => format!("{:.0} to 1", (odds / place).round() * place),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_certainty_of_the_bits_is_in_odds() {
        let certainty = Certainty { weakest_llr: 0.0, median_llr: 7.0, over_1000_to_1: 3 };
        assert_eq!(
            certainty.to_text(5),
            "weakest right with odds 1.0 to 1, median 1100 to 1; 3 of 5 over 1000 to 1"
        );
        let all = [0.1, 2.3, 4.0, 13.7, 13.8, 13.9].map(odds);
        assert_eq!(
            all,
            ["1.1 to 1", "10.0 to 1", "55 to 1", "890000 to 1", "980000 to 1", "over a million to 1"]
        );
    }
}
