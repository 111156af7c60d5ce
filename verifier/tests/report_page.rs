//! The report as a page: whole, the same for the same input, and proof against what files say.

use gdal::{
    Dataset, DatasetOptions, GdalOpenFlags,
    vector::{LayerAccess, sql::Dialect},
};
use meshmark_verifier::ExitCode;
use scraper::{Html, Selector};
use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A folder with the test vectors in it.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let vectors = folder.path().join("fingerprint");
    fs::create_dir(&vectors).unwrap();
    for file in ["record.json", "marked.gpkg"] {
        fs::copy(root().join("fixtures/vectors/fingerprint").join(file), vectors.join(file)).unwrap();
    }
    for file in
        ["kotka.gpkg", "helsinki.gpkg", "vectors/key.json", "vectors/record.json", "vectors/marked.gpkg"]
    {
        let from = root().join("fixtures").join(file);
        fs::copy(&from, folder.path().join(from.file_name().unwrap())).unwrap();
    }
    folder
}

fn meshmark(folder: &Path, threads: usize, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_meshmark"));
    command
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", threads.to_string())
        .args(arguments)
        .output()
        .unwrap()
}

const VERIFY: [&str; 5] = ["verify", "--key", "key.json", "--reference", "kotka.gpkg"];
const RECORD: [&str; 2] = ["--record", "record.json"];

/// The page of a run, checked to be one that needs nothing else.
fn page(folder: &Path, arguments: &[&str]) -> String {
    let output = meshmark(folder, 2, &[arguments, &["--report", "page.html"]].concat());
    let path = folder.join("page.html");
    let text =
        fs::read_to_string(&path).unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stderr)));
    fs::remove_file(path).unwrap();
    assert_self_contained(&text);
    text
}

fn assert_self_contained(text: &str) {
    let document = Html::parse_document(text);
    assert_eq!(document.errors, Vec::<String>::new());
    let all = |selector: &str| document.select(&Selector::parse(selector).unwrap()).collect::<Vec<_>>();
    assert_eq!(all("script, link, iframe, img, object, embed, base, form").len(), 0);
    assert!(!text.contains("<script"));
    for element in all("*") {
        for (name, value) in element.value().attrs() {
            assert!(!name.starts_with("on") && name != "src", "{name}={value}");
            assert!(name != "href" || value.starts_with('#'), "{name}={value}");
        }
    }
    let style: String = all("style").iter().flat_map(|style| style.text()).collect();
    assert!(!style.contains("@import"));
    assert!(style.split("url(").skip(1).all(|rest| rest.starts_with('#')));
    assert!(!text.contains("http://") && !text.contains("https://"));
    let ids: Vec<&str> = all("[id]").iter().filter_map(|element| element.value().id()).collect();
    assert!(all("use").iter().all(|link| ids.contains(&&link.value().attr("href").unwrap()[1..])));
    assert_eq!(all("h1").len(), 1);
}

/// Without the digest of the program, which is another one after every build.
fn without_program(page: &str) -> String {
    match page.split_once("(program SHA-256 ") {
        Some((before, digest)) => format!("{before}(program …{}", &digest[64..]),
        None => page.into(),
    }
}

/// Without its style, and without what may differ between machines in its last digits.
fn without_figures(page: &str) -> String {
    let (head, rest) = page.split_once("<style>").unwrap();
    let page = format!("{head}{}", rest.split_once("</style>").unwrap().1);
    let page = without_program(&page);
    let mut kept = String::new();
    for (number, part) in page.split(" d=\"").enumerate() {
        let part = if number == 0 { part } else { &part[part.find('"').unwrap()..] };
        kept += if number == 0 { "" } else { " d=\"…" };
        kept += part;
    }
    let is_figure = |text: &str| text.len() > 2 && text.trim_end_matches('.').chars().any(|c| c != '.');
    let mut words = String::new();
    let mut word = String::new();
    for c in kept.chars().chain(['\0']) {
        if c.is_ascii_digit() || c == '.' {
            word.push(c);
            continue;
        }
        words += if is_figure(&word) { "#" } else { &word };
        word.clear();
        words.push(c);
    }
    words.trim_end_matches('\0').replace('<', "\n<")
}

/// After a change that is meant, copy the new page from where the failing test says.
fn assert_golden(name: &str, page: &str) {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pages").join(name);
    let (found, expected) = (without_figures(page), fs::read_to_string(&golden).unwrap_or_default());
    if found != expected {
        let new = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        fs::write(&new, &found).unwrap();
        let lines = found.lines().zip(expected.lines());
        let first = lines.into_iter().find(|(a, b)| a != b);
        panic!("{} is not {}: {first:?}", new.display(), golden.display());
    }
}

