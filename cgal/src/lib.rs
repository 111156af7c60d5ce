//! CGAL's Delaunay triangulation, run as a program of its own: the oracle for our mesh. Two
//! triangulations are compared by [`delaunay_check`].

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

pub mod delaunay_check;

const SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/delaunay_edges.cpp");

/// Compiles the oracle into `out_dir` unless it is there already, and returns its path.
///
/// # Errors
/// A sentence when g++ cannot be run or fails, with what it printed.
pub fn build(out_dir: &Path) -> Result<PathBuf, String> {
    let program = out_dir.join("delaunay_edges");
    if is_newer(&program, Path::new(SOURCE)) {
        return Ok(program);
    }
    std::fs::create_dir_all(out_dir).map_err(|e| format!("{}: {e}", out_dir.display()))?;
    // Renamed into place, so that a concurrent caller never runs a half-written program.
    let unfinished = out_dir.join(format!("delaunay_edges.{}", std::process::id()));
    compile(&unfinished)?;
    std::fs::rename(&unfinished, &program).map_err(|e| format!("{}: {e}", program.display()))?;
    Ok(program)
}

fn is_newer(file: &Path, than: &Path) -> bool {
    let modified = |path: &Path| path.metadata().and_then(|m| m.modified()).ok();
    match (modified(file), modified(than)) {
        (Some(file), Some(than)) => file > than,
        _ => false,
    }
}

fn compile(program: &Path) -> Result<(), String> {
    let output = Command::new("g++")
        // CGAL's interval arithmetic switches rounding modes, which -frounding-math makes legal.
        .args(["-O2", "-std=c++17", "-frounding-math", SOURCE, "-lgmp", "-o"])
        .arg(program)
        .output()
        .map_err(|e| format!("g++ cannot be run: {e}"))?;
    if output.status.success() {
        return Ok(());
    }
    let stderr = String::from_utf8_lossy(&output.stderr);
    Err(format!("g++ cannot compile {SOURCE} (are libcgal-dev and libgmp-dev installed?):\n{stderr}"))
}

/// CGAL's Delaunay edges of `points`: index pairs `[i, j]`, i < j, sorted. Equal points are one
/// vertex, which bears the first of their indices.
///
/// # Errors
/// A sentence when `program` (see [`build`]) cannot be run or reports a failure.
pub fn delaunay_edges(program: &Path, points: &[[f64; 2]]) -> Result<Vec<[u32; 2]>, String> {
    let answer = ask(Command::new(program), points)?;
    decode(&answer).ok_or_else(|| "CGAL's answer is not as long as it says".to_string())
}

/// How many seconds CGAL takes for them, without starting the program and handing over the points.
///
/// # Errors
/// As [`delaunay_edges`].
pub fn delaunay_seconds(program: &Path, points: &[[f64; 2]]) -> Result<f64, String> {
    let mut command = Command::new(program);
    command.arg("time");
    let answer = ask(command, points)?;
    String::from_utf8_lossy(&answer).trim().parse().map_err(|error| format!("CGAL's time: {error}"))
}

fn ask(mut command: Command, points: &[[f64; 2]]) -> Result<Vec<u8>, String> {
    let output = run(&mut command, &encode(points)).map_err(|e| format!("{command:?}: {e}"))?;
    if output.status.success() {
        return Ok(output.stdout);
    }
    let stderr = String::from_utf8_lossy(&output.stderr);
    Err(format!("{} ({})", stderr.trim_end(), output.status))
}

/// The program reads all of stdin before it writes, so writing first cannot block for ever.
fn run(command: &mut Command, input: &[u8]) -> std::io::Result<Output> {
    let piped = || Stdio::piped();
    let mut child = command.stdin(piped()).stdout(piped()).stderr(piped()).spawn()?;
    let written = child.stdin.take().expect("stdin is piped").write_all(input);
    let output = child.wait_with_output()?;
    match written {
        // It gave up reading: its exit status and its stderr say why.
        Err(e) if e.kind() == ErrorKind::BrokenPipe && !output.status.success() => Ok(output),
        written => written.map(|()| output),
    }
}

fn encode(points: &[[f64; 2]]) -> Vec<u8> {
    let coordinates = points.as_flattened().iter().flat_map(|c| c.to_le_bytes());
    (points.len() as u64).to_le_bytes().into_iter().chain(coordinates).collect()
}

fn decode(answer: &[u8]) -> Option<Vec<[u32; 2]>> {
    let (count, edges) = answer.split_first_chunk()?;
    let (edges, rest) = edges.as_chunks::<8>();
    let index = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let complete = edges.len() as u64 == u64::from_le_bytes(*count) && rest.is_empty();
    complete.then(|| edges.iter().map(|e| [index(&e[..4]), index(&e[4..])]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_truncated_answer_is_refused() {
        assert_eq!(decode(&[0; 8]), Some(vec![]));
        assert_eq!(decode(&[0; 7]), None);
        assert_eq!(decode(&[1, 0, 0, 0, 0, 0, 0, 0, 1]), None);
    }
}
