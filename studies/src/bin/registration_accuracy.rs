//! Measures the accuracy of the registration in `meshmark verify`: `registration_accuracy MAP...`
//! marks maps, transforms the copies by random affine maps, verifies them, and prints a Markdown
//! table of the remaining errors.
//!
//! The error of a registration is the root mean square, over vertices of the reference, of the
//! distance between a vertex and its image under the true affine map and then the recovered one.

use clap::Parser;
use geo::{CoordsIter, Geometry};
use meshmark_core::vertices::VertexTable;
use meshmark_host_tests::{
    Result,
    attacks::{Map, Random, crop, features, vertices},
    product::{Asked, Marking, Product, Profile, Registration, write_key},
};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Measure the error of registrations in metres.
#[derive(Parser)]
struct Arguments {
    /// Maps in metres
    #[arg(required = true)]
    maps: Vec<PathBuf>,
    /// Seed of keys and affine maps
    #[arg(long, default_value_t = 2003)]
    seed: u64,
}

/// The part of a marked map that remains before the affine map.
struct Suspect {
    title: &'static str,
    registration: &'static str,
    make: fn(&Map) -> Result<Map>,
}

const SUSPECTS: &[Suspect] = &[
    Suspect { title: "whole, auto", registration: "auto", make: |map| Ok(map.clone()) },
    Suspect { title: "whole", registration: "geometry", make: |map| Ok(map.clone()) },
    Suspect { title: "a quarter", registration: "geometry", make: |map| crop::crop(map, QUARTER) },
    Suspect { title: "1/16", registration: "geometry", make: |map| crop::crop(map, SIXTEENTH) },
    Suspect { title: "lines", registration: "geometry", make: |map| Ok(lines(map)) },
    Suspect {
        title: "lines, 3/10 of vertices deleted",
        registration: "geometry",
        make: |map| vertices::delete(&lines(map), 0.3, 1),
    },
    Suspect { title: "vertices as points", registration: "geometry", make: |map| Ok(points(map)) },
    Suspect {
        title: "a quarter, as points",
        registration: "geometry",
        make: |map| Ok(points(&crop::crop(map, QUARTER)?)),
    },
];

const QUARTER: crop::Window = crop::Window::Quarter { column: 1, row: 0 };
const SIXTEENTH: crop::Window = crop::Window::Centre { area_share: 1.0 / 16.0 };
/// With a larger error, metres, a suspect counts as not registered.
const FOUND_M: f64 = 1.0;

fn main() -> ExitCode {
    gdal::config::set_error_handler(|_, _, _| {});
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("registration_accuracy: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    let product = Product::of_this_build()?;
    println!(
        "{}, seed {}; millimetres RMS over the reference vertices where the suspect is\n",
        product.version()?,
        arguments.seed
    );
    let titles: Vec<&str> = SUSPECTS.iter().map(|suspect| suspect.title).collect();
    println!("| map | vertices | {} |", titles.join(" | "));
    println!("|---|---|{}", "---|".repeat(titles.len()));
    let mut longest = vec![0.0f64; SUSPECTS.len()];
    for (i, map) in arguments.maps.iter().enumerate() {
        let row = row(&product, map, arguments.seed + i as u64, &mut longest);
        println!("{}", row.map_err(|error| format!("{}: {error}", map.display()))?);
    }
    let longest: Vec<String> = longest.iter().map(|seconds| format!("{seconds:.2}")).collect();
    println!("\n| longest registration, seconds on one thread | {} |", longest.join(" | "));
    Ok(())
}

/// Returns the row of one map in the table. `longest` holds the seconds of the longest registration
/// so far for every suspect.
fn row(product: &Product, path: &Path, seed: u64, longest: &mut [f64]) -> Result<String> {
    let folder = tempfile::tempdir()?;
    let file = |name: &str| folder.path().join(name);
    let (key, record, marked) = (file("key.json"), file("record.json"), file("marked.gpkg"));
    write_key(&key, seed)?;
    let marking =
        Marking { key: &key, recipient: "ACME GmbH", profile: Profile::repetition(2), precision: 0.001 };
    product.mark(path, &marked, &record, marking)?;
    let (reference, marked) = (Map::read(path)?, Map::read(&marked)?);
    let mut cells = Vec::new();
    let mut random = Random::new(seed);
    for (i, suspect) in SUSPECTS.iter().enumerate() {
        let part = (suspect.make)(&marked)?;
        let there = affine(&mut random, part.vertices()?.centre());
        let file = file(&format!("suspect{i}.gpkg"));
        part.map_coords(|p| apply(&there, p)).write(&file)?;
        let report =
            product.verify(&key, path, Asked::Record(&record), "joint", suspect.registration, &file)?;
        let rms_m = error_m(&reference.vertices()?, &part.vertices()?, &there, &report.registration);
        longest[i] = longest[i].max(report.seconds.get("registration").copied().unwrap_or_default());
        cells.push(match rms_m <= FOUND_M {
            true => format!("{:.1}", 1000.0 * rms_m),
            false => "—".into(),
        });
    }
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(format!("| {name} | {} | {} |", reference.vertices()?.len(), cells.join(" | ")))
}

/// Returns the lines of a map alone.
fn lines(map: &Map) -> Map {
    let is_line = |g: &Geometry| matches!(g, Geometry::LineString(_) | Geometry::MultiLineString(_));
    map.map_geometries(|geometry| is_line(geometry).then(|| geometry.clone()))
}

/// Returns every vertex as a point, without attributes.
fn points(map: &Map) -> Map {
    let as_points = |geometry: &Geometry| {
        let points = geometry.coords_iter().map(geo::Point::from).collect();
        Some(Geometry::MultiPoint(geo::MultiPoint(points)))
    };
    features::drop_attributes(&map.map_geometries(as_points))
}

/// Returns a rotation by any angle, scales of 0.5 to 2 along two axes, a shear, a mirror or none, a
/// shift of up to 100 km.
fn affine(random: &mut Random, about: [f64; 2]) -> [f64; 6] {
    let (sin, cos) = (std::f64::consts::PI * random.symmetric(1.0)).sin_cos();
    let (x_scale, y_scale) = (2f64.powf(random.symmetric(1.0)), 2f64.powf(random.symmetric(1.0)));
    let shear = random.symmetric(0.3);
    let mirror = if random.below(2) == 0 { 1.0 } else { -1.0 };
    let [a, b] = [mirror * x_scale * cos, y_scale * (shear * cos - sin)];
    let [d, e] = [mirror * x_scale * sin, y_scale * (shear * sin + cos)];
    let [x, y] = [about[0] + random.symmetric(1e5), about[1] + random.symmetric(1e5)];
    [a, b, x - a * about[0] - b * about[1], d, e, y - d * about[0] - e * about[1]]
}

fn apply([a, b, c, d, e, f]: &[f64; 6], [x, y]: [f64; 2]) -> [f64; 2] {
    [a * x + b * y + c, d * x + e * y + f]
}

/// Returns the error over the reference vertices in the bounding box of the part.
fn error_m(reference: &VertexTable, part: &VertexTable, there: &[f64; 6], back: &Registration) -> f64 {
    let (min, max) = part.bounds();
    let inside = |p: &&[f64; 2]| [0, 1].iter().all(|&i| (min[i]..=max[i]).contains(&p[i]));
    let squares = reference.coords().iter().filter(inside).map(|p| {
        let q = apply(&back.affine, apply(there, *p));
        (q[0] - p[0]).powi(2) + (q[1] - p[1]).powi(2)
    });
    let squares: Vec<f64> = squares.collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}
