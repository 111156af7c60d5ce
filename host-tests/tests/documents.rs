//! The commands of the documents, as they stand there. Those of docs/verifier.md are run by the verifier's own tests, those of
//! docs/qgis.md and the Python of docs/driver.md by `make hosts`.

use meshmark_host_tests::plugin::{Host, fixture, library};
use std::{
    fs,
    os::unix::fs::symlink,
    path::Path,
    process::{Command, Output},
};

/// The ```sh blocks of a document.
fn blocks(document: &str) -> Vec<String> {
    let text = fs::read_to_string(fixture("..").join(document)).unwrap();
    let after = text.split("```sh\n").skip(1);
    after.map(|rest| rest.split("```").next().unwrap_or_default().to_string()).collect()
}

/// The commands of a block, one each. What builds and finds the programs is this test's own affair.
fn commands(block: &str) -> Vec<String> {
    let joined = block.replace("\\\n", " ");
    let is_own =
        |line: &&str| !line.trim().is_empty() && !line.starts_with("make ") && !line.starts_with("export ");
    joined.lines().filter(is_own).map(String::from).collect()
}

/// Runs a script where a map, a list, the key and the fixtures are; `suspect.gpkg` is what will be `marked.gpkg`.
fn run(script: &str) -> Output {
    let host = Host::new();
    if script.contains("keygen key.json") {
        fs::remove_file(host.path("key.json")).unwrap();
    }
    host.copy("helsinki.gpkg", "map.gpkg");
    host.run("ogr2ogr", &["map.shp", "map.gpkg", "buildings", "-lco", "ENCODING=UTF-8"]);
    fs::write(host.path("list.csv"), "recipient\nACME GmbH\n").unwrap();
    symlink("marked.gpkg", host.path("suspect.gpkg")).unwrap();
    symlink(fixture(""), host.path("fixtures")).unwrap();
    let programs = library().parent().map(Path::to_path_buf).unwrap();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    let mut command = Command::new("bash");
    command.current_dir(host.folder()).env("PATH", path).env("GDAL_DRIVER_PATH", host.plugins());
    command.args(["-e", "-c", script]).output().unwrap()
}

fn assert_works(document: &str, script: &str) {
    let output = run(script);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{document}:\n{script}\n{said}");
}

#[test]
fn the_commands_of_the_readme_work() {
    let blocks = blocks("README.md");
    assert!(blocks.len() >= 3);
    blocks.iter().for_each(|block| assert_works("README.md", &commands(block).join("\n")));
}

#[test]
fn every_command_of_the_driver_page_works_by_itself() {
    let blocks = blocks("docs/driver.md");
    let commands: Vec<String> = blocks.iter().flat_map(|block| commands(block)).collect();
    assert!(commands.len() >= 5);
    commands.iter().for_each(|command| assert_works("docs/driver.md", command));
}

#[test]
fn the_commands_of_the_page_about_many_recipients_work() {
    let blocks = blocks("docs/distribute.md");
    assert!(blocks.len() >= 2);
    blocks.iter().for_each(|block| assert_works("docs/distribute.md", &commands(block).join("\n")));
}
