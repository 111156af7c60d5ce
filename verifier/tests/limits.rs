//! The examination of a suspect has limits, and ends at them with one exit code, a sentence and
//! nothing left behind.

mod common;

use common::{child_of, command, ended, fixture, write};
use landlock::{AccessFs, Ruleset, RulesetAttr, RulesetStatus};
use meshmark_verifier::confinement::{Limits, enter};
use rustix::process::{Pid, Signal, kill_process};
use std::{
    env, fs,
    net::{TcpListener, UdpSocket},
    os::unix::process::ExitStatusExt,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread::sleep,
    time::Duration,
};
use tempfile::TempDir;

/// A drawing of a few lines with 30 000 × 30 000 copies of a point.
fn many_points(folder: &TempDir) -> PathBuf {
    let section = |name: &str, content: &str| format!("0\nSECTION\n2\n{name}\n{content}0\nENDSEC\n");
    let block = "0\nBLOCK\n2\nA\n10\n0\n20\n0\n0\nPOINT\n10\n497500\n20\n6711000\n0\nENDBLK\n";
    let insert = "0\nINSERT\n2\nA\n10\n0\n20\n0\n70\n30000\n71\n30000\n44\n1\n45\n1\n";
    let text = section("HEADER", "9\n$ACADVER\n1\nAC1009\n")
        + &section("BLOCKS", block)
        + &section("ENTITIES", insert)
        + "0\nEOF\n";
    write(folder, "many.dxf", &text)
}

/// The marked map with a layer that is this query.
fn with_view(folder: &TempDir, query: &str) -> PathBuf {
    let path = folder.path().join("view.gpkg");
    fs::copy(fixture("vectors/marked.gpkg"), &path).unwrap();
    let database = rusqlite::Connection::open(&path).unwrap();
    let layer = "INSERT INTO gpkg_contents (table_name, data_type, identifier, srs_id) VALUES ('v', 'features', 'v', 3067);
                 INSERT INTO gpkg_geometry_columns VALUES ('v', 'geom', 'GEOMETRY', 3067, 0, 0)";
    database.execute_batch(&format!("CREATE VIEW v AS {query}; {layer}")).unwrap();
    path
}

const ENDLESS: &str = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS OGC_FID, NULL AS geom FROM n";

/// Asserts that the examination is stopped with these words, and leaves nothing.
fn assert_stopped(suspect: &Path, limits: &[&str], words: &str) {
    let (temporary, results) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let mut command = command(suspect);
    command.env("TMPDIR", temporary.path()).args(limits);
    command.arg("--report").arg(results.path().join("report.html"));
    command.arg("--evidence-map").arg(results.path().join("evidence.gpkg"));
    let output = command.output().unwrap();
    assert!(output.stdout.is_empty(), "{output:?}");
    let (code, text) = ended(output);
    assert_eq!(code, Some(8), "{text}");
    assert_eq!(text.lines().count(), 1, "{text}");
    assert!(text.contains(suspect.to_str().unwrap()) && text.contains(words), "{text}");
    assert!([temporary, results].iter().all(is_empty), "something is left");
}

fn is_empty(folder: &TempDir) -> bool {
    folder.path().read_dir().unwrap().next().is_none()
}

#[test]
fn a_small_drawing_of_many_points_is_stopped_at_the_limit_of_memory() {
    let folder = TempDir::new().unwrap();
    let limits = ["--memory-limit", "300"];
    assert_stopped(
        &many_points(&folder),
        &limits,
        "more memory than its limit of 300 MB: give a larger --memory-limit",
    );
}

#[test]
fn a_text_too_long_for_the_memory_is_no_feature_to_leave_out() {
    let folder = TempDir::new().unwrap();
    let view = with_view(&folder, "SELECT 1 AS OGC_FID, NULL AS geom, hex(zeroblob(200000000)) AS t");
    assert_stopped(&view, &["--memory-limit", "300"], "more memory than its limit of 300 MB");
}

#[test]
fn a_layer_without_end_is_stopped_at_the_limit_of_time() {
    let folder = TempDir::new().unwrap();
    let limits = ["--time-limit", "1"];
    assert_stopped(
        &with_view(&folder, ENDLESS),
        &limits,
        "longer than its limit of 1 s: give a larger --time-limit",
    );
}

#[test]
fn rows_to_sort_are_stopped_at_the_limit_of_files() {
    let folder = TempDir::new().unwrap();
    let long = ENDLESS.replace("AS geom", "AS geom, hex(zeroblob(4000)) AS t");
    let view = with_view(&folder, &format!("{long} ORDER BY t, i"));
    assert_stopped(&view, &["--memory-limit", "200"], "a file larger than its limit of 200 MB");
}

