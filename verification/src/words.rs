//! Numbers and names in messages and reports.

/// Formats a probability, given its logarithm.
pub fn power_of_ten(log10: f64) -> String {
    if log10 > -3.0 { format!("{:.3}", 10f64.powf(log10)) } else { format!("10^{log10:.1}") }
}

/// Returns text of a file on one line, without characters that control a terminal, change the text
/// direction or cannot be seen: no two names look alike because of them.
pub fn printable(text: &str) -> String {
    meshmark_core::visible(text)
}

/// Length to which names are cut, characters; a longer name fills pages.
const LONGEST_NAME: usize = 200;

/// Returns a printable name, cut to the limit; the JSON report has the full name.
pub fn clipped(name: &str) -> String {
    let printable = printable(name);
    match printable.char_indices().nth(LONGEST_NAME) {
        None => printable,
        Some((end, _)) => format!("{}… ({} characters)", &printable[..end], name.chars().count()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_do_not_steer_the_terminal() {
        assert_eq!(printable("A\u{1b}[31m\nB é"), r"A\u{1b}[31m\u{a}B é");
        assert_eq!(printable("HbmG \u{202e}EMCA"), r"HbmG \u{202e}EMCA");
    }
}
