//! Embedding: the message becomes a small displacement of every vertex (paper, section 3.4).

use crate::{
    Error, Result,
    carrier::{Carrier, bit_of_coefficient},
    code::Code,
    ground::Ground,
    key::SecretKey,
    message::Message,
    options::Parameters,
    patches::{Patch, Patches},
    spectrum::Basis,
    vertices::VertexTable,
};
use rayon::prelude::*;

/// How far the vertices moved, metres on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Displacement {
    /// Root mean square.
    pub rms_m: f64,
    /// 99th percentile.
    pub p99_m: f64,
    /// The largest.
    pub max_m: f64,
}

/// A marked map.
#[derive(Debug, Clone, PartialEq)]
pub struct Marked {
    /// The new place of every vertex, in canonical order, CRS units.
    pub coords: Vec<[f64; 2]>,
    /// How many patches carry the message.
    pub patches: usize,
    /// How far the vertices moved.
    pub displacement: Displacement,
}

/// Marks a map: Δ = E(α · p ∘ b′) on both axes of every patch, held within the tolerance and put on
/// the output grid. The message is read back from the result before it is returned.
///
/// # Errors
/// Everything of [`Patches::new`], [`Patches::carriers`], a PRECISION that is coarser than
/// TOLERANCE, and [`Error::MessageLost`].
pub fn embed(
    table: &VertexTable,
    ground: &Ground,
    key: &SecretKey,
    message: &Message,
    parameters: &Parameters,
) -> Result<Marked> {
    check_precision(table, ground, parameters)?;
    let patches = Patches::new(table, ground, parameters.patch_size)?;
    let carriers = patches.carriers(message.len(), parameters)?;
    let signs = parameters.code.encode(message);
    let job = Job { table, ground, carrier: Carrier::new(key), signs, carriers, parameters };
    let marked: Vec<MarkedPatch> = patches
        .as_slice()
        .par_iter()
        .enumerate()
        .map(|(number, patch)| job.mark(number, patch))
        .collect::<Result<_>>()?;
    check_message(message, parameters.code, &marked)?;

    let mut coords = vec![[0.0; 2]; table.len()];
    for (patch, marked) in patches.as_slice().iter().zip(&marked) {
        for (&v, &moved) in patch.vertices.iter().zip(&marked.coords) {
            coords[v as usize] = moved;
        }
    }
    let displacement = displacement(table, ground, &coords);
    Ok(Marked { coords, patches: patches.as_slice().len(), displacement })
}

struct Job<'a> {
    table: &'a VertexTable,
    ground: &'a Ground,
    carrier: Carrier,
    /// b′, the channel bits.
    signs: Vec<f64>,
    carriers: usize,
    parameters: &'a Parameters,
}

struct MarkedPatch {
    coords: Vec<[f64; 2]>,
    /// q_j, what the paper's detector sums for channel bit j in this patch.
    scores: Vec<f64>,
}

impl Job<'_> {
    fn mark(&self, number: usize, patch: &Patch) -> Result<MarkedPatch> {
        let basis = Basis::low_frequencies(patch, self.carriers + 1)?;
        let chips = [0, 1].map(|axis| self.carrier.chips(number, axis, self.carriers));
        let wanted = chips.each_ref().map(|chips| basis.synthesise(&self.coefficients(chips)));
        let place = |(v, &vertex): (usize, &u32)| {
            self.place(self.table.coords()[vertex as usize], [wanted[0][v], wanted[1][v]])
        };
        let coords: Vec<[f64; 2]> = patch.vertices.iter().enumerate().map(place).collect();
        Ok(MarkedPatch { scores: self.scores(patch, &basis, &chips, &coords), coords })
    }

    /// The coefficients that modulate the message: 0 for the mean, then α p_i b′_j.
    fn coefficients(&self, chips: &[f64]) -> Vec<f64> {
        let chip_rate = self.parameters.chip_rate;
        let modulated = chips.iter().enumerate().map(|(i, chip)| {
            self.parameters.amplitude_m * chip * self.signs[bit_of_coefficient(i + 1, chip_rate)]
        });
        std::iter::once(0.0).chain(modulated).collect()
    }

    /// Where a vertex that should move by `wanted_m` metres ends: within the tolerance, on the grid.
    fn place(&self, from: [f64; 2], wanted_m: [f64; 2]) -> [f64; 2] {
        let tolerance_m = self.parameters.tolerance_m;
        if self.ground.is_pinned(from, tolerance_m) {
            return from;
        }
        let scale = self.ground.metres_per_unit(from);
        let mut share = 1f64.min(tolerance_m / wanted_m[0].hypot(wanted_m[1]));
        loop {
            let target = [0, 1].map(|a| from[a] + share * wanted_m[a] / scale[a]);
            if let Some(precision) = self.parameters.precision {
                return nearest_node(target, from, scale, precision, tolerance_m);
            }
            if distance_m(from, target, scale) <= tolerance_m {
                return target;
            }
            share *= 1.0 - 1e-9; // the sum above was rounded past the tolerance
            if share < 0.5 {
                return from; // a coordinate so large that its last digit is worth more than the tolerance
            }
        }
    }

    fn scores(&self, patch: &Patch, basis: &Basis, chips: &[Vec<f64>; 2], coords: &[[f64; 2]]) -> Vec<f64> {
        let moved =
            |(&v, &to): (&u32, &[f64; 2])| self.ground.metres_between(self.table.coords()[v as usize], to);
        let moved: Vec<[f64; 2]> = patch.vertices.iter().zip(coords).map(moved).collect();
        let mut scores = vec![0.0; self.signs.len()];
        for (axis, chips) in chips.iter().enumerate() {
            let values: Vec<f64> = moved.iter().map(|d| d[axis]).collect();
            let coefficients = basis.analyse(&values);
            for (i, chip) in chips.iter().enumerate() {
                scores[bit_of_coefficient(i + 1, self.parameters.chip_rate)] += chip * coefficients[i + 1];
            }
        }
        scores
    }
}

