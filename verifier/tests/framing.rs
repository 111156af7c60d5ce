//! No output of the command gives away what forges the mark of another recipient.
//!
//! Marks that carry messages have the same chips in all copies. Displacements of one copy, its
//! message and that of another recipient, together with the unmarked map, therefore make the mark of
//! the other one without the key. The attacker of these tests takes all of it from the outputs of
//! `meshmark verify` and `meshmark compare`.

mod common;

use common::{fixture, key};
use gdal::{Dataset, vector::LayerAccess};
use meshmark_core::{
    deformation::Prediction, estimation::Estimates, ground::Ground, map_data::MapData, message::Message,
    modulation::displacements_m, options::Parameters, patches::Patches, signs::Signs,
};
use meshmark_dataset::{LabelFields, Selection, survey};
use scraper::{Html, Selector};
use serde_json::Value;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::LazyLock,
};
use tempfile::TempDir;

/// The recipient whose copy leaked, and the one who is to be framed; both have a record.
const GUILTY: &str = "ACME GmbH";
const INNOCENT: &str = "Innocent Ltd";
/// Length of the code words of 128 bits, one coefficient for each of their bits.
const COEFFICIENTS: usize = 256;
/// Longer side of the map on a page, page units.
const PAGE_SIDE: f64 = 4000.0;

/// Copies with messages, and the records of all recipients.
struct Copies {
    folder: TempDir,
    reference: MapData,
    ground: Ground,
}

static COPIES: LazyLock<Copies> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("list.csv");
    fs::write(&list, format!("recipient\n{GUILTY}\n{INNOCENT}\nThird SARL\n")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_meshmark"));
    command.args(["distribute", "--code", "ldpc", "--key"]).arg(key()).arg("--recipients").arg(list);
    command.arg("--output-dir").arg(folder.path().join("copies")).arg(fixture("kotka.gpkg"));
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (reference, ground) = read(&fixture("kotka.gpkg"));
    Copies { folder, reference, ground }
});

fn read(map: &Path) -> (MapData, Ground) {
    let selection = Selection { labels: LabelFields::All, ..Selection::default() };
    let map = survey(&Dataset::open(map).unwrap(), &selection).unwrap();
    let ground = map.measure().unwrap().clone();
    (map.data, ground)
}

impl Copies {
    /// Returns the copy or the record of a recipient.
    fn file(&self, recipient: &str, ending: &str) -> PathBuf {
        let start = recipient.to_lowercase().replace(' ', "-");
        let files = fs::read_dir(self.folder.path().join("copies")).unwrap().map(|e| e.unwrap().path());
        let is_wanted = |path: &PathBuf| {
            let name = path.file_name().unwrap().to_str().unwrap();
            name.starts_with(&start) && name.ends_with(ending)
        };
        files.into_iter().find(is_wanted).unwrap()
    }

    /// Returns the message in the record of a recipient.
    fn message(&self, recipient: &str) -> Message {
        let record: Value =
            serde_json::from_slice(&fs::read(self.file(recipient, ".json")).unwrap()).unwrap();
        Message::from_hex(record["message"].as_str().unwrap()).unwrap()
    }
}

fn verify(suspect: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_meshmark"));
    command.arg("verify").arg("--key").arg(key()).arg("--reference").arg(fixture("kotka.gpkg"));
    command.args(arguments).arg(suspect).output().unwrap()
}

/// Numbers of vertices of the reference, and the directions in which they are displaced, in any unit.
type Displaced = Vec<(usize, [f64; 2])>;

/// What the attacker has found.
#[derive(Default)]
struct Loot {
    /// By where they were found.
    displaced: BTreeMap<&'static str, Displaced>,
    messages: BTreeSet<String>,
}

impl Loot {
    /// Collects what the outputs about a suspect hold.
    fn of_verifications(runs: &[&[&str]]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let suspect = COPIES.file(GUILTY, ".gpkg");
        let [json, page, map] =
            ["report.json", "report.html", "map.gpkg"].map(|name| folder.path().join(name));
        let mut loot = Loot::default();
        for run in runs {
            let [json, page, map] = [&json, &page, &map].map(|path| path.to_str().unwrap());
            let with = |more: &[&str]| verify(&suspect, &[*run, more].concat());
            let printed = [
                with(&["--report", json, "--evidence-map", map, "--json"]),
                with(&["--report", page, "--explain"]),
            ];
            printed.iter().for_each(|output| loot.search_text(&String::from_utf8_lossy(&output.stdout)));
            loot.search_reports(["report", "page"], Path::new(json), Path::new(page));
            loot.search_map(Path::new(map));
            [json, page, map].iter().for_each(|path| fs::remove_file(path).unwrap());
        }
        loot
    }

