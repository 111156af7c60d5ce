//! What is written about the options is what the code does.

use meshmark_core::options::option_table_markdown;

#[test]
fn the_readme_has_the_option_table_of_the_code() {
    let readme = include_str!("../../README.md");
    let table = option_table_markdown();
    assert!(readme.contains(&table), "README.md needs this table:\n{table}");
}