#[test]
fn the_page_of_a_match_is_as_written() {
    let folder = folder();
    let page = page(folder.path(), &[&VERIFY[..], &RECORD, &["marked.gpkg"]].concat());
    assert!(page.contains("less than once in 4\u{a0}×\u{a0}10<sup>28</sup> tries, a number of 29 digits"));
    assert_golden("match.html", &page);
}

#[test]
fn the_page_of_a_fingerprint_is_as_written() {
    let folder = folder();
    let record = ["--record", "fingerprint/record.json", "fingerprint/marked.gpkg"];
    assert_golden("fingerprint.html", &page(folder.path(), &[&VERIFY[..], &record].concat()));
}

#[test]
fn the_page_of_a_comparison_is_as_written() {
    let folder = folder();
    assert_golden("comparison.html", &page(folder.path(), &["compare", "kotka.gpkg", "marked.gpkg"]));
}

/// What is read of a page.
fn words(page: &str) -> String {
    let document = Html::parse_document(page);
    let main = Selector::parse("main").unwrap();
    document.select(&main).flat_map(|main| main.text()).collect()
}

#[test]
fn a_page_without_a_match_claims_no_mark() {
    let folder = folder();
    fs::create_dir(folder.path().join("records")).unwrap();
    fs::copy(folder.path().join("record.json"), folder.path().join("records/record.json")).unwrap();
    for records in [RECORD, ["--records", "records"]] {
        let text = words(&page(folder.path(), &[&VERIFY[..], &records, &["kotka.gpkg"]].concat()));
        let copy =
            if records == RECORD { "copy made for “ACME GmbH”" } else { "one copy that was tried" };
        assert!(text.contains(&format!("does not carry the mark of the {copy}")), "{text}");
        assert_eq!(text.contains("ACME GmbH"), records == RECORD);
        assert!(text.contains("A mark would be in 7 patches"));
        assert_eq!(text.contains("none of which matches"), records[0] == "--records");
        assert_eq!(text.contains("keyed hash"), records[0] == "--record");
        assert!(
            !text.contains("The mark is in")
                && !text.contains("is the mark,")
                && !text.contains("made this mark")
        );
        let text = words(&page(folder.path(), &[&VERIFY[..], &records, &["helsinki.gpkg"]].concat()));
        assert!(
            text.contains("Too few of its vertices were found") && !text.contains("The suspect was brought"),
            "{text}"
        );
        assert!(!text.contains("The probability is") && !text.contains("made this mark"));
    }
}

#[test]
fn a_message_that_is_not_known_is_no_contradiction_to_a_key_that_shows() {
    let folder = folder();
    let text = words(&page(folder.path(), &[&VERIFY[..], &["--code", "REPETITION", "marked.gpkg"]].concat()));
    assert!(text.contains("was not compared with any copy: no expected message was given"), "{text}");
    assert!(text.contains("Some mark of this key is in the map, whatever its message."));
}

#[test]
fn equal_input_makes_equal_reports_whatever_the_number_of_threads() {
    let folder = folder();
    let verify = [&VERIFY[..], &RECORD, &["marked.gpkg"]].concat();
    for arguments in [&verify[..], &["compare", "kotka.gpkg", "marked.gpkg"]] {
        for format in ["html", "json"] {
            let report = |threads: usize| {
                let name = format!("{}-{threads}.{format}", arguments[0]);
                meshmark(folder.path(), threads, &[arguments, &["--report", &name]].concat());
                fs::read(folder.path().join(name)).unwrap()
            };
            assert!(report(1) == report(2), "{} {format}", arguments[0]);
        }
    }
}

#[test]
fn what_files_say_is_no_markup() {
    let folder = folder();
    let hostile = "\"'><script>alert(1)</script>&amp;";
    let map = folder.path().join("kotka.gpkg");
    let open_flags = GdalOpenFlags::GDAL_OF_UPDATE | GdalOpenFlags::GDAL_OF_VECTOR;
    let dataset = Dataset::open_ex(&map, DatasetOptions { open_flags, ..Default::default() }).unwrap();
    let sql = "ALTER TABLE buildings RENAME TO \"<script>alert(2)</script>\"";
    dataset.execute_sql(sql, None, Dialect::DEFAULT).unwrap();
    dataset.close().unwrap();
    let suspect = format!("{}.gpkg", hostile.replace('/', "∕"));
    fs::copy(&map, folder.path().join(&suspect)).unwrap();
    let mark = ["--recipient", hostile, "--layers", "<script>alert(2)</script>", suspect.as_str()];
    let page = page(folder.path(), &[&VERIFY[..], &mark].concat());
    for text in
        ["&gt;&lt;script&gt;alert(1)&lt;/script&gt;&amp;amp;", "&lt;script&gt;alert(2)&lt;/script&gt;"]
    {
        assert!(page.contains(text), "{text}");
    }
}