    /// Adds what the reports of a comparison of the leaked copy hold.
    fn and_comparison(mut self, more: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let [json, page] = ["compared.json", "compared.html"].map(|name| folder.path().join(name));
        for report in [&json, &page] {
            let mut command = Command::new(env!("CARGO_BIN_EXE_meshmark"));
            command.arg("compare").args(more).arg("--report").arg(report);
            let output =
                command.arg(fixture("kotka.gpkg")).arg(COPIES.file(GUILTY, ".gpkg")).output().unwrap();
            assert!(output.status.success(), "{output:?}");
        }
        self.search_reports(["comparison", "page of the comparison"], &json, &page);
        self
    }

    fn search_reports(&mut self, names: [&'static str; 2], json: &Path, page: &Path) {
        let (json, page) = (fs::read_to_string(json).unwrap(), fs::read_to_string(page).unwrap());
        [&json, &page].into_iter().for_each(|text| self.search_text(text));
        self.search_numbers(names[0], &serde_json::from_str(&json).unwrap());
        self.search_page(names[1], &Html::parse_document(&page));
    }

    fn add(&mut self, source: &'static str, found: Option<(usize, [f64; 2])>) {
        let found = found.filter(|(_, way)| *way != [0.0; 2]);
        found.into_iter().for_each(|found| self.displaced.entry(source).or_default().push(found));
    }

    /// Takes every word that may be a message.
    fn search_text(&mut self, text: &str) {
        let words = text.split(|c: char| !c.is_ascii_hexdigit());
        self.messages.extend(words.filter(|word| word.len() == 32).map(String::from));
    }

    /// Takes every place of the reference with a displacement, and every place near one.
    fn search_numbers(&mut self, source: &'static str, value: &Value) {
        let numbers: Vec<f64> = value.as_array().into_iter().flatten().filter_map(Value::as_f64).collect();
        match numbers[..] {
            [x, y, dx, dy] => self.add(source, vertex([x, y]).map(|vertex| (vertex, [dx, dy]))),
            [x, y] => self.add(source, near([x, y])),
            _ => {}
        }
        let pairs = |name: &str| {
            let pairs = value.get(name).and_then(Value::as_array).into_iter().flatten();
            pairs.filter_map(|pair| Some([pair[0].as_f64()?, pair[1].as_f64()?]))
        };
        for (at, way) in pairs("matched").zip(pairs("displacements_m")) {
            self.add(source, vertex(at).map(|vertex| (vertex, way)));
        }
        let inner = value.as_array().into_iter().flatten();
        inner
            .chain(value.as_object().into_iter().flat_map(|o| o.values()))
            .for_each(|v| self.search_numbers(source, v));
    }

    /// Takes the arrows of a page, and the bits that are shown as wrong.
    fn search_page(&mut self, source: &'static str, page: &Html) {
        let all = |selector: &str| page.select(&Selector::parse(selector).unwrap()).collect::<Vec<_>>();
        for arrows in all("svg.map path.arrows") {
            let Some(path) = arrows.value().attr("d").filter(|d| d.len() > 200) else { continue };
            for arrow in path.split('M').skip(1) {
                let numbers: Vec<f64> = arrow
                    .replace('l', " ")
                    .split_whitespace()
                    .map_while(|number| number.parse().ok())
                    .collect();
                let [x, y, dx, dy, ..] = numbers[..] else { continue };
                self.add(source, on_page([x, y]).map(|vertex| (vertex, [dx, -dy])));
            }
        }
        let bit = |cell: &scraper::ElementRef| {
            let is_one = cell.text().collect::<String>() == "1";
            is_one != cell.value().classes().any(|class| class == "wrong")
        };
        let bits: Vec<bool> = all("table.bits td").iter().map(bit).collect();
        let digit = |bits: &[bool]| format!("{:x}", bits.iter().fold(0, |d, bit| 2 * d + u8::from(*bit)));
        self.messages.extend((!bits.is_empty()).then(|| bits.chunks(4).map(digit).collect::<String>()));
    }

    /// Takes every line of an evidence map, and every point near a vertex.
    fn search_map(&mut self, map: &Path) {
        for mut layer in Dataset::open(map).unwrap().layers() {
            for feature in layer.features() {
                let mut points = Vec::new();
                feature.geometry().unwrap().get_points(&mut points);
                match points[..] {
                    [(x, y, _), (to_x, to_y, _)] => {
                        let way = [to_x - x, to_y - y];
                        self.add("map", vertex([x, y]).map(|vertex| (vertex, way)));
                    }
                    [(x, y, _)] => self.add("map", near([x, y])),
                    _ => {}
                }
            }
        }
    }
}

fn coords() -> &'static [[f64; 2]] {
    COPIES.reference.vertices.coords()
}

