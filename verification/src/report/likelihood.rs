//! The likelihood ratios of a recipient, as part of the report, in numbers and in words.

use meshmark_detection::decision::likelihood::{LEAST_LOG10, MOST_LOG10, Ratios};
use serde::Serialize;

/// Rungs of the verbal scale: log₁₀ of the ratio below which each expression holds.
///
/// European Network of Forensic Science Institutes, *ENFSI guideline for evaluative reporting in
/// forensic science*, approved version 3.0, 2015.
const SCALE: [(f64, &str); 7] = [
    (0.301, "no"),
    (1.0, "weak"),
    (2.0, "moderate"),
    (3.0, "moderately strong"),
    (4.0, "strong"),
    (6.0, "very strong"),
    (f64::INFINITY, "extremely strong"),
];

/// What the first ratio compares with.
const ANOTHER: &str = "a copy of another recipient";

/// The likelihood ratios of a recipient.
#[derive(Debug, Clone, Serialize)]
pub struct LikelihoodEntry {
    /// The ratios.
    #[serde(flatten)]
    pub ratios: Ratios,
    /// The first one in words.
    pub another_recipient: String,
    /// The second one in words.
    pub no_copy: String,
    /// log₁₀ of the smallest and the largest ratio that are stated.
    pub stated_log10: [f64; 2],
}

impl LikelihoodEntry {
    /// Adds the words.
    pub fn new(ratios: Ratios) -> Self {
        LikelihoodEntry {
            another_recipient: support(ratios.another_recipient_log10, ANOTHER),
            no_copy: match points_elsewhere(&ratios) {
                true => "support for some copy of this key, and not for that of this recipient".into(),
                false => support(ratios.no_copy_log10, "no copy of this key"),
            },
            ratios,
            stated_log10: [LEAST_LOG10, MOST_LOG10],
        }
    }

    /// Returns lines of text.
    pub(crate) fn to_lines(&self) -> Vec<String> {
        let line = |log10: f64, against: &str, support: &str| {
            format!("{} against {against}: {support}", number(log10))
        };
        if points_elsewhere(&self.ratios) {
            let other = line(self.ratios.another_recipient_log10, ANOTHER, &self.another_recipient);
            return vec![format!("likelihood:   ratio {other}")];
        }
        let [other, none] = self.each(line);
        vec![format!("likelihood:   ratio {other}"), format!("              ratio {none}")]
    }

    /// Returns sentences.
    pub(crate) fn to_sentences(&self) -> Vec<String> {
        let sentence = |log10: f64, instead: &str, support: &str| {
            format!(
                "What was observed is {} as probable if the suspect was made from the copy of this recipient as if it was made \
                 from {instead}: {support}.",
                times(log10)
            )
        };
        let rest = [
            format!(
                "The words are those of the ENFSI guideline for evaluative reporting (2015). Ratios from {} to {} alone are \
                 stated, as the calibration study supports no others.",
                number(LEAST_LOG10),
                number(MOST_LOG10)
            ),
            "A likelihood ratio is not the probability that the suspect was made from this copy. That one also depends on \
             everything else that is known, such as how many others had a copy: to combine the two is the business of the \
             court alone."
                .into(),
        ];
        let [other, none] = self.each(sentence);
        let none = match points_elsewhere(&self.ratios) {
            true => "No ratio against no copy of this key is stated: what shows of the key supports a copy of another                      recipient."
                .into(),
            false => none,
        };
        [other, none].into_iter().chain(rest).collect()
    }

    fn each(&self, text: impl Fn(f64, &str, &str) -> String) -> [String; 2] {
        let Ratios { another_recipient_log10, no_copy_log10 } = self.ratios;
        [
            text(another_recipient_log10, ANOTHER, &self.another_recipient),
            text(no_copy_log10, "no copy of this key", &self.no_copy),
        ]
    }
}

/// Returns whether a mark of the key shows, and speaks against the copy of this recipient: the ratio against no
/// copy, read alone, would then accuse him.
fn points_elsewhere(ratios: &Ratios) -> bool {
    ratios.another_recipient_log10 < 0.0 && ratios.no_copy_log10 > 0.0
}

/// Names the support for the recipient's copy, or for what it is compared with.
fn support(log10: f64, instead: &str) -> String {
    let rung = SCALE.iter().find(|(end, _)| log10.abs() < *end);
    match rung.map_or("no", |(_, word)| word) {
        "no" => "no support for either".into(),
        word if log10 > 0.0 => format!("{word} support for the copy of this recipient"),
        word => format!("{word} support for {instead}"),
    }
}

/// Formats a ratio with one digit, or two below 100.
fn number(log10: f64) -> String {
    if log10 < 0.0 {
        return format!("1/{}", number(-log10));
    }
    let ratio = 10f64.powf(log10);
    let step = 10f64.powf((log10 + 1e-9).floor());
    match ratio {
        ..10.0 => format!("{ratio:.1}").trim_end_matches(".0").into(),
        _ => format!("{:.0}", ((ratio + 1e-6 * step) / step).floor() * step),
    }
}

/// Says how many times as probable something is.
fn times(log10: f64) -> String {
    match number(log10.abs()).as_str() {
        "1" => "just".into(),
        number if log10 > 0.0 => format!("{number} times"),
        number => format!("only 1/{number}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_of_another_recipient_supports_no_statement_about_this_one() {
        let entry = LikelihoodEntry::new(Ratios { another_recipient_log10: -1.8, no_copy_log10: MOST_LOG10 });
        let texts = [entry.to_lines(), entry.to_sentences(), vec![entry.no_copy]].concat().join("\n");
        assert!(!texts.contains("support for the copy of this recipient"), "{texts}");
        assert!(texts.contains("moderate support for a copy of another recipient"), "{texts}");
    }

    #[test]
    fn ratios_have_the_words_of_the_scale_for_either_side() {
        for (log10, words) in [
            (0.0, "no support for either"),
            (-0.3, "no support for either"),
            (0.4, "weak support for the copy of this recipient"),
            (1.0, "moderate support for the copy of this recipient"),
            (3.9, "strong support for the copy of this recipient"),
            (5.9, "very strong support for the copy of this recipient"),
            (6.0, "extremely strong support for the copy of this recipient"),
            (-1.9, "moderate support for X"),
            (-2.0, "moderately strong support for X"),
        ] {
            assert_eq!(support(log10, "X"), words, "{log10}");
        }
    }

    #[test]
    fn ratios_are_numbers_that_are_rounded_down() {
        for (log10, text) in [
            (0.0, "1"),
            (0.3, "2"),
            (0.7, "5"),
            (1.0, "10"),
            (3.7, "5000"),
            (6.0, "1000000"),
            (-2.0, "1/100"),
            (-0.7, "1/5"),
        ] {
            assert_eq!(number(log10), text, "{log10}");
        }
        assert_eq!([0.0, 2.0, -2.0].map(times), ["just", "100 times", "only 1/100"]);
    }
}
