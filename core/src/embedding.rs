//! Embedding: the message becomes a small displacement of every vertex (paper, section 3.4).

use crate::{
    Error, Result,
    carrier::{Carrier, bit_of_coefficient},
    deformation::{Deformation, Prediction},
    demodulation::joint,
    distortion::{AngleChange, Displacement},
    key::SecretKey,
    map::Map,
    message::Message,
    nearness::VertexTree,
    options::{Parameters, Shape},
    patches::{Patch, Patches},
    placement::Placement,
    response::Response,
    spectrum::Basis,
    topology::{Settled, settle},
};
use rayon::prelude::*;

/// A marked map.
#[derive(Debug, Clone, PartialEq)]
pub struct Marked {
    /// The new place of every vertex, in canonical order, CRS units.
    pub coords: Vec<[f64; 2]>,
    /// How many patches carry the message.
    pub patches: usize,
    /// How far the vertices moved.
    pub displacement: Displacement,
    /// How much the angles at its corners changed.
    pub angles: AngleChange,
    /// How many vertices hang on a segment and moved with it.
    pub junctions: usize,
    /// How many vertices moved otherwise than the mark wanted, for the map to keep its topology.
    pub attenuated: usize,
}

/// So many patches are solved again to read the message back; only when it is not in them, all.
const READ_BACK_PATCHES: usize = 16;

/// Marks a map: Δ = E(α · p ∘ b′) on both axes of every patch, T-junctions kept, nothing pushed through a
/// segment, held within the tolerance and put on the output grid. The message is read back from the result
/// before it is returned.
///
/// # Errors
/// Everything of [`Patches::new`], [`Patches::carriers`], a PRECISION that is coarser than
/// TOLERANCE, and [`Error::MessageLost`].
pub fn embed(map: &Map, key: &SecretKey, message: &Message, parameters: &Parameters) -> Result<Marked> {
    let placement = Placement::new(map, parameters)?;
    let tree = VertexTree::of_all(map);
    let patches = Patches::with_tree(map, &tree, parameters)?;
    let carriers = patches.carriers(message.len(), parameters)?;
    let signs = parameters.code.encode(message);
    let job = Job { map, carrier: Carrier::new(key), signs, carriers, parameters };
    let settled = settle(map, &tree, patches.constraints(), &job.wanted(&patches)?, &placement);
    job.check_message(message, &patches, &settled)?;
    Ok(Marked {
        displacement: Displacement::between(map.vertices, &settled.coords, &map.ground),
        angles: AngleChange::at_corners(map, &settled.coords),
        coords: settled.coords,
        patches: patches.as_slice().len(),
        junctions: patches.constraints().junctions.hanging().len(),
        attenuated: settled.attenuated,
    })
}

struct Job<'a> {
    map: &'a Map<'a>,
    carrier: Carrier,
    /// b′, the channel bits.
    signs: Vec<f64>,
    carriers: usize,
    parameters: &'a Parameters,
}

/// A displacement is read back as if with this noise at least, metres.
const LEAST_NOISE_M: f64 = 0.01;

impl Job<'_> {
    /// The displacement that is the mark, of every vertex, CRS units.
    fn wanted(&self, patches: &Patches) -> Result<Vec<[f64; 2]>> {
        let all = patches.as_slice();
        let of_patch = |(number, patch): (usize, &Patch)| -> Result<Vec<[f64; 2]>> {
            let basis = Basis::low_frequencies(patch, self.carriers + 1)?;
            let gain = match self.parameters.shape {
                Shape::Free => 1.0,
                Shape::Rigid => {
                    Response::new(patch, basis.vectors.subcols(1, self.carriers).to_owned()).gain()
                }
            };
            let modulate = |chips: Vec<f64>| basis.synthesise(&self.coefficients(&chips, gain));
            let [x, y] = self.chips(number).map(modulate);
            let in_units = |((&vertex, x), y): ((&u32, f64), f64)| {
                let scale = self.map.ground.metres_per_unit(self.map.at(vertex));
                [x / scale[0], y / scale[1]]
            };
            Ok(patch.vertices.iter().zip(x).zip(y).map(in_units).collect())
        };
        let found: Vec<Vec<[f64; 2]>> = all.par_iter().enumerate().map(of_patch).collect::<Result<_>>()?;
        let mut wanted = vec![[0.0; 2]; self.map.vertices.len()];
        for (patch, found) in all.iter().zip(found) {
            for (&vertex, displacement) in patch.vertices.iter().zip(found) {
                wanted[vertex as usize] = displacement;
            }
        }
        Ok(wanted)
    }

    fn chips(&self, patch: usize) -> [Vec<f64>; 2] {
        [0, 1].map(|axis| self.carrier.chips(patch, axis, self.carriers))
    }

    /// The coefficients that modulate the message: 0 for the mean, then α p_i b′_j, amplified by `gain`.
    fn coefficients(&self, chips: &[f64], gain: f64) -> Vec<f64> {
        let chip_rate = self.parameters.chip_rate;
        let modulated = chips.iter().enumerate().map(|(i, chip)| {
            gain * self.parameters.amplitude_m * chip * self.signs[bit_of_coefficient(i + 1, chip_rate)]
        });
        std::iter::once(0.0).chain(modulated).collect()
    }

    /// Reads the message back as the verifier does, from as many patches as it takes.
    fn check_message(&self, message: &Message, patches: &Patches, settled: &Settled) -> Result<()> {
        let from = self.map.vertices.coords().iter();
        let moved = |(from, to): (&[f64; 2], &[f64; 2])| Some(self.map.ground.metres_between(*from, *to));
        let observed: Vec<Option<[f64; 2]>> = from.zip(&settled.coords).map(moved).collect();
        let [_, metres_per_unit] = self.map.ground.metres_per_unit(self.map.vertices.centre());
        let rounding_m = self.parameters.precision.unwrap_or(0.0) * metres_per_unit / 12f64.sqrt();
        let disturbance = Prediction {
            deformation: Deformation::none(rounding_m.hypot(settled.deviation_m).max(LEAST_NOISE_M)),
            displacement_m: Vec::new(),
            weights: vec![1.0; observed.len()],
        };
        let read = |count: usize| {
            let (patches, bits) = (patches.head(count), message.len());
            joint(&patches, &self.carrier, &observed, bits, self.parameters, &disturbance, &|_| ())
        };
        if read(READ_BACK_PATCHES)?.message() == *message {
            return Ok(());
        }
        match read(patches.as_slice().len())?.message().errors(message) {
            0 => Ok(()),
            errors => Err(Error::MessageLost { errors, bits: message.len() }),
        }
    }
}
