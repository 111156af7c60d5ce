//! The files of a suspect are evidence: the examination leaves them as they were, whatever GDAL and
//! SQLite write while they read.

mod common;

use common::{assert_answer, fixture, verify};
use std::{
    collections::BTreeMap,
    fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};
use tempfile::TempDir;

/// All files of a folder with their content.
fn content(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => files.extend(content(&path)),
            false => drop(files.insert(path.clone(), fs::read(&path).unwrap())),
        }
    }
    files
}

/// Asserts a match that leaves the folder of the suspect as it was.
fn assert_untouched(folder: &TempDir, suspect: &str) {
    let before = content(folder.path());
    assert_answer(&folder.path().join(suspect), 0, "MATCH");
    assert!(content(folder.path()) == before, "{suspect}: the evidence was changed");
}

fn converted(folder: &TempDir, name: &str, more: &[&str]) {
    let run = Command::new("ogr2ogr")
        .args(more)
        .arg(folder.path().join(name))
        .arg(fixture("vectors/marked.gpkg"))
        .arg("buildings")
        .status();
    assert!(run.unwrap().success());
}

/// A GeoPackage with the unmarked map in its main file, and the marked one in its log.
fn with_log(folder: &TempDir) {
    let made = folder.path().join("made.gpkg");
    fs::copy(fixture("kotka.gpkg"), &made).unwrap();
    let database = rusqlite::Connection::open(&made).unwrap();
    let mut triggers = database.prepare("SELECT name FROM sqlite_master WHERE type = 'trigger'").unwrap();
    let names: Vec<String> =
        triggers.query_map((), |row| row.get(0)).unwrap().collect::<Result<_, _>>().unwrap();
    drop(triggers);
    for name in names {
        database.execute_batch(&format!("DROP TRIGGER \"{name}\"")).unwrap();
    }
    database
        .execute_batch(
            "PRAGMA journal_mode = wal; PRAGMA wal_checkpoint(truncate); PRAGMA wal_autocheckpoint = 0",
        )
        .unwrap();
    database.execute("ATTACH ? AS marked", [fixture("vectors/marked.gpkg").to_str().unwrap()]).unwrap();
    for table in ["buildings", "landuse", "roads"] {
        let marked = format!("SELECT geom FROM marked.{table} m WHERE m.fid = {table}.fid");
        database.execute_batch(&format!("UPDATE {table} SET geom = ({marked})")).unwrap();
    }
    for ending in ["", "-wal"] {
        let copied = folder.path().join(format!("suspect.gpkg{ending}"));
        fs::copy(folder.path().join(format!("made.gpkg{ending}")), copied).unwrap();
    }
    drop(database);
    content(folder.path()).keys().filter(|path| !path.to_str().unwrap().contains("suspect")).for_each(
        |path| {
            fs::remove_file(path).unwrap();
        },
    );
}

#[test]
fn a_log_beside_a_database_is_read_digested_and_left_as_it_was() {
    let folder = TempDir::new().unwrap();
    with_log(&folder);
    assert_untouched(&folder, "suspect.gpkg");
    fs::remove_file(folder.path().join("suspect.gpkg-wal")).unwrap();
    assert_answer(&folder.path().join("suspect.gpkg"), 1, "NO MATCH");
}

#[test]
fn a_link_to_a_database_with_a_log_is_read_with_that_log() {
    let folder = TempDir::new().unwrap();
    with_log(&folder);
    let elsewhere = TempDir::new().unwrap();
    let link = elsewhere.path().join("link.gpkg");
    std::os::unix::fs::symlink(folder.path().join("suspect.gpkg"), &link).unwrap();
    let before = content(folder.path());
    assert_answer(&link, 0, "MATCH");
    assert!(content(folder.path()) == before);
}

/// The marked map, with the first half of an unfinished transaction that removes it.
fn with_journal(folder: &TempDir) -> PathBuf {
    let made = TempDir::new().unwrap();
    let path = made.path().join("suspect.gpkg");
    fs::copy(fixture("vectors/marked.gpkg"), &path).unwrap();
    let database = rusqlite::Connection::open(&path).unwrap();
    let unfinished =
        "PRAGMA cache_size = 5; BEGIN; DELETE FROM buildings; DELETE FROM landuse; DELETE FROM roads";
    database.execute_batch(unfinished).unwrap();
    for ending in ["", "-journal"] {
        let name = format!("suspect.gpkg{ending}");
        fs::copy(made.path().join(&name), folder.path().join(&name)).unwrap();
    }
    let suspect = folder.path().join("suspect.gpkg");
    assert_ne!(fs::read(&suspect).unwrap(), fs::read(fixture("vectors/marked.gpkg")).unwrap());
    suspect
}

