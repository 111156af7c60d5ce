//! Counts and nouns in messages.

/// Returns a number and its noun, which is given in the singular: `1 record`, `2 records`,
/// `3 vertices`.
pub fn counted(count: usize, noun: &str) -> String {
    match count {
        1 => format!("1 {noun}"),
        _ => format!("{count} {}", plural(noun)),
    }
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
}
