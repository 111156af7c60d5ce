//! The linear part of a registration, measured on the ground.

use crate::report::sketch::Alignment;
use meshmark_detection::{Matched, registration::Registration};

pub fn alignment(matched: &Matched, registration: &Registration) -> Alignment {
    let [a, b, c, d, e, f] = registration.affine;
    let [x, y] = matched.suspect.vertices.centre();
    let to = [a * x + b * y + c, d * x + e * y + f];
    let [mx, my] = matched.reference.ground.metres_per_unit(to);
    let [b, d] = [b * mx / my, d * my / mx]; // on the ground
    let (squares, determinant) = (a * a + b * b + d * d + e * e, a * e - b * d);
    let root = (squares * squares - 4.0 * determinant * determinant).max(0.0).sqrt();
    let mirror = if determinant < 0.0 { -1.0 } else { 1.0 };
    Alignment {
        shift_m: [(to[0] - x) * mx, (to[1] - y) * my],
        turn_deg: (d - mirror * b).atan2(a + mirror * e).to_degrees(),
        stretch: [squares + root, squares - root].map(|s| (s.max(0.0) / 2.0).sqrt()),
        mirrored: determinant < 0.0,
    }
}