#[test]
fn an_unfinished_transaction_is_rolled_back_in_the_copy_alone() {
    let folder = TempDir::new().unwrap();
    with_journal(&folder);
    assert_untouched(&folder, "suspect.gpkg");
}

/// As SQLite writes it: page 1 + the page of the lock, name, length, sum of the bytes, magic number.
#[test]
fn a_journal_that_names_another_file_deletes_nothing() {
    let folder = TempDir::new().unwrap();
    let suspect = with_journal(&folder);
    let victim = common::write(&folder, "victim", "what a super-journal holds\0");
    let name = victim.to_str().unwrap().as_bytes();
    let sum = name.iter().map(|&byte| u32::from(byte)).sum::<u32>();
    let journal = folder.path().join("suspect.gpkg-journal");
    let mut bytes = fs::read(&journal).unwrap();
    bytes.extend((0x4000_0000_u32 / 4096 + 1).to_be_bytes());
    bytes.extend(name);
    bytes.extend([name.len() as u32, sum].map(u32::to_be_bytes).concat());
    bytes.extend([0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7]);
    fs::write(&journal, bytes).unwrap();
    let before = content(folder.path());
    assert_answer(&suspect, 5, "names another file");
    assert!(content(folder.path()) == before);
    let copy = TempDir::new().unwrap();
    for name in ["suspect.gpkg", "suspect.gpkg-journal"] {
        fs::copy(folder.path().join(name), copy.path().join(name)).unwrap();
    }
    let rolled_back = rusqlite::Connection::open(copy.path().join("suspect.gpkg")).unwrap();
    rolled_back.query_row("SELECT count(*) FROM sqlite_master", (), |_| Ok(())).unwrap();
    assert!(!victim.exists(), "SQLite itself would have deleted it");
}

#[test]
fn a_reference_with_a_log_is_read_with_it_and_left_as_it_was() {
    let folder = TempDir::new().unwrap();
    with_log(&folder);
    let reference = folder.path().join("suspect.gpkg");
    let before = content(folder.path());
    let compared = Command::new(env!("CARGO_BIN_EXE_meshmark"))
        .arg("compare")
        .args([&reference, &fixture("vectors/marked.gpkg")])
        .output();
    let (code, text) = common::ended(compared.unwrap());
    assert!(code == Some(0) && text.contains("all up to 0.000 m"), "{code:?} {text}");
    let verified =
        common::command(&fixture("vectors/marked.gpkg")).arg("--reference").arg(&reference).output();
    let (code, text) = common::ended(verified.unwrap());
    assert_eq!(code, Some(0), "{text}");
    assert!(content(folder.path()) == before);
}

#[test]
fn the_metadata_of_a_shapefile_belong_to_it() {
    let folder = TempDir::new().unwrap();
    converted(&folder, "suspect.shp", &[]);
    let digest = || {
        let output = common::command(&folder.path().join("suspect.shp")).arg("--explain").output();
        let (_, text) = common::ended(output.unwrap());
        text.lines().find(|line| line.contains("File of the suspect")).unwrap().to_string()
    };
    let without = digest();
    common::write(&folder, "suspect.shp.xml", "<metadata/>");
    assert_ne!(digest(), without);
}

#[test]
fn a_shapefile_without_its_index_is_read_and_gets_none() {
    let folder = TempDir::new().unwrap();
    converted(&folder, "suspect.shp", &[]);
    fs::remove_file(folder.path().join("suspect.shx")).unwrap();
    assert_untouched(&folder, "suspect.shp");
}

/// In the index the second record is the first one again: what GDAL reads follows the index.
#[test]
fn the_index_of_a_shapefile_is_read_and_not_made_anew() {
    let folder = TempDir::new().unwrap();
    converted(&folder, "suspect.shp", &[]);
    let index = folder.path().join("suspect.shx");
    let mut bytes = fs::read(&index).unwrap();
    let first: Vec<u8> = bytes[100..108].into();
    bytes[100..].chunks_mut(8).for_each(|record| record.copy_from_slice(&first));
    fs::write(&index, bytes).unwrap();
    let before = content(folder.path());
    assert_answer(&folder.path().join("suspect.shp"), 3, "INCONCLUSIVE");
    assert!(content(folder.path()) == before);
}

