//! Lists as text in the syntax of a CSV record: commas separate names, double quotes enclose a name
//! with a comma, and quotes inside them are doubled.

/// Splits a list into its names; `None` where a quote is not closed or text follows one.
pub fn split_list(text: &str) -> Option<Vec<String>> {
    let mut names = Vec::new();
    let mut rest = text;
    loop {
        rest = rest.trim_start();
        let (name, after) = match rest.strip_prefix('"') {
            Some(quoted) => unquote(quoted)?,
            None => {
                let end = rest.find(',').unwrap_or(rest.len());
                (rest[..end].trim_end().into(), &rest[end..])
            }
        };
        names.push(name);
        match after.trim_start().strip_prefix(',') {
            Some(more) => rest = more,
            None => return after.trim().is_empty().then_some(names),
        }
    }
}

/// Joins names to a list.
pub fn join_list<'a>(names: impl IntoIterator<Item = &'a String>) -> String {
    let needs_quotes =
        |name: &str| name.contains(',') || name.starts_with('"') || name.is_empty() || name.trim() != name;
    let quote = |name: &String| match needs_quotes(name) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.clone(),
    };
    names.into_iter().map(quote).collect::<Vec<_>>().join(", ")
}

/// Returns the name before the closing quote, and the text after it.
fn unquote(quoted: &str) -> Option<(String, &str)> {
    let (mut name, mut rest) = (String::new(), quoted);
    loop {
        let (part, after) = rest.split_once('"')?;
        name.push_str(part);
        match after.strip_prefix('"') {
            Some(more) => {
                name.push('"');
                rest = more;
            }
            None => return Some((name, after)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_hold_commas_spaces_and_doubled_quotes() {
        let names = |text: &str| split_list(text).unwrap();
        assert_eq!(names("a, b ,c"), ["a", "b", "c"]);
        assert_eq!(names(r#""a,b",c"#), ["a,b", "c"]);
        assert_eq!(names(r#" "a ""b"", c" , " d ""#), [r#"a "b", c"#, " d "]);
        assert_eq!(names(r#"5" pipes,"""6"" pipes""#), [r#"5" pipes"#, r#""6" pipes"#]);
        assert_eq!(names("a,,b"), ["a", "", "b"]);
        for bad in [r#""a,b"#, r#"a,""#, r#""a"b,c"#, r#""a" b"#, r#""a""#.trim_end_matches('"')] {
            assert_eq!(split_list(bad), None, "{bad}");
        }
    }

    #[test]
    fn a_joined_list_is_split_into_its_names() {
        let names = ["a", "a,b", "\"", "a \"b\"", "\"a\",", " a ", "", "ä, ö"].map(String::from);
        assert_eq!(split_list(&join_list(&names)).unwrap(), names);
    }
}