fn distance_m(a: [f64; 2], b: [f64; 2], scale: [f64; 2]) -> f64 {
    ((b[0] - a[0]) * scale[0]).hypot((b[1] - a[1]) * scale[1])
}

/// The grid node nearest to `target` among those within the tolerance of `from`. `target` is within
/// the tolerance too, and the tolerance is at least a cell, so there is one less than √2 cells away.
fn nearest_node(
    target: [f64; 2],
    from: [f64; 2],
    scale: [f64; 2],
    precision: f64,
    tolerance_m: f64,
) -> [f64; 2] {
    // A node of PRECISION=0.1 is k / 10, the number that prints as one decimal; k × 0.1 is not.
    let per_unit = (1.0 / precision).round();
    let decimal = per_unit >= 1.0 && (per_unit * precision - 1.0).abs() < 1e-9;
    let node = |k: f64| if decimal { k / per_unit } else { k * precision };
    let index = |value: f64| if decimal { (value * per_unit).round() } else { (value / precision).round() };
    let nearest = target.map(|value| node(index(value)));
    if distance_m(from, nearest, scale) <= tolerance_m {
        return nearest;
    }
    let larger = scale[0].max(scale[1]);
    let around = |axis: usize| {
        let reach = (1.5 * larger / scale[axis]).ceil().min(1000.0);
        (0..=2 * reach as usize).map(move |step| node(index(target[axis]) - reach + step as f64))
    };
    around(0)
        .flat_map(|x| around(1).map(move |y| [x, y]))
        .filter(|&n| distance_m(from, n, scale) <= tolerance_m)
        .min_by(|&a, &b| distance_m(target, a, scale).total_cmp(&distance_m(target, b, scale)))
        .unwrap_or(from)
}

fn check_precision(table: &VertexTable, ground: &Ground, parameters: &Parameters) -> Result<()> {
    let Some(precision) = parameters.precision else { return Ok(()) };
    let (min, max) = table.bounds();
    // A degree of longitude is longest where the map comes nearest to the equator.
    let widest_y = if min[1] <= 0.0 && max[1] >= 0.0 { 0.0 } else { min[1].abs().min(max[1].abs()) };
    let scale = [min[1], max[1], widest_y].map(|y| ground.metres_per_unit([min[0], y]));
    let metres = precision * scale.iter().flatten().fold(0f64, |a, &b| a.max(b));
    if metres > parameters.tolerance_m {
        return Err(Error::PrecisionTooCoarse { precision, metres, tolerance_m: parameters.tolerance_m });
    }
    Ok(())
}

fn check_message(message: &Message, code: Code, marked: &[MarkedPatch]) -> Result<()> {
    let mut sums = vec![0.0; marked[0].scores.len()];
    for patch in marked {
        sums.iter_mut().zip(&patch.scores).for_each(|(sum, score)| *sum += score);
    }
    match code.decode(&sums).message.errors(message) {
        0 => Ok(()),
        errors => Err(Error::MessageLost { errors, bits: message.len() }),
    }
}

fn displacement(table: &VertexTable, ground: &Ground, coords: &[[f64; 2]]) -> Displacement {
    let moved = |(&from, &to): (&[f64; 2], &[f64; 2])| {
        let [dx, dy] = ground.metres_between(from, to);
        dx.hypot(dy)
    };
    let mut metres: Vec<f64> = table.coords().iter().zip(coords).map(moved).collect();
    metres.sort_unstable_by(f64::total_cmp);
    let last = metres.len() - 1;
    Displacement {
        rms_m: (metres.iter().map(|d| d * d).sum::<f64>() / metres.len() as f64).sqrt(),
        p99_m: metres[last * 99 / 100],
        max_m: metres[last],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_is_the_decimal_number_and_never_out_of_reach() {
        let scale = [1.0, 1.0];
        assert_eq!(nearest_node([0.26, 0.74], [0.31, 0.7], scale, 0.1, 0.75), [0.3, 0.7]);
        // The node nearest to the target is 0.8 away; the best one within 0.75 is taken.
        assert_eq!(nearest_node([0.6, 0.0], [0.2, 0.0], scale, 1.0, 0.75), [0.0, 0.0]);
    }
}