#[test]
fn odd_suspects_make_pages_too() {
    let folder = folder();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    let points: String =
        (0..500).map(|i| format!("{i},POINT ({} {})\n", 496_000 + 7 * i, 6_703_000 + i * i)).collect();
    write("points.csv", &format!("id,WKT\n{points}"));
    write("empty.svg", "<svg/>");
    fs::copy(folder.path().join("marked.gpkg"), folder.path().join("Übergabe, 2. Fassung.gpkg")).unwrap();
    for (suspect, word) in [
        ("points.csv", "Inconclusive"),
        ("empty.svg", "Inconclusive"),
        ("Übergabe, 2. Fassung.gpkg", "Match"),
    ] {
        let page = page(folder.path(), &[&VERIFY[..], &RECORD, &[suspect]].concat());
        assert!(
            page.contains(&format!("<p class=\"answer\">{word}</p>")) && page.contains(suspect),
            "{suspect}"
        );
    }
}

#[test]
fn a_page_on_boxes_says_what_the_finding_rests_on() {
    let folder = folder();
    let marked = Dataset::open(folder.path().join("marked.gpkg")).unwrap();
    let mut table = String::from("id;WKT\n");
    for (number, mut layer) in marked.layers().enumerate() {
        for feature in layer.features() {
            let geometry = feature.geometry().unwrap();
            if geometry.geometry_type() % 1000 == 3 {
                let e = geometry.envelope();
                let corners = [(e.MinX, e.MinY), (e.MaxX, e.MinY), (e.MaxX, e.MaxY), (e.MinX, e.MaxY)];
                let ring = [&corners[..], &corners[..1]].concat();
                let ring: Vec<String> = ring.iter().map(|(x, y)| format!("{x} {y}")).collect();
                table += &format!("{number};POLYGON (({}))\n", ring.join(", "));
            }
        }
    }
    fs::write(folder.path().join("boxes.csv"), table).unwrap();
    let text = words(&page(folder.path(), &[&VERIFY[..], &RECORD, &["boxes.csv"]].concat()));
    assert!(text.contains("the finding rests on one centroid or one box for each polygon"), "{text}");
    assert!(text.contains("Observed onboxes") && !text.contains("a small part of the map"), "{text}");
}

#[test]
fn many_records_are_listed_and_the_one_that_matches_is_named() {
    let folder = folder();
    fs::create_dir(folder.path().join("records")).unwrap();
    fs::copy(folder.path().join("record.json"), folder.path().join("records/acme.json")).unwrap();
    fs::write(folder.path().join("records/none.json"), "[]").unwrap();
    let page = page(folder.path(), &[&VERIFY[..], &["--records", "records", "marked.gpkg"]].concat());
    assert!(page.contains("Copies that were tried") && page.contains("were left out: 1."));
    assert!(page.contains("the copy made for “<span class=\"name\">ACME GmbH</span>”"));
}

#[test]
fn a_report_that_cannot_be_written_is_one_sentence_and_leaves_nothing() {
    let folder = folder();
    let verify = [&VERIFY[..], &RECORD, &["marked.gpkg", "--report", "/dev/full/report.html"]].concat();
    let output = meshmark(folder.path(), 2, &verify);
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.lines().count() == 1 && text.contains("/dev/full is no folder"), "{text}");
}

/// docs/verifier.md says what the code says.
#[test]
fn the_exit_codes_of_the_documents_are_those_of_the_code() {
    let text = fs::read_to_string(root().join("docs/verifier.md")).unwrap();
    for code in ExitCode::ALL {
        let row = format!("| {} | {} |", code as u8, code.meaning());
        assert!(text.contains(&row), "docs/verifier.md lacks {row}");
    }
    let rows = text.lines().filter(|line| line.starts_with("| ") && line.as_bytes()[2].is_ascii_digit());
    assert_eq!(rows.count(), ExitCode::ALL.len());
}

/// The examples of docs/verifier.md end with the exit code that the text after them names.
#[test]
fn the_examples_of_the_documents_run() {
    let folder = folder();
    let vectors = folder.path().join("vectors");
    fs::create_dir(&vectors).unwrap();
    for file in ["key.json", "record.json", "marked.gpkg"] {
        fs::copy(folder.path().join(file), vectors.join(file)).unwrap();
    }
    let text = fs::read_to_string(root().join("docs/verifier.md")).unwrap();
    let examples = text.split("## Examples").nth(1).unwrap().split("```sh\nmeshmark ").skip(1);
    let mut count = 0;
    for example in examples {
        let (command, after) = example.split_once("\n```").unwrap();
        let code = after.split_once('(').unwrap().1.chars().next().unwrap().to_digit(10).unwrap();
        let arguments: Vec<&str> = command.split_whitespace().collect();
        let status = meshmark(folder.path(), 2, &arguments).status;
        assert_eq!(status.code(), Some(code as i32), "{command}");
        assert!(folder.path().join(arguments.last().unwrap()).is_file(), "{command}");
        count += 1;
    }
    assert_eq!(count, 4);
}
