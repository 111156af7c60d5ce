//! Embedding: the message becomes a small displacement of every vertex (paper, section 3.4).

use crate::{
    Error, Result,
    carrier::Carrier,
    deformation::{Deformation, LEAST_NOISE_M, Prediction},
    demodulation::joint_solved,
    distortion::{AngleChange, Corner, Displacement},
    key::SecretKey,
    map::Map,
    message::Message,
    modulation::coefficients_m,
    nearness::VertexTree,
    options::{Parameters, Rigidity},
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
    /// How many vertices moved differently from the mark to keep the topology of the map.
    pub attenuated: usize,
}

/// The message is read back from this many patches, which are solved again; from all patches only
/// if that fails.
const READ_BACK_PATCHES: usize = 16;

/// The memory for the wanted displacements of a batch of messages, bytes: 16 for each vertex and
/// message.
const MOST_BATCH_BYTES: usize = 512 << 20;

/// Marks a map: Δ = E(α · p ∘ b′) on both axes of every patch. T-junctions stay, no vertex passes
/// through a segment, and every vertex stays within the tolerance and on the output grid. The
/// message is read back from the result before it is returned.
///
/// # Errors
/// Returns the errors of [`Embedding::new`] and [`Embedding::settle`].
pub fn embed(map: &Map, key: &SecretKey, message: &Message, parameters: &Parameters) -> Result<Marked> {
    let embedding = Embedding::new(map, key, message.len(), parameters)?;
    let wanted = embedding.wanted(std::slice::from_ref(message), &|_| ())?;
    embedding.settle(message, &wanted[0])
}

/// The part of a marking that does not depend on the message.
pub struct Embedding<'a> {
    map: &'a Map<'a>,
    placement: Placement<'a>,
    tree: VertexTree<'a>,
    patches: Patches,
    /// The bases of the first patches, when they are kept.
    bases: Vec<Basis>,
    carrier: Carrier,
    carriers: usize,
    parameters: &'a Parameters,
}

