//! Continuous collision detection: it decides whether a vertex and a segment keep their relative
//! places while both move in a straight line from the old coordinates to the new ones.
//!
//! The topology of an arrangement of segments changes only where a vertex meets a segment. If no
//! vertex does on the way, no new crossing appears, and every vertex stays on its side of every
//! segment.

use crate::nearness::{cross, dot, metres, nearest};

/// A vertex closer than this touches a segment.
const TOUCH_M: f64 = 1e-6;
/// A gap stays at least this wide, or half as wide as it was.
const LEAST_GAP_M: f64 = 1e-4;
/// Rounding to 64-bit numbers adds at most this much, besides the last digits of the coordinates
/// themselves.
const ROUNDING_M: f64 = 1e-8;

/// How far a vertex and a segment that touch may move against each other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slack {
    /// A vertex within this distance of a segment touches it, metres.
    touch_m: f64,
    /// The two may then move against each other by this much, metres.
    shift_m: f64,
}

impl Slack {
    /// Derives the slack from the size `digit_m` of the last digit of a 64-bit coordinate. On a
    /// grid of `grid_m` metres T-junctions hold within one step.
    pub fn new(digit_m: f64, grid_m: f64, junction_m: f64) -> Self {
        match grid_m {
            0.0 => Slack { touch_m: TOUCH_M, shift_m: ROUNDING_M + 4.0 * digit_m },
            _ => Slack { touch_m: junction_m, shift_m: 1.5 * grid_m },
        }
    }
}

/// A vertex and the two ends of a segment, CRS units.
pub(crate) type Triple = [[f64; 2]; 3];

/// Returns whether vertex and segment keep their relative places from `before` to `after`; `scale`
/// is metres per unit.
pub(crate) fn keeps_apart(before: &Triple, after: &Triple, scale: [f64; 2], slack: Slack) -> bool {
    let [vertex, a, b] = *before;
    let (p, e) = (metres(a, vertex, scale), metres(a, b, scale));
    let [dv, da, db] = [0, 1, 2].map(|i| metres(before[i], after[i], scale));
    // The vertex and the end move by these, relative to the start.
    let (dp, de) = (minus(dv, da), minus(db, da));
    let (gap2, share) = nearest(p, e);
    let gap = gap2.sqrt();
    if gap <= slack.touch_m {
        let shift = [0, 1].map(|axis| dp[axis] - share * de[axis]);
        return dot(shift, shift) <= slack.shift_m.powi(2);
    }
    let least_gap = LEAST_GAP_M.min(gap / 2.0);
    let approach = dot(dp, dp).max(dot(minus(dp, de), minus(dp, de))).sqrt();
    if gap - approach >= least_gap {
        return true;
    }
    nearest(plus(p, dp), plus(e, de)).0 >= least_gap * least_gap && !meets(p, e, dp, de, least_gap)
}

/// Returns whether the point p + t dp meets the segment from 0 to e + t de for some t from 0 to 1:
/// their cross product is a polynomial of degree two in t. A point that moves along the line of the
/// segment counts as meeting it.
fn meets(p: [f64; 2], e: [f64; 2], dp: [f64; 2], de: [f64; 2], pad_m: f64) -> bool {
    let (c, b, a) = (cross(e, p), cross(e, dp) + cross(de, p), cross(de, dp));
    let tiny = 1e-12 * (dot(p, p) + dot(e, e));
    if c.abs().max(b.abs()).max(a.abs()) <= tiny {
        return true;
    }
    let on_segment = |t: f64| {
        let (p, e) = ([0, 1].map(|i| p[i] + t * dp[i]), [0, 1].map(|i| e[i] + t * de[i]));
        nearest(p, e).0 <= pad_m * pad_m
    };
    roots(a, b, c).into_iter().flatten().any(|t| (0.0..=1.0).contains(&t) && on_segment(t))
}

/// Returns the real roots of a t² + b t + c, by the formula without cancellation.
fn roots(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return [None, None];
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    let finite = |t: f64| t.is_finite().then_some(t);
    [finite(q / a), finite(c / q)]
}

fn plus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXACT: Slack = Slack { touch_m: TOUCH_M, shift_m: ROUNDING_M };

    fn apart(before: Triple, after: Triple) -> bool {
        keeps_apart(&before, &after, [1.0, 1.0], EXACT)
    }

    #[test]
    fn a_vertex_may_come_near_and_pass_beside_but_not_through() {
        let segment = [[0.0, 0.0], [4.0, 0.0]];
        let to = |from: [f64; 2], to: [f64; 2]| {
            apart([from, segment[0], segment[1]], [to, segment[0], segment[1]])
        };
        assert!(to([1.0, 0.3], [1.0, 0.1]));
        assert!(!to([1.0, 0.3], [1.0, -0.1]));
        assert!(!to([1.0, 0.3], [1.0, 1e-6]), "closer than rounding elsewhere keeps apart");
        assert!(to([4.2, 0.3], [4.2, -0.3]));
        assert!(!to([4.2, 0.3], [3.8, -0.3]));
        assert!(to([4.2, 0.0], [4.1, 0.0]));
        assert!(!to([4.2, 0.0], [3.9, 0.0]));
    }

    #[test]
    fn a_segment_that_sweeps_over_a_vertex_is_seen() {
        // The end of the segment sweeps over the vertex; before and after they are far apart.
        assert!(!apart([[0.0, 1.0], [0.0, 0.0], [2.0, 3.0]], [[0.0, 1.0], [0.0, 0.0], [-2.0, 3.0]]));
    }

    #[test]
    fn what_touches_must_move_together() {
        let before = [[1.0, 0.0], [0.0, 0.0], [4.0, 0.0]];
        assert!(apart(before, [[1.0, 0.075], [0.0, 0.1], [4.0, 0.0]]));
        assert!(!apart(before, [[1.0, 0.076], [0.0, 0.1], [4.0, 0.0]]));
    }
}
