//! What is written about the options is what the code does.

use meshmark_core::options::{CREATION_OPTIONS, OPTIONS, option_table_markdown};

#[test]
fn the_readme_has_the_option_table_of_the_code() {
    let readme = include_str!("../../README.md");
    let table = option_table_markdown(OPTIONS);
    assert!(readme.contains(&table), "README.md needs this table:\n{table}");
}

#[test]
fn the_driver_page_has_the_creation_options_of_the_code() {
    let page = include_str!("../../docs/driver.md");
    let table = option_table_markdown(CREATION_OPTIONS);
    assert!(page.contains(&table), "docs/driver.md needs this table:\n{table}");
}
