//! The measurements as Markdown and as a plot.

use crate::{job::Jobs, stages::Stages};
use meshmark_host_tests::Result;
use meshmark_studies::plot::{Axis, Plot, Series};
use plotters::style::{BLUE, GREEN, RED, RGBColor};
use std::fs;

/// From this number of vertices on, time and memory are fitted by a power of N.
const LEAST_FITTED: usize = 100_000;

/// A row of the table: its title, and its value for a map.
type Row = (&'static str, fn(&Jobs) -> String);

const ROWS: &[Row] = &[
    ("distinct vertices", |j| j.vertices.to_string()),
    ("**`ogr2ogr -f GPKG`: plain**, s", |j| seconds(j.plain.best_s())),
    ("**through MESHMARK**, s", |j| seconds(j.marked.best_s())),
    ("times plain", |j| ratio(j.marked.best_s(), j.plain.best_s())),
    ("with `PATCH_SIZE=256`, `CHIP_RATE=1`, `CODE=REPETITION`, s", |j| seconds(j.small_patches.best_s())),
    ("times plain", |j| ratio(j.small_patches.best_s(), j.plain.best_s())),
    ("**numpy script**, s", |j| seconds(j.script.best_s())),
    ("times MESHMARK", |j| ratio(j.script.best_s(), j.marked.best_s())),
    ("**`meshmark verify`**, s", |j| seconds(j.verified.best_s())),
    ("times MESHMARK", |j| ratio(j.verified.best_s(), j.marked.best_s())),
    ("`meshmark distribute` to one recipient, to nine, s", |j| {
        j.distributed.each_ref().map(|runs| seconds(runs.best_s())).join(", ")
    }),
    ("each further recipient, s", |j| seconds(j.further_s())),
    ("times plain", |j| ratio(j.further_s(), j.plain.best_s())),
    ("processor s: plain, MESHMARK, verify", |j| {
        [&j.plain, &j.marked, &j.verified].map(|runs| seconds(runs.processor_s())).join(", ")
    }),
    ("peak MB: plain, MESHMARK, verify", |j| {
        [&j.plain, &j.marked, &j.verified].map(|runs| format!("{:.0}", runs.peak_bytes() / 1e6)).join(", ")
    }),
    ("MESHMARK's bytes per vertex above plain", |j| format!("{:.0}", j.bytes_per_vertex())),
    ("stages: reading, s", |j| stage(j, |s| seconds(s.read_s))),
    ("mesh, constraints, patches, s", |j| stage(j, |s| seconds(s.cut_s))),
    ("one patch solved, one thread, ms", |j| stage(j, |s| format!("{:.1}", 1e3 * s.solve_s))),
    ("all patches solved, processor s", |j| stage(j, |s| seconds(s.solves_s()))),
    ("solving on two threads, times faster", |j| stage(j, |s| format!("{:.2}", s.solve_speed_up))),
    ("embedding in all, s", |j| stage(j, |s| seconds(s.embed_s))),
    ("verify: reading, patches, registration, matching, s", |j| {
        ["reading", "patches", "registration", "matching"].map(|name| verification(j, name)).join(", ")
    }),
    ("verify: deformation, demodulation, s", |j| {
        ["deformation", "demodulation"].map(|name| verification(j, name)).join(", ")
    }),
    ("verdict", |j| j.verdict.as_str().unwrap_or("none").into()),
];

fn seconds(value: f64) -> String {
    if value.is_finite() { format!("{value:.2}") } else { "–".into() }
}

fn ratio(a: f64, b: f64) -> String {
    let ratio = a / b;
    if ratio.is_finite() { format!("{ratio:.1}") } else { "–".into() }
}

fn stage(jobs: &Jobs, of: impl Fn(&Stages) -> String) -> String {
    jobs.stages.as_ref().map_or("–".into(), of)
}

fn verification(jobs: &Jobs, stage: &str) -> String {
    seconds(jobs.verification[stage].as_f64().unwrap_or(f64::NAN))
}

/// Returns the table, followed by the measurements that do not belong to one map.
pub fn markdown(all: &[Jobs], load_ms: f64) -> String {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut text = format!(
        "{threads} threads ({}), GDAL {}, load {}\n\n",
        processor_name(),
        gdal::version::VersionInfo::release_name(),
        load()
    );
    let names: String = all.iter().map(|jobs| format!(" {} |", jobs.name)).collect();
    text += &format!("| |{names}\n|---|{}\n", "---|".repeat(all.len()));
    for (name, value) in ROWS {
        let values: String = all.iter().map(|jobs| format!(" {} |", value(jobs))).collect();
        text += &format!("| {name} |{values}\n");
    }
    text += &format!("\nThe driver adds {load_ms:.1} ms to `ogrinfo --formats`, which does not use it.\n");
    for (name, of) in SCALED {
        if let Some(exponent) = exponent(all, of) {
            text += &format!(
                "{name} grows with N to the power of {exponent:.2} from {LEAST_FITTED} vertices on.\n"
            );
        }
    }
    text
}

type Scaled = (&'static str, fn(&Jobs) -> f64);

const SCALED: [Scaled; 4] = [
    ("Time of the export", |j| j.marked.best_s()),
    ("Its memory", |j| j.marked.peak_bytes()),
    ("Time of verification", |j| j.verified.best_s()),
    ("Its memory", |j| j.verified.peak_bytes()),
];

/// Returns the slope of log y over log N by least squares.
fn exponent(all: &[Jobs], of: fn(&Jobs) -> f64) -> Option<f64> {
    let large = all.iter().filter(|jobs| jobs.vertices >= LEAST_FITTED);
    let points: Vec<[f64; 2]> = large.map(|jobs| [(jobs.vertices as f64).ln(), of(jobs).ln()]).collect();
    let count = points.len() as f64;
    let mean = [0, 1].map(|i| points.iter().map(|p| p[i]).sum::<f64>() / count);
    let moment = |i: usize| points.iter().map(|p| (p[0] - mean[0]) * (p[i] - mean[i])).sum::<f64>();
    (points.len() > 1 && moment(0) > 0.0).then(|| moment(1) / moment(0))
}

/// Plots time and memory against the number of vertices on logarithmic axes.
///
/// # Errors
/// Fails like [`Plot::to_svg`].
pub fn plots(all: &[Jobs]) -> Result<[(&'static str, String); 2]> {
    let series = |name: &str, colour: RGBColor, thin: bool, of: &dyn Fn(&Jobs) -> f64| {
        let points = all.iter().map(|jobs| (jobs.vertices as f64, of(jobs)));
        let points = points.filter(|point| point.1.is_finite() && point.1 > 0.0).collect();
        Series { name: name.into(), points, colour, thin }
    };
    let plot = |title: &str, y: &str, series: Vec<Series>| {
        Plot { title: title.into(), x: Axis::log("vertices"), y: Axis::log(y), series }.to_svg()
    };
    let time = vec![
        series("numpy script", RED, false, &|j| j.script.best_s()),
        series("meshmark verify", GREEN, false, &|j| j.verified.best_s()),
        series("through MESHMARK", BLUE, false, &|j| j.marked.best_s()),
        series("plain ogr2ogr", BLUE, true, &|j| j.plain.best_s()),
    ];
    let memory = vec![
        series("numpy script", RED, false, &|j| j.script.peak_bytes() / 1e6),
        series("meshmark verify", GREEN, false, &|j| j.verified.peak_bytes() / 1e6),
        series("through MESHMARK", BLUE, false, &|j| j.marked.peak_bytes() / 1e6),
        series("plain ogr2ogr", BLUE, true, &|j| j.plain.peak_bytes() / 1e6),
    ];
    Ok([("time", plot("Time", "seconds", time)?), ("memory", plot("Peak memory", "MB", memory)?)])
}

fn processor_name() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    name.map_or("unknown processor".into(), |(_, name)| name.trim().into())
}

/// Returns the number of runnable processes in the last minute: if it exceeds that of the threads,
/// times are too long.
fn load() -> String {
    let text = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split(' ').next().unwrap_or_default().into()
}
