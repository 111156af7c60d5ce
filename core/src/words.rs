//! Counts, nouns and names in messages.

/// Returns a number and its noun, which is given in the singular: `1 record`, `2 records`,
/// `3 vertices`.
pub fn counted(count: usize, noun: &str) -> String {
    match count {
        1 => format!("1 {noun}"),
        _ => format!("{count} {}", plural(noun)),
    }
}

/// Returns a text in which nobody can hide a character or change how it is displayed: every
/// character that is invisible, that looks like a space or that changes lines or the direction of
/// text is written as `\u{…}`. Different texts stay different.
pub fn visible(text: &str) -> String {
    let mut visible = String::with_capacity(text.len());
    for (at, c) in text.char_indices() {
        // Otherwise, a name could hold the spelling of such a character.
        let is_spelling = text[at..].starts_with("\\u{");
        match is_hidden(c) || is_spelling {
            true => visible.extend(c.escape_unicode()),
            false => visible.push(c),
        }
    }
    visible
}

/// Returns whether a character has no glyph of its own: control and format characters, fillers,
/// selectors of variants, tags (Unicode 16, general categories Cc, Cf, Zl, Zp, Zs and
/// Default_Ignorable_Code_Point).
fn is_hidden(c: char) -> bool {
    c.is_control()
        || c.is_whitespace() && c != ' '
        || matches!(c,
            '\u{ad}' | '\u{34f}' | '\u{600}'..='\u{605}' | '\u{61c}' | '\u{6dd}' | '\u{70f}'
            | '\u{890}'..='\u{891}' | '\u{8e2}' | '\u{115f}'..='\u{1160}' | '\u{17b4}'..='\u{17b5}'
            | '\u{180b}'..='\u{180f}' | '\u{200b}'..='\u{200f}' | '\u{202a}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}' | '\u{2800}' | '\u{3164}' | '\u{fe00}'..='\u{fe0f}' | '\u{feff}'
            | '\u{ffa0}' | '\u{fff0}'..='\u{fffb}' | '\u{110bd}' | '\u{110cd}' | '\u{13430}'..='\u{1343f}'
            | '\u{1bca0}'..='\u{1bca3}' | '\u{1d173}'..='\u{1d17a}' | '\u{e0000}'..='\u{e0fff}')
}

fn plural(noun: &str) -> String {
    let ending = |ending, plural| noun.strip_suffix(ending).map(|stem| format!("{stem}{plural}"));
    let irregular = [("tex", "tices"), ("py", "pies"), ("ry", "ries"), ("ch", "ches")];
    let irregular = irregular.into_iter().find_map(|(singular, plural)| ending(singular, plural));
    irregular.unwrap_or_else(|| format!("{noun}s"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_singular_and_nothing_and_many_are_plural() {
        let all = ["record", "vertex", "copy", "patch", "geometry"]
            .map(|noun| [0, 1, 2].map(|count| counted(count, noun)));
        assert_eq!(all[0], ["0 records", "1 record", "2 records"]);
        assert_eq!(all[1], ["0 vertices", "1 vertex", "2 vertices"]);
        assert_eq!(all[2], ["0 copies", "1 copy", "2 copies"]);
        assert_eq!(all[4], ["0 geometries", "1 geometry", "2 geometries"]);
        assert_eq!(all[3], ["0 patches", "1 patch", "2 patches"]);
    }

    #[test]
    fn names_that_differ_in_hidden_characters_do_not_look_alike() {
        let hidden = [
            '\u{a0}',
            '\u{ad}',
            '\u{200b}',
            '\u{200c}',
            '\u{200d}',
            '\u{202e}',
            '\u{2028}',
            '\u{2029}',
            '\u{2060}',
            '\u{3164}',
            '\u{fe0f}',
            '\u{feff}',
            '\u{e0041}',
            '\u{e0100}',
            '\n',
            '\u{1b}',
        ];
        for c in hidden {
            let shown = visible(&format!("AC{c}ME"));
            assert_eq!(shown, format!("AC\\u{{{:x}}}ME", u32::from(c)));
            assert_ne!(visible(&shown), shown, "a name that spells the character");
        }
        for plain in ["ACME GmbH", "Öster & Söhne", "宮城県", "C:\\users\\a", "न्यू", "مثال"]
        {
            assert_eq!(visible(plain), plain);
        }
    }
}
