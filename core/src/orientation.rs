//! On which side of a line a point is, exactly (J. R. Shewchuk, *Adaptive Precision Floating-Point
//! Arithmetic and Fast Robust Geometric Predicates*, Discrete & Computational Geometry 18, 1997).

use robust::{Coord, orient2d};

/// Positive where `p` is on the left of the way from `a` to `b`, negative on the right, zero on
/// their line; the sign is exact.
pub fn orientation(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> f64 {
    let [a, b, p] = [a, b, p].map(|[x, y]| Coord { x, y });
    orient2d(a, b, p)
}
