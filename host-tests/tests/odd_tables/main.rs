//! Odd tables on all three paths of a mark into a file, compared with plain `ogr2ogr`: whatever the
//! names of layers and fields and whatever the values, only coordinates differ, by less than
//! TOLERANCE. Tables that plain `ogr2ogr` refuses are refused; all others are refused by a sentence
//! of [`DOCUMENTED`] only.

mod compare;
mod sources;

use meshmark_host_tests::plugin::{Host, Run};
use rand_chacha::{ChaCha20Rng, rand_core::SeedableRng};
use sources::Source;
use std::{
    fs,
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
    },
    thread,
};

/// The formats of outputs, and the endings of their file names.
const FORMATS: [(&str, &str); 5] = [
    ("GPKG", "gpkg"),
    ("ESRI Shapefile", "shp"),
    ("FlatGeobuf", "fgb"),
    ("GeoJSON", "geojson"),
    ("GeoJSONSeq", "geojsonl"),
];

/// Number of tables; each goes into one format on all paths.
const TABLES: u64 = 120;

/// Refusals of tables that plain `ogr2ogr` writes: a part of the sentence, which docs/driver.md or
/// docs/distribute.md has, and the reason.
const DOCUMENTED: &[(&str, &str)] = &[(
    "FlatGeobuf with a spatial index leaves out features without a geometry",
    "plain ogr2ogr drops them without a word; a map that is marked as a whole is not to lose any",
)];

/// The paths of a mark into a file.
const WAYS: [&str; 3] = ["read", "write", "distribute"];

#[test]
fn every_way_writes_what_plain_ogr2ogr_does_but_for_the_coordinates() {
    let (next, found) = (AtomicU64::new(0), Mutex::new(Vec::new()));
    let work = || {
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= TABLES {
                break;
            }
            let differences = differences(seed);
            found.lock().unwrap().extend(differences);
        }
    };
    thread::scope(|scope| drop([(); 2].map(|()| scope.spawn(work))));
    let mut found = found.into_inner().unwrap();
    found.sort();
    assert!(found.is_empty(), "{} differences:\n{}", found.len(), found.join("\n"));
}

/// Returns the differences for the table of this seed on any path.
fn differences(seed: u64) -> Vec<String> {
    let host = Host::new();
    let mut random = ChaCha20Rng::seed_from_u64(seed);
    let source = Source::make(&host, &mut random, seed);
    let (format, ending) = FORMATS[(seed / 3) as usize % FORMATS.len()];
    let plain_name = format!("out.{ending}");
    let folder = |way: &str| fs::create_dir(host.path(way)).unwrap();
    folder("plain");
    let to = |way: &str| format!("{way}/{plain_name}");
    let plain = host.run("ogr2ogr", &["-f", format, &to("plain"), &source.path]);
    let mut found = Vec::new();
    for way in WAYS {
        folder(way);
        let (run, file) = mark(&host, way, format, &to(way), &source.path);
        let mut say = |what: String| {
            found.push(format!("table {seed:3}, {way}, {format}: {what}\n    of {}", source.what))
        };
        let reason = |run: &Run| run.errors().first().map_or(run.stderr.clone(), |error| error.to_string());
        match (plain.code, run.code) {
            (Some(0), Some(0)) => {
                let file = file.expect("a way that succeeds writes a file");
                compare::files(&host, format, &to("plain"), &file).into_iter().for_each(&mut say);
            }
            (Some(0), _) if DOCUMENTED.iter().any(|(sentence, _)| run.stderr.contains(sentence)) => {}
            (Some(0), _) => say(format!("refused: {}", reason(&run))),
            (_, Some(0)) => {
                say(format!("plain ogr2ogr refuses it: {}", plain.stderr.lines().next().unwrap_or_default()))
            }
            _ => {}
        }
    }
    found
}

/// Marks the source on one of the paths, and returns the file.
fn mark(host: &Host, way: &str, format: &str, file: &str, source: &str) -> (Run, Option<String>) {
    let options = ["KEY=key.json", "RECIPIENT=A", "PATCH_SIZE=260"];
    let marked = format!("MESHMARK:{source}");
    let target = format!("MESHMARK:{file}");
    let options = |flag: &'static str| options.iter().flat_map(move |option| [flag, option]);
    let run = match way {
        "read" => {
            let line: Vec<&str> = ["-f", format, file, &marked].into_iter().chain(options("-oo")).collect();
            host.run("ogr2ogr", &line)
        }
        "write" => {
            let fixed = ["-f", "MESHMARK", &target, source, "-dsco", "REFERENCE=write/ref.gpkg"];
            host.run("ogr2ogr", &fixed.into_iter().chain(options("-dsco")).collect::<Vec<_>>())
        }
        _ => {
            fs::write(host.path("list.csv"), "recipient\nA\n").unwrap();
            let line = [
                "distribute",
                "--key",
                "key.json",
                "--recipients",
                "list.csv",
                "--patch-size",
                "260",
                "--output-dir",
                way,
                "-f",
                format,
                source,
            ];
            host.run(host.meshmark().to_str().unwrap(), &line)
        }
    };
    let ending = file.rsplit_once('.').unwrap().1;
    let is_it = |name: &String| name.ends_with(&format!(".{ending}"));
    let entries = fs::read_dir(host.path(way)).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let name = names.filter(|name| name != "ref.gpkg").find(is_it);
    (run, name.map(|name| format!("{way}/{name}")))
}