fn vertex(at: [f64; 2]) -> Option<usize> {
    COPIES.reference.vertices.index_of(at)
}

/// Returns the vertex within a metre of a place, and the way to it.
fn near([x, y]: [f64; 2]) -> Option<(usize, [f64; 2])> {
    let way = |vertex: usize| [x - coords()[vertex][0], y - coords()[vertex][1]];
    let length = |vertex: &usize| way(*vertex)[0].hypot(way(*vertex)[1]);
    let nearest = (0..coords().len()).min_by(|a, b| length(a).total_cmp(&length(b)))?;
    (length(&nearest) < 1.0).then(|| (nearest, way(nearest)))
}

/// Returns the vertex that a page shows nearest to a point.
fn on_page([x, y]: [f64; 2]) -> Option<usize> {
    let (lower, upper) = COPIES.reference.vertices.bounds();
    let unit = PAGE_SIDE / (upper[0] - lower[0]).max(upper[1] - lower[1]);
    let at = [lower[0] + x / unit, upper[1] - y / unit];
    let length = |vertex: &usize| (coords()[*vertex][0] - at[0]).hypot(coords()[*vertex][1] - at[1]);
    (0..coords().len()).min_by(|a, b| length(a).total_cmp(&length(b)))
}

/// Signs that are given.
struct Made(Vec<f64>);

impl Signs for Made {
    fn signs(&self, patch: usize, axis: usize, count: usize) -> Vec<f64> {
        self.0[(2 * patch + axis) * count..][..count].to_vec()
    }
}

/// Turns the displacements of a copy with one message into those of a copy with another one, and
/// writes the map with them: all its segments.
fn forge(displaced: &Displaced, [from, to]: [&Message; 2], file: &Path) {
    let (data, parameters) = (&COPIES.reference, Parameters::default());
    let map = data.on(&COPIES.ground, &COPIES.ground);
    let patches = Patches::new(&map, &parameters).unwrap();
    let mut observed = vec![None; coords().len()];
    let rms =
        (displaced.iter().map(|(_, [x, y])| x * x + y * y).sum::<f64>() / displaced.len() as f64).sqrt();
    for (vertex, [dx, dy]) in displaced {
        observed[*vertex] = Some([0.1 * dx / rms, 0.1 * dy / rms]);
    }
    let noise = Prediction::of_noise(0.02, observed.len());
    let seen = Estimates::new(&patches, &observed, COEFFICIENTS, &parameters, &noise, &|_| ()).unwrap();
    let turns = [from, to].map(|message| parameters.code.encode(message));
    let turned =
        |(i, sign): (usize, &f64)| sign.signum() * turns[0][i % COEFFICIENTS] * turns[1][i % COEFFICIENTS];
    let signs = Made(seen.values.iter().enumerate().map(turned).collect());
    let moved = displacements_m(&patches, &[signs], COEFFICIENTS, &parameters).unwrap();
    let place = |vertex: u32| {
        let (at, by) = (coords()[vertex as usize], moved[0][vertex as usize]);
        format!("{} {}", at[0] + by[0], at[1] + by[1])
    };
    let line = |(id, [a, b]): (usize, &[u32; 2])| format!("{id};LINESTRING ({}, {})\n", place(*a), place(*b));
    let lines: String = data.segments.iter().enumerate().map(line).collect();
    fs::write(file, format!("id;WKT\n{lines}")).unwrap();
}

