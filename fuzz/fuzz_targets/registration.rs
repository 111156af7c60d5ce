//! Registration and matching of arbitrary finite places: they end, and their result is made of
//! numbers.
#![no_main]

mod input;

use input::Input;
use libfuzzer_sys::fuzz_target;
use meshmark_core::{
    ground::Ground,
    map_data::{ChainKind, Dimension, Label, MapData, Polyline},
    options::Parameters,
    series::Series,
};
use meshmark_detection::{
    Matched, Reference,
    matching::RadiusChoice,
    registration::{Registrar, Start},
};

const STARTS: [Start; 4] = [Start::Auto, Start::Landmarks, Start::Geometry, Start::None];
const KINDS: [ChainKind; 3] = [ChainKind::Line, ChainKind::Shell, ChainKind::Hole];
/// The smallest patches that are legal, so that small maps have some.
const PATCH_SIZE: usize = 16;

fuzz_target!(|bytes: &[u8]| {
    let mut input = Input(bytes);
    let flags = input.byte();
    let how = How { in_degrees: flags & 4 != 0, any_number: flags & 8 != 0 };
    let Some(reference) = map(&mut input, how) else { return };
    let suspect = match flags & 16 {
        0 => map(&mut input, how),
        _ => moved(&reference, &mut input),
    };
    let Some(suspect) = suspect else { return };
    let ground = if how.in_degrees { Ground::WGS84 } else { Ground::METRES };
    let registrar = Registrar::new(&reference, &ground, 0.75);
    let start = STARTS[usize::from(flags & 3)];
    let registration = registrar.register(&suspect, start);
    assert!(registration.affine.iter().all(|value| value.is_finite()), "{registration:?}");
    assert!(registration.rms_m.is_none_or(f64::is_finite), "{registration:?}");
    assert!(registration.share.is_finite() && !registration.to_text().is_empty(), "{registration:?}");
    if flags & 32 == 0 {
        return;
    }
    let parameters = Parameters { patch_size: PATCH_SIZE, ..Parameters::of_fingerprint() };
    let on_ground = reference.on(&ground, &ground);
    let series = Series::of_one(on_ground, &parameters);
    let Ok(prepared) = Reference::for_fingerprints(&reference, &on_ground, &series, 1) else { return };
    let matched = Matched::new(&prepared, &suspect, &registration, RadiusChoice::FromData);
    assert!(matched.radius.metres > 0.0 && matched.radius.metres.is_finite());
});

/// How coordinates are read.
#[derive(Clone, Copy)]
struct How {
    /// Longitudes and latitudes.
    in_degrees: bool,
    /// Any bits, and not steps of a grid.
    any_number: bool,
}

/// Reads a map, chain after chain; `None` for one that no dataset would give.
fn map(input: &mut Input, how: How) -> Option<MapData> {
    let (mut coords, mut starts, mut kinds) = (Vec::new(), Vec::new(), Vec::new());
    let (mut polylines, mut labels) = (Vec::new(), Vec::new());
    for _ in 0..input.byte() {
        let head = input.byte();
        let kind = KINDS[usize::from(head & 3) % KINDS.len()];
        // A hole is part of a polygon.
        let kind = if starts.is_empty() && kind == ChainKind::Hole { ChainKind::Shell } else { kind };
        let mut chain: Vec<[f64; 2]> = (0..=head >> 3).map(|_| place(input, how)).collect();
        let first = chain[0];
        if chain.len() >= Polyline::LEAST_VERTICES && kind != ChainKind::Hole {
            polylines.push(Polyline { vertices: chain.clone(), closed: kind == ChainKind::Shell });
        }
        if kind != ChainKind::Line {
            chain.push(first);
        }
        if head & 4 != 0 {
            let value = (input.byte() % 16).to_string();
            labels.push(Label { value, point: first, dimension: Dimension::Area });
        }
        starts.push(coords.len() as u32);
        kinds.push(kind);
        coords.extend(chain);
        if input.0.is_empty() {
            break;
        }
    }
    if coords.is_empty() {
        return None;
    }
    let (data, _) = MapData::from_chains(coords, &starts, kinds).ok()?;
    Some(MapData { polylines, labels, ..data })
}

fn place(input: &mut Input, how: How) -> [f64; 2] {
    let mut ordinate = |most: f64| {
        let value = if how.any_number { input.number() } else { f64::from(input.short()) / 16.0 };
        let value = if value.is_finite() { value } else { 0.0 };
        if how.in_degrees { value % most } else { value }
    };
    [ordinate(180.0), ordinate(90.0)]
}

/// Returns the map under an affine map that the input chooses.
fn moved(map: &MapData, input: &mut Input) -> Option<MapData> {
    let mut small = || f64::from(input.short()) / 256.0;
    let [a, b, c, d, e, f] = std::array::from_fn(|_| small());
    map.moved::<meshmark_core::Error>(|places| {
        Ok(places.iter().map(|[x, y]| [a * x + b * y + c, d * x + e * y + f]).collect())
    })
    .ok()
}
