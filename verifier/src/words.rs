//! Words of a command line.

use meshmark_core::visible;

/// Quotes a word for a shell. Characters that change the text direction are escaped for bash, zsh
/// and ksh.
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./,:=+@%".contains(c);
    if visible(word) != word {
        let escaped = word.chars().map(|c| match c {
            '\'' | '\\' => format!("\\{c}"),
            c if visible(c.encode_utf8(&mut [0; 4])).starts_with(c) => c.into(),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_hidden_characters_of_a_quoted_word() {
        assert_eq!(quoted("A\u{200b}\u{e0041}B"), r"$'A\u200b\U000e0041B'");
    }
}