/// Returns whether a map made of displacements of the leaked copy is taken for the copy of the
/// innocent, whose message is one of these.
fn frames_the_innocent(displaced: &Displaced, messages: &BTreeSet<String>) -> bool {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("forged.csv");
    let record = COPIES.file(INNOCENT, ".json");
    let guilty = COPIES.message(GUILTY);
    messages.iter().any(|message| {
        forge(displaced, [&guilty, &Message::from_hex(message).unwrap()], &file);
        let output = verify(&file, &["--record", record.to_str().unwrap()]);
        assert!([0, 1, 3].contains(&output.status.code().unwrap()), "{output:?}");
        output.status.success()
    })
}

/// Displacements of all vertices of the leaked copy, as its recipient has them.
fn own_copy() -> Displaced {
    let (copy, _) = read(&COPIES.file(GUILTY, ".gpkg"));
    copy.vertices.coords().iter().filter_map(|at| near(*at)).collect()
}

/// Runs that mention the innocent: as one of several candidates, and as the only one.
fn runs() -> [Vec<String>; 2] {
    let records = COPIES.folder.path().join("copies").display().to_string();
    let record = COPIES.file(INNOCENT, ".json").display().to_string();
    [vec!["--records".into(), records], vec!["--record".into(), record]]
}

fn loot(more: &[&str]) -> Loot {
    let runs = runs();
    let runs: Vec<Vec<&str>> =
        runs.iter().map(|run| run.iter().map(String::as_str).chain(more.iter().copied()).collect()).collect();
    Loot::of_verifications(&runs.iter().map(Vec::as_slice).collect::<Vec<_>>())
}

#[test]
fn no_output_holds_what_forges_the_copy_of_another_recipient() {
    let loot = loot(&[]);
    // The recipient of the leaked copy has its displacements, and lacks the other message.
    let innocent = COPIES.message(INNOCENT).to_hex();
    assert!(!loot.messages.contains(&innocent), "the message of a candidate is in an output");
    assert!(!frames_the_innocent(&own_copy(), &loot.messages));
    // Somebody who has the other message lacks the displacements.
    let known = BTreeSet::from([innocent]);
    for (source, displaced) in loot.and_comparison(&[]).displaced {
        assert!(!frames_the_innocent(&displaced, &known), "{source}: {}", displaced.len());
    }
}

#[test]
fn places_of_vertices_outside_a_small_radius_are_no_displacements() {
    let record = COPIES.file(INNOCENT, ".json").display().to_string();
    let loot = Loot::of_verifications(&[&["--record", &record, "--radius", "0.02"]]);
    let known = BTreeSet::from([COPIES.message(INNOCENT).to_hex()]);
    for (source, displaced) in loot.displaced {
        assert!(!frames_the_innocent(&displaced, &known), "{source}: {}", displaced.len());
    }
}

#[test]
fn report_files_do_not_name_those_whose_records_do_not_match() {
    let folder = tempfile::tempdir().unwrap();
    let records = COPIES.folder.path().join("copies");
    let suspect = COPIES.file(GUILTY, ".gpkg");
    for name in ["report.json", "report.html"] {
        let report = folder.path().join(name);
        let more = ["--records", records.to_str().unwrap(), "--report", report.to_str().unwrap()];
        assert!(verify(&suspect, &more).status.success());
        let text = fs::read_to_string(&report).unwrap();
        assert!(text.contains(GUILTY) && !text.contains(INNOCENT), "{name}");
    }
    let report: Value =
        serde_json::from_slice(&fs::read(folder.path().join("report.json")).unwrap()).unwrap();
    let candidates = &report["candidates"];
    assert_eq!((&candidates["tried"], candidates["list"].as_array().unwrap().len()), (&3.into(), 1));
    assert!(candidates["next_p_value_log10"].as_f64().unwrap() > -3.0);
}

#[test]
fn displacements_and_messages_together_would_forge_it() {
    let innocent = BTreeSet::from([COPIES.message(INNOCENT).to_hex()]);
    assert!(frames_the_innocent(&own_copy(), &innocent));
    let exact = ["--exact-displacements"];
    let found = loot(&exact).and_comparison(&exact).displaced;
    let sources: Vec<&str> = found.keys().copied().collect();
    assert_eq!(sources, ["comparison", "map", "page", "page of the comparison", "report"]);
    for (source, displaced) in found {
        assert!(frames_the_innocent(&displaced, &innocent), "{source}: {}", displaced.len());
    }
}
