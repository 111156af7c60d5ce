//! Probabilities in words.

use super::page::count;
use maud::{Markup, html};

/// Returns the frequency of an equally good result by chance, in words and number, to end a
/// sentence: "in about 43 of 100 tries".
pub fn how_often(p_log10: f64) -> Markup {
    if p_log10 > -2.0 {
        return html! { (format!("in about {:.0} of 100 tries", 100.0 * 10f64.powf(p_log10))) };
    }
    // The number of tries is rounded down, against the verdict.
    let power = (-p_log10 + 1e-9).floor();
    let digit = (10f64.powf(-p_log10 - power) + 1e-6).floor();
    let (digit, power) = (digit as usize, power as usize);
    let number = html! {
        @match (digit, power) {
            (_, ..6) => (count(digit * 10usize.pow(power as u32))),
            (1, _) => { "10" sup { (power) } }
            _ => { (digit) "\u{a0}×\u{a0}10" sup { (power) } }
        }
    };
    html! {
        @match in_words(digit, power) {
            Some(words) => { "less than once in " (words) " tries (" (number) ")" }
            None => { "less than once in " (number) " tries, a number of " (power + 1) " digits" }
        }
    }
}

/// Returns a number in words; none where no common word exists.
fn in_words(digit: usize, power: usize) -> Option<String> {
    const DIGITS: [&str; 10] = ["", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"];
    const TENS: [&str; 10] =
        ["", "ten", "twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety"];
    // "Billion" is avoided, as it means a thousand million in some countries and a million million
    // in others.
    let unit = match power / 3 {
        0 => "",
        1 => " thousand",
        2 => " million",
        3 => " thousand million",
        4 => " million million",
        _ => return None,
    };
    Some(match power % 3 {
        0 => format!("{}{unit}", DIGITS[digit]),
        1 => format!("{}{unit}", TENS[digit]),
        _ => format!("{} hundred{unit}", DIGITS[digit]),
    })
}

/// Formats a probability, for example "2.9 × 10⁻³⁹" or "0.043".
pub fn probability(p_log10: f64) -> Markup {
    if p_log10 > -3.0 {
        return html! { (format!("{:.3}", 10f64.powf(p_log10))) };
    }
    let scientific = format!("{:.1e}", 10f64.powf(p_log10 - p_log10.floor()));
    let (digits, carried) = scientific.split_once('e').expect("it is scientific");
    let power = -p_log10.floor() as i64 - carried.parse::<i64>().expect("a small number");
    html! { (digits) "\u{a0}×\u{a0}10" sup { "−" (power) } }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(text: Markup) -> String {
        text.into_string().replace('\u{a0}', " ")
    }

    #[test]
    fn odds_are_said_in_words_and_number_and_rounded_against_the_verdict() {
        for (p_log10, said) in [
            (0.43f64.log10(), "in about 43 of 100 tries"),
            (-2.0, "less than once in one hundred tries (100)"),
            (1e-6f64.log10(), "less than once in one million tries (10<sup>6</sup>)"),
            (-4.6, "less than once in thirty thousand tries (30\u{202f}000)"),
            (-11.9, "less than once in seven hundred thousand million tries (7 × 10<sup>11</sup>)"),
            (-38.5, "less than once in 3 × 10<sup>38</sup> tries, a number of 39 digits"),
        ] {
            assert_eq!(plain(how_often(p_log10)), said);
        }
    }

    #[test]
    fn small_probabilities_are_powers_of_ten() {
        for (p_log10, said) in [
            (-0.5, "0.316"),
            (-38.5, "3.2 × 10<sup>−39</sup>"),
            (-4.0, "1.0 × 10<sup>−4</sup>"),
            (-3.001, "1.0 × 10<sup>−3</sup>"),
            (-747.3, "5.0 × 10<sup>−748</sup>"),
        ] {
            assert_eq!(plain(probability(p_log10)), said);
        }
    }
}