#[test]
fn a_limit_that_is_not_reached_changes_nothing() {
    let suspect = fixture("vectors/marked.gpkg");
    let answer = |limits: &[&str]| ended(command(&suspect).args(limits).output().unwrap());
    let unlimited = answer(&[]);
    assert_eq!(unlimited.0, Some(0), "{}", unlimited.1);
    assert_eq!(answer(&["--memory-limit", "3000", "--time-limit", "300"]), unlimited);
}

/// Starts an examination without end, and waits until it runs; returns it with its child.
fn endless(folder: &TempDir, temporary: &TempDir) -> (Child, Pid) {
    let suspect = with_view(folder, ENDLESS);
    let mut command = command(&suspect);
    command.env("TMPDIR", temporary.path()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let parent = command.spawn().unwrap();
    let child = Pid::from_raw(child_of(&parent)).unwrap();
    (parent, child)
}

fn has_ended(process: Pid) -> bool {
    let state = fs::read_to_string(format!("/proc/{}/stat", process.as_raw_nonzero()));
    state.map_or(true, |state| state.contains(") Z "))
}

#[test]
fn who_ends_the_command_ends_its_child_and_leaves_nothing() {
    for signal in [Signal::TERM, Signal::INT] {
        let [folder, temporary] = [(); 2].map(|()| TempDir::new().unwrap());
        let (parent, child) = endless(&folder, &temporary);
        kill_process(Pid::from_child(&parent), signal).unwrap();
        let output = parent.wait_with_output().unwrap();
        assert_eq!(output.status.signal(), Some(signal.as_raw()), "{output:?}");
        assert!(has_ended(child) && is_empty(&temporary));
    }
}

#[test]
fn a_child_ends_with_its_parent() {
    let [folder, temporary] = [(); 2].map(|()| TempDir::new().unwrap());
    let (mut parent, child) = endless(&folder, &temporary);
    sleep(Duration::from_millis(500)); // it has begun to work
    parent.kill().unwrap();
    parent.wait().unwrap();
    while !has_ended(child) {
        sleep(Duration::from_millis(5)); // or the test waits for ever
    }
}

#[test]
fn a_child_that_is_killed_is_missed_and_leaves_nothing() {
    for (signal, words) in [(Signal::KILL, "killed from outside"), (Signal::SEGV, "ended early (signal: 11")]
    {
        let [folder, temporary] = [(); 2].map(|()| TempDir::new().unwrap());
        let (parent, child) = endless(&folder, &temporary);
        kill_process(child, signal).unwrap();
        let (code, text) = ended(parent.wait_with_output().unwrap());
        assert_eq!(code, Some(8), "{text}");
        assert!(text.contains(words) && text.lines().count() == 1, "{text}");
        assert!(is_empty(&temporary));
    }
}

/// Names the folder of a confined process, which is this test once more.
const CONFINED: &str = "MESHMARK_TEST_CONFINED";

#[test]
fn a_confined_process_writes_to_one_folder_and_has_neither_network_nor_programs() {
    if let Some(folder) = env::var_os(CONFINED) {
        return assert_confined(Path::new(&folder));
    }
    let folder = TempDir::new().unwrap();
    let this = "a_confined_process_writes_to_one_folder_and_has_neither_network_nor_programs";
    let output = Command::new(env::current_exe().unwrap())
        .args(["--exact", this, "--nocapture"])
        .env(CONFINED, folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
}

fn assert_confined(folder: &Path) {
    let (file, elsewhere) = (folder.join("file"), TempDir::new().unwrap());
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    fs::write(&file, "").unwrap();
    enter(folder, &Limits { memory_mb: 1000, time_s: 10 }, std::slice::from_ref(&file)).unwrap();
    fs::write(&file, "x").unwrap();
    assert!(Command::new("/bin/true").spawn().is_err());
    assert!(std::net::TcpStream::connect(server.local_addr().unwrap()).is_err());
    assert!(UdpSocket::bind("127.0.0.1:0").is_err());
    if kernel_restricts_files() {
        assert!(fs::write(elsewhere.path().join("file"), "x").is_err());
        assert!(fs::read_dir(elsewhere.path()).is_ok(), "it reads everywhere");
    }
}

fn kernel_restricts_files() -> bool {
    let ruleset = Ruleset::default().handle_access(AccessFs::MakeFifo).unwrap().create().unwrap();
    ruleset.restrict_self().unwrap().ruleset != RulesetStatus::NotEnforced
}
