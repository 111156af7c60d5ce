//! Probabilities as people say them.

use maud::{Markup, html};

/// How often chance does as well, in words and number, to end a sentence with: "in about 43 of 100 tries".
pub fn how_often(p_log10: f64) -> String {
    if p_log10 > -2.0 {
        return format!("in about {:.0} of 100 tries", 100.0 * 10f64.powf(p_log10));
    }
    // Rounded against the verdict: there are at least so many tries.
    let power = (-p_log10).floor();
    let digit = (10f64.powf(-p_log10 - power) + 1e-9).floor();
    let power = power as i32;
    let number = match (digit as u32, power) {
        (_, ..6) => super::count((digit * 10f64.powi(power)) as usize),
        (1, _) => format!("10{}", superscript(power)),
        (digit, _) => format!("{digit}\u{a0}×\u{a0}10{}", superscript(power)),
    };
    match in_words(digit as usize, power) {
        Some(words) => format!("less than once in {words} tries ({number})"),
        None => format!("less than once in {number} tries, a number of {} digits", power + 1),
    }
}

/// None for numbers that nobody has a word for.
fn in_words(digit: usize, power: i32) -> Option<String> {
    const DIGITS: [&str; 10] =
        ["", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"];
    const TENS: [&str; 10] =
        ["", "ten", "twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety"];
    // No billion: it is a thousand million in one country and a million million in another.
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

/// "10⁻⁷", or "0.043".
pub fn probability(p_log10: f64) -> String {
    if p_log10 > -3.0 {
        return format!("{:.3}", 10f64.powf(p_log10));
    }
    let power = p_log10.floor();
    let digit = 10f64.powf(p_log10 - power);
    let (digit, power) = if digit >= 9.95 { (1.0, power + 1.0) } else { (digit, power) };
    format!("{digit:.1}\u{a0}×\u{a0}10{}", superscript(power as i32))
}

/// Text with its raised digits as the page raises them, which looks the same in every font.
pub fn raised(text: &str) -> Markup {
    let plain = |c: char| match c {
        '⁻' => Some('−'),
        _ => "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().position(|digit| digit == c).and_then(|d| char::from_digit(d as u32, 10)),
    };
    let mut rest = text;
    html! {
        @while !rest.is_empty() {
            @let at = rest.find(|c| plain(c).is_some()).unwrap_or(rest.len());
            @let (before, after) = rest.split_at(at);
            @let end = after.find(|c| plain(c).is_none()).unwrap_or(after.len());
            @let (digits, others) = after.split_at(end);
            (before)
            @if !digits.is_empty() { sup { (digits.chars().filter_map(plain).collect::<String>()) } }
            @let () = rest = others;
        }
    }
}

fn superscript(number: i32) -> String {
    let digit = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        c => char::from_u32('⁰' as u32 + c as u32 - '0' as u32).expect("a digit"),
    };
    number.to_string().chars().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odds_are_said_in_words_and_number_and_rounded_against_the_verdict() {
        for (p_log10, said) in [
            (0.43f64.log10(), "in about 43 of 100 tries"),
            (-2.0, "less than once in one hundred tries (100)"),
            (1e-6f64.log10(), "less than once in one million tries (10⁶)"),
            (-4.6, "less than once in thirty thousand tries (30\u{202f}000)"),
            (-11.9, "less than once in seven hundred thousand million tries (7 × 10¹¹)"),
            (-38.5, "less than once in 3 × 10³⁸ tries, a number of 39 digits"),
        ] {
            assert_eq!(how_often(p_log10).replace('\u{a0}', " "), said);
        }
    }

    #[test]
    fn small_probabilities_are_powers_of_ten() {
        let said = [-0.5, -38.5, -4.0, -3.001].map(|p| probability(p).replace('\u{a0}', " "));
        assert_eq!(said, ["0.316", "3.2 × 10⁻³⁹", "1.0 × 10⁻⁴", "1.0 × 10⁻³"]);
    }
}
