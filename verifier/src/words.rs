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

/// Quotes a word for a shell. Characters that change the text direction are escaped for bash, zsh
/// and ksh.
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./,:=+@%".contains(c);
    if printable(word) != word {
        let escaped = word.chars().map(|c| match c {
            '\'' | '\\' => format!("\\{c}"),
            c if printable(c.encode_utf8(&mut [0; 4])).starts_with(c) => c.into(),
            c if c.len_utf16() == 1 => format!("\\u{:04x}", u32::from(c)),
            c => format!("\\U{:08x}", u32::from(c)),
        });
        return format!("$'{}'", escaped.collect::<String>());
    }
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.into(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

/// Length to which names are cut, characters; a longer name fills pages.
const LONGEST_NAME: usize = 200;

/// Returns a printable name, cut to the limit; the JSON report has the full name.
pub(crate) fn clipped(name: &str) -> String {
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
    fn a_shell_reads_hidden_characters_of_a_quoted_word() {
        assert_eq!(quoted("A\u{200b}\u{e0041}B"), r"$'A\u200b\U000e0041B'");
    }

    #[test]
    fn names_do_not_steer_the_terminal() {
        assert_eq!(printable("A\u{1b}[31m\nB é"), r"A\u{1b}[31m\u{a}B é");
        assert_eq!(printable("HbmG \u{202e}EMCA"), r"HbmG \u{202e}EMCA");
    }
}
