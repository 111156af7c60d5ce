//! Runs the commands of the documents unchanged. The verifier's own tests run those of
//! docs/verifier.md; `make hosts` runs those of docs/qgis.md and the Python of docs/driver.md.

use meshmark_host_tests::plugin::{Host, fixture, library};
use std::{
    fs,
    os::unix::fs::symlink,
    path::Path,
    process::{Command, Output},
};

/// Returns the ```sh blocks of a document.
fn blocks(document: &str) -> Vec<String> {
    let text = fs::read_to_string(fixture("..").join(document)).unwrap();
    let after = text.split("```sh\n").skip(1);
    after.map(|rest| rest.split("```").next().unwrap_or_default().to_string()).collect()
}

/// Returns the commands of a block one by one, without those that build and find the programs.
fn commands(block: &str) -> Vec<String> {
    let joined = block.replace("\\\n", " ");
    let is_own =
        |line: &&str| !line.trim().is_empty() && !line.starts_with("make ") && !line.starts_with("export ");
    joined.lines().filter(is_own).map(String::from).collect()
}

/// Runs a script in a folder with a map, a list, the key and the fixtures; `suspect.gpkg` becomes a
/// link to `marked.gpkg`.
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
fn the_commands_of_the_readme_work_one_after_the_other() {
    let blocks = blocks("README.md");
    assert!(blocks.len() >= 3);
    let all: Vec<String> = blocks.iter().flat_map(|block| commands(block)).collect();
    assert_works("README.md", &all.join("\n"));
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

#[test]
fn the_commands_of_the_page_about_deposits_work() {
    let blocks = blocks("docs/deposit.md");
    assert!(!blocks.is_empty());
    blocks.iter().for_each(|block| assert_works("docs/deposit.md", &commands(block).join("\n")));
}

#[test]
fn the_commands_of_the_page_about_series_work() {
    let blocks = blocks("docs/series.md");
    assert!(!blocks.is_empty());
    blocks.iter().for_each(|block| assert_works("docs/series.md", &commands(block).join("\n")));
}

/// Returns the documents, as paths from the root.
fn documents() -> Vec<String> {
    let folders = ["", "docs/", "examples/", "fixtures/", "fixtures/vectors/"];
    let pages = folders.iter().flat_map(|folder| {
        let entries = fs::read_dir(fixture("..").join(folder)).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.filter(|name| name.ends_with(".md")).map(move |name| format!("{folder}{name}"))
    });
    pages.collect()
}

/// Returns the anchors of the headings.
fn anchors(text: &str) -> Vec<String> {
    let headings = text.lines().filter_map(|line| line.strip_prefix('#'));
    let slug = |heading: &str| -> String {
        let kept = heading.trim_start_matches('#').trim().to_lowercase();
        let kept = kept.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    };
    headings.map(slug).collect()
}

#[test]
fn every_link_of_the_documents_leads_somewhere() {
    let root = fixture("..");
    let mut links = 0;
    for document in documents() {
        let text = fs::read_to_string(root.join(&document)).unwrap();
        let after = text.split("](").skip(1).chain(text.split("src=\"").skip(1));
        for link in after.filter_map(|rest| rest.split([')', '"']).next()) {
            if link.starts_with("http") {
                continue;
            }
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let folder = root.join(&document).parent().unwrap().to_path_buf();
            let file = if file.is_empty() { root.join(&document) } else { folder.join(file) };
            assert!(file.exists(), "{document}: {link}");
            let is_there =
                || fs::read_to_string(&file).is_ok_and(|text| anchors(&text).contains(&heading.to_string()));
            assert!(heading.is_empty() || is_there(), "{document}: {link}");
            links += 1;
        }
    }
    assert!(links > 50);
}

#[test]
fn every_make_target_of_the_documents_is_one() {
    let makefile = fs::read_to_string(fixture("../Makefile")).unwrap().replace("\\\n", " ");
    let targets = makefile.lines().find_map(|line| line.strip_prefix(".PHONY:")).unwrap();
    let targets: Vec<&str> = targets.split_whitespace().collect();
    let mut named = 0;
    for document in documents() {
        let text = fs::read_to_string(fixture("..").join(&document)).unwrap();
        for rest in text.split("`make ").skip(1).chain(text.split("\nmake ").skip(1)) {
            let target =
                rest.split(|c: char| !c.is_ascii_alphanumeric() && c != '-').next().unwrap_or_default();
            assert!(targets.contains(&target), "{document}: make {target}");
            named += 1;
        }
    }
    assert!(named > 10);
}