impl<'a> Embedding<'a> {
    /// Meshes the map and cuts it into patches, for messages of `bits` bits.
    ///
    /// # Errors
    /// Returns the errors of [`Patches::new`] and [`Patches::carriers`], and
    /// [`Error::PrecisionTooCoarse`].
    pub fn new(
        map: &'a Map<'a>,
        key: &SecretKey,
        bits: usize,
        parameters: &'a Parameters,
    ) -> Result<Embedding<'a>> {
        let placement = Placement::new(map, parameters)?;
        let tree = VertexTree::of_all(map);
        let patches = Patches::with_tree(map, &tree, parameters)?;
        let carriers = patches.carriers(bits, parameters)?;
        let (bases, carrier) = (Vec::new(), Carrier::new(key));
        Ok(Embedding { map, placement, tree, patches, bases, carrier, carriers, parameters })
    }

    /// Prepares for many messages: it solves once for the bases of the patches from which each
    /// message is read back, and keeps them.
    ///
    /// # Errors
    /// Fails on a patch that cannot be solved.
    pub fn for_many(mut self) -> Result<Self> {
        let first = self.patches.as_slice().par_iter().take(READ_BACK_PATCHES);
        let bases = first.map(|patch| Basis::low_frequencies(patch, self.carriers + 1));
        self.bases = bases.collect::<Result<_>>()?;
        Ok(self)
    }

    /// Returns how many patches there are.
    pub fn patches(&self) -> usize {
        self.patches.as_slice().len()
    }

    /// Returns how many messages, at least one, [`Self::wanted`] handles at once within its memory.
    pub fn batch(&self) -> usize {
        (MOST_BATCH_BYTES / (size_of::<[f64; 2]>() * self.map.vertices.len())).max(1)
    }

    /// Returns the displacements that are the marks, for every message those of all vertices, CRS
    /// units. Every patch is solved once for all messages, and its basis is not kept. `progress` is
    /// called once for every patch.
    ///
    /// # Errors
    /// Fails on a patch that cannot be solved.
    pub fn wanted(
        &self,
        messages: &[Message],
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<Vec<[f64; 2]>>> {
        let signs: Vec<Vec<f64>> = messages.iter().map(|m| self.parameters.code.encode(m)).collect();
        let all = self.patches.as_slice();
        // Blocks bound the displacements that are held twice.
        let block = 64 * rayon::current_num_threads();
        let mut wanted = vec![vec![[0.0; 2]; self.map.vertices.len()]; messages.len()];
        for (first, patches) in (0..all.len()).step_by(block).zip(all.chunks(block)) {
            let of_patch = |(i, patch)| {
                let found = self.wanted_of_patch(first + i, patch, &signs);
                progress(1);
                found
            };
            let found: Vec<Vec<Vec<[f64; 2]>>> =
                patches.par_iter().enumerate().map(of_patch).collect::<Result<_>>()?;
            for (patch, found) in patches.iter().zip(found) {
                for (wanted, found) in wanted.iter_mut().zip(found) {
                    let places = patch.vertices.iter().map(|&vertex| vertex as usize);
                    places.zip(found).for_each(|(vertex, displacement)| wanted[vertex] = displacement);
                }
            }
        }
        Ok(wanted)
    }

    /// Returns the displacements of the vertices of a patch for the signs b′ of every message, CRS
    /// units.
    fn wanted_of_patch(
        &self,
        number: usize,
        patch: &Patch,
        signs: &[Vec<f64>],
    ) -> Result<Vec<Vec<[f64; 2]>>> {
        let basis = Basis::known_or_solved(&self.bases, number, patch, self.carriers + 1)?;
        let gain = match self.parameters.shape {
            Rigidity::Free => 1.0,
            Rigidity::Rigid => {
                let carriers = basis.vectors.subcols(1, self.carriers);
                Response::new(patch, carriers.to_owned()).gain(patch, carriers.to_owned())
            }
        };
        let chips = self.chips(number);
        let in_units = |((&vertex, x), y): ((&u32, f64), f64)| {
            let scale = self.map.ground.metres_per_unit(self.map.at(vertex));
            [x / scale[0], y / scale[1]]
        };
        let of_message = |signs: &Vec<f64>| {
            let modulate = |chips| basis.synthesise(&self.coefficients(chips, signs, gain));
            let [x, y] = [0, 1].map(|axis| modulate(&chips[axis]));
            patch.vertices.iter().zip(x).zip(y).map(in_units).collect()
        };
        Ok(signs.iter().map(of_message).collect())
    }

    /// Marks the map with a message; `wanted` are its displacements.
    ///
    /// # Errors
    /// [`Error::MessageLost`].
    pub fn settle(&self, message: &Message, wanted: &[[f64; 2]]) -> Result<Marked> {
        let Embedding { map, patches, .. } = self;
        let settled = settle(map, &self.tree, patches.constraints(), wanted, &self.placement);
        self.check_message(message, &settled)?;
        Ok(Marked {
            displacement: Displacement::between(map.vertices, &settled.coords, &map.measure()),
            angles: AngleChange::at(&Corner::all(map, &settled.coords)),
            coords: settled.coords,
            patches: patches.as_slice().len(),
            junctions: patches.constraints().junctions.hanging().len(),
            attenuated: settled.attenuated,
        })
    }

    fn chips(&self, patch: usize) -> [Vec<f64>; 2] {
        [0, 1].map(|axis| self.carrier.chips(patch, axis, self.carriers))
    }

    /// Returns the coefficients of the message: 0 for the mean, then those that modulate it,
    /// amplified by `gain`.
    fn coefficients(&self, chips: &[f64], signs: &[f64], gain: f64) -> Vec<f64> {
        let modulated = coefficients_m(chips, signs, self.parameters);
        std::iter::once(0.0).chain(modulated.iter().map(|value| gain * value)).collect()
    }

    /// Reads the message back as the verifier does by default, from as many patches as it takes: by
    /// the joint demodulator, as the noise of the grid and of the constraints is known here. The
    /// driver reads a written file back by [`crate::demodulation::paper`], which needs no estimate
    /// of the noise that the digits of a format add.
    fn check_message(&self, message: &Message, settled: &Settled) -> Result<()> {
        let from = self.map.vertices.coords().iter();
        let moved = |(from, to): (&[f64; 2], &[f64; 2])| Some(self.map.ground.metres_between(*from, *to));
        let observed: Vec<Option<[f64; 2]>> = from.zip(&settled.coords).map(moved).collect();
        let [_, metres_per_unit] = self.map.ground.metres_per_unit(self.map.vertices.centre());
        let rounding_m = self.parameters.precision_crs_units.unwrap_or(0.0) * metres_per_unit / 12f64.sqrt();
        let disturbance = Prediction {
            deformation: Deformation::none(rounding_m.hypot(settled.deviation_m).max(LEAST_NOISE_M)),
            displacement_m: Vec::new(),
            weights: vec![1.0; observed.len()],
        };
        let read = |count: usize| {
            let (patches, bits) = (self.patches.head(count), message.len());
            let from = (&patches, &self.bases[..]);
            joint_solved(from, &self.carrier, &observed, bits, self.parameters, &disturbance)
        };
        if read(READ_BACK_PATCHES)?.message() == *message {
            return Ok(());
        }
        match read(self.patches())?.message().errors(message) {
            0 => Ok(()),
            errors => Err(Error::MessageLost { errors, bits: message.len() }),
        }
    }
}