#[test]
fn a_zipped_shapefile_and_a_folder_without_an_index_are_read() {
    let folder = TempDir::new().unwrap();
    converted(&folder, "suspect.shp.zip", &["-f", "ESRI Shapefile"]);
    assert_untouched(&folder, "suspect.shp.zip");
    let folder = TempDir::new().unwrap();
    converted(&folder, "many", &["-f", "ESRI Shapefile"]);
    fs::remove_file(folder.path().join("many/buildings.shx")).unwrap();
    assert_untouched(&folder, "many");
}

#[test]
fn other_formats_and_folders_are_left_as_they_were() {
    for (name, more) in [
        ("suspect.gml", &["-f", "GML"][..]),
        ("suspect.tab", &["-f", "MapInfo File"]),
        ("suspect.csv", &["-f", "CSV", "-lco", "GEOMETRY=AS_WKT", "-lco", "CREATE_CSVT=YES"]),
        ("suspect.sqlite", &["-f", "SQLite"]),
        ("folder", &["-f", "ESRI Shapefile"]),
        ("suspect.fgb", &["-f", "FlatGeobuf"]),
    ] {
        let folder = TempDir::new().unwrap();
        converted(&folder, name, more);
        assert_untouched(&folder, name);
    }
}

#[test]
fn a_broken_suspect_is_named_by_its_own_path() {
    let folder = TempDir::new().unwrap();
    for name in ["broken.gpkg", "broken.shp", "broken.geojson", "broken.svg"] {
        let path = common::write(&folder, name, "{ SQLite format 3");
        let (code, text) = verify(&path);
        assert_eq!(code, Some(5), "{text}");
        assert!(text.contains(path.to_str().unwrap()) && !text.contains(".meshmark-write-"), "{text}");
    }
}

#[test]
fn a_suspect_in_a_folder_that_cannot_be_written_to_is_read() {
    let folder = TempDir::new().unwrap();
    with_log(&folder);
    let mode = |mode| fs::set_permissions(folder.path(), fs::Permissions::from_mode(mode)).unwrap();
    mode(0o555);
    assert_untouched(&folder, "suspect.gpkg");
    mode(0o755);
}

#[test]
fn a_suspect_that_changes_during_its_examination_has_no_report() {
    let [folder, results] = [(); 2].map(|()| TempDir::new().unwrap());
    with_log(&folder);
    let suspect = folder.path().join("suspect.gpkg");
    for changed in ["suspect.gpkg-wal", "suspect.gpkg"] {
        let report = results.path().join("report.html");
        let mut command = common::command(&suspect);
        command.arg("--report").arg(&report).stdout(Stdio::piped()).stderr(Stdio::piped());
        let running = command.spawn().unwrap();
        common::child_of(&running); // it has the copy
        fs::remove_file(folder.path().join(changed)).unwrap();
        let (code, text) = common::ended(running.wait_with_output().unwrap());
        assert_eq!(code, Some(5), "{text}");
        assert!(text.contains(suspect.to_str().unwrap()) && !report.exists(), "{text}");
    }
}

/// Mounts a small disk that only this command sees, as any user may where namespaces are allowed.
#[test]
fn a_full_folder_of_temporary_files_is_named() {
    let small = TempDir::new().unwrap();
    let mount = "mount -t tmpfs -o size=64k tmpfs \"$TMPDIR\"";
    let run = |script: &str| {
        let verify = common::command(&fixture("vectors/marked.gpkg"));
        let mut namespace = Command::new("unshare");
        namespace.args(["-rm", "sh", "-c", script, "sh"]).arg(verify.get_program()).args(verify.get_args());
        common::ended(namespace.env("TMPDIR", small.path()).output().unwrap())
    };
    if run(mount).0 != Some(0) {
        return eprintln!("this machine allows no namespaces, and its disks are not small");
    }
    let left = "code=$?; ls -A \"$TMPDIR\"; exit $code";
    let (code, text) = run(&format!("{mount} && \"$@\"; {left}"));
    assert_eq!(code, Some(7), "{text}");
    assert!(text.contains("TMPDIR") && text.contains("marked.gpkg") && text.lines().count() == 1, "{text}");
}
