//! Registration of suspects whose lines were drawn anew, moved and turned, without attributes.

use meshmark_core::{
    ground::Ground,
    map_data::{ChainKind, MapData, Polyline},
};
use meshmark_detection::registration::{Affine, Method, Registrar, Start};
use std::f64::consts::TAU;

/// Distance between new vertices of the suspect, metres.
const SPACING_M: f64 = 1.3;
/// Maps the suspect onto the reference: it was mirrored, turned, scaled and moved.
const AFFINE: Affine = Affine { coefficients: [-0.6, 0.5, 900.0, 0.5, 0.6, -50.0] };

/// Returns a number from 0 to 1 that looks random.
fn random(seed: u64, i: u64) -> f64 {
    let mixed = (seed * 131 + i).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(23);
    mixed.wrapping_mul(0xd134_2543_de82_ef95) as f64 / 2f64.powi(64)
}

/// Returns 120 rings or lines of five to eight vertices, unevenly placed.
fn curves(closed: bool, seed: u64) -> Vec<Vec<[f64; 2]>> {
    let curve = |n: u64| {
        let of = |i: u64| random(seed * 1000 + n, i);
        let (count, centre) = (5 + n % 4, [400.0 * of(90), 400.0 * of(91)]);
        let span = if closed { TAU } else { 0.7 * TAU };
        let vertex = |i: u64| {
            let (angle, radius) = (of(92) * TAU + i as f64 / count as f64 * span, 6.0 + 6.0 * of(i));
            [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()]
        };
        let mut vertices: Vec<[f64; 2]> = (0..count).map(vertex).collect();
        vertices.extend(closed.then_some(vertices[0]));
        vertices
    };
    (0..120).map(curve).collect()
}

fn map(curves: &[Vec<[f64; 2]>], closed: bool) -> MapData {
    let start = |next: &mut u32, curve: &Vec<[f64; 2]>| {
        *next += curve.len() as u32;
        Some(*next - curve.len() as u32)
    };
    let starts: Vec<u32> = curves.iter().scan(0, start).collect();
    let kind = if closed { ChainKind::Shell } else { ChainKind::Line };
    let (data, _) = MapData::from_chains(curves.concat(), &starts, vec![kind; starts.len()]).unwrap();
    let polyline = |curve: &Vec<[f64; 2]>| {
        let distinct = curve.len() - usize::from(closed);
        Polyline { vertices: curve[..distinct].to_vec(), closed }
    };
    MapData { polylines: curves.iter().map(polyline).collect(), ..data }
}

/// Returns a curve with new vertices alone, moved by the inverse of [`AFFINE`].
fn drawn_anew(curve: &[[f64; 2]], closed: bool) -> Vec<[f64; 2]> {
    let [a, b, c, d, e, f] = AFFINE.coefficients;
    let (det, mut places, mut next) = (a * e - b * d, Vec::new(), SPACING_M / 3.0);
    for ends in curve.windows(2) {
        let along = [0, 1].map(|axis| ends[1][axis] - ends[0][axis]);
        let length = along[0].hypot(along[1]);
        while next < length {
            let [x, y] = [0, 1].map(|axis| ends[0][axis] + along[axis] * next / length);
            places.push([(e * (x - c) - b * (y - f)) / det, (a * (y - f) - d * (x - c)) / det]);
            next += SPACING_M;
        }
        next -= length;
    }
    places.extend(closed.then_some(places[0]));
    places
}

#[test]
fn rings_and_lines_with_new_vertices_are_registered_by_their_course() {
    for closed in [true, false] {
        let curves = curves(closed, 1);
        let reference = map(&curves, closed);
        let suspect: Vec<_> = curves.iter().map(|curve| drawn_anew(curve, closed)).collect();
        let found =
            Registrar::new(&reference, &Ground::METRES, 1.0).register(&map(&suspect, closed), Start::Auto);
        assert_eq!(found.method, Method::Curves, "closed {closed}");
        for place in suspect.concat() {
            let ([u, v], [s, t]) = (AFFINE.apply(place), found.apply(&[place])[0]);
            assert!((u - s).hypot(v - t) < 0.1, "closed {closed}: {place:?} {found:?}");
        }
    }
}

#[test]
fn another_map_is_not_registered() {
    for closed in [true, false] {
        let reference = map(&curves(closed, 1), closed);
        let foreign: Vec<_> = curves(closed, 2).iter().map(|curve| drawn_anew(curve, closed)).collect();
        let found =
            Registrar::new(&reference, &Ground::METRES, 1.0).register(&map(&foreign, closed), Start::Auto);
        assert_eq!((found.method, found.matched), (Method::Identity, 0), "closed {closed}");
    }
}
