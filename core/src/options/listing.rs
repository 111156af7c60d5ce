//! The table of options as XML for GDAL and as Markdown for the docs.

use super::{CREATION_OPTIONS, Kind, OPTIONS, OptionSpec};

/// Returns the XML list of open options a GDAL driver declares (DMD_OPENOPTIONLIST).
pub fn open_option_list_xml() -> String {
    list_xml("OpenOptionList", OPTIONS.iter())
}

/// Returns the XML list of dataset creation options a GDAL driver declares
/// (DMD_CREATIONOPTIONLIST).
pub fn creation_option_list_xml() -> String {
    list_xml("CreationOptionList", OPTIONS.iter().chain(CREATION_OPTIONS))
}

fn list_xml<'a>(element: &str, options: impl Iterator<Item = &'a OptionSpec>) -> String {
    let rows: String = options.map(option_xml).collect();
    format!("<{element}>{rows}</{element}>")
}

fn option_xml(option: &OptionSpec) -> String {
    let (kind, range) = match option.kind {
        Kind::Text => ("string", String::new()),
        Kind::Number(above, most) => ("float", format!(" min='{above}' max='{most}'")),
        Kind::Integer(least, most) => ("int", format!(" min='{least}' max='{most}'")),
        Kind::Choice(_) => ("string-select", String::new()),
    };
    let values: String = match option.kind {
        Kind::Choice(words) => words.iter().map(|word| format!("<Value>{word}</Value>")).collect(),
        _ => String::new(),
    };
    let default = option.default.map_or(String::new(), |d| format!(" default='{d}'"));
    let attributes = format!("type='{kind}'{range}{default} description='{}'", option.help);
    format!("<Option name='{}' {attributes}>{values}</Option>", option.name)
}

/// Returns options as a Markdown table, for the docs.
pub fn option_table_markdown(options: &[OptionSpec]) -> String {
    let row = |o: &OptionSpec| {
        format!("| `{}` | {} | {} |\n", o.name, o.default.map_or("".into(), |d| format!("`{d}`")), o.help)
    };
    let rows: String = options.iter().map(row).collect();
    format!("| option | default | meaning |\n|---|---|---|\n{rows}")
}

#[cfg(test)]
mod tests {
    use super::{super::Creation, *};

    #[test]
    fn the_xml_lists_declare_every_option() {
        let (open, create) = (open_option_list_xml(), creation_option_list_xml());
        for option in OPTIONS.iter().chain(CREATION_OPTIONS) {
            let name = format!("name='{}'", option.name);
            assert_eq!((open.contains(&name), create.contains(&name)), (!Creation::has(option.name), true));
            assert!(!option.help.contains(['\'', '<', '&']), "{} would break the XML", option.name);
        }
    }
}
