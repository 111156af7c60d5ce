//! Embedding: the message becomes a small displacement of every vertex (paper, section 3.4).

use crate::{
    Error, Result,
    carrier::Carrier,
    deformation::{LEAST_NOISE_M, Prediction},
    demodulation::joint_solved,
    distortion::{AngleChange, Corner, Displacement},
    key::SecretKey,
    map::Map,
    message::Message,
    modulation::SpreadMessage,
    nearness::VertexTree,
    options::{AmplitudeOf, Parameters, Rigidity},
    patches::{Patch, Patches},
    placement::Placement,
    response::Response,
    signs::Signs,
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
    /// How many vertices carry no sign, as their part has too few free vertices for a patch, or these lie on
    /// one line.
    pub signless: usize,
}

impl Marked {
    /// Describes a map that was marked, given its number of patches and of hanging vertices; all vertices
    /// carry signs.
    pub(crate) fn new(map: &Map, settled: Settled, (patches, junctions): (usize, usize)) -> Self {
        Marked {
            displacement: Displacement::between(map.vertices, &settled.coords, map.measure),
            angles: AngleChange::at(&Corner::all(map, &settled.coords)),
            coords: settled.coords,
            patches,
            junctions,
            attenuated: settled.attenuated,
            signless: 0,
        }
    }
}

/// A mark is read back from this many patches, which are solved again; from all patches only if
/// that fails.
pub(crate) const READ_BACK_PATCHES: usize = 16;

/// The memory for the displacements or places of a batch of marks, bytes: 16 for each vertex and mark.
const MOST_BATCH_BYTES: usize = 512 << 20;

/// Returns how many marks of so many vertices, at least one, are handled at once.
pub(crate) fn batch_of(vertices: usize) -> usize {
    (MOST_BATCH_BYTES / (size_of::<[f64; 2]>() * vertices)).max(1)
}

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
    groundwork: Groundwork<'a>,
    carrier: Carrier,
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
        let groundwork = Groundwork::new(*map, parameters, |patches| patches.carriers(bits, parameters))?;
        Ok(Embedding { groundwork, carrier: Carrier::new(key) })
    }

    /// Prepares for many messages: it solves once for the bases of the patches from which each
    /// message is read back, and keeps them.
    ///
    /// # Errors
    /// Fails on a patch that cannot be solved.
    pub fn for_many(self) -> Result<Self> {
        Ok(Embedding { groundwork: self.groundwork.for_many(READ_BACK_PATCHES)?, ..self })
    }

    /// Returns how many patches there are.
    pub fn patches(&self) -> usize {
        self.groundwork.patches.as_slice().len()
    }

    /// Returns how many messages, at least one, [`Self::wanted`] handles at once within its memory.
    pub fn batch(&self) -> usize {
        self.groundwork.batch()
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
        let spread = |message| SpreadMessage::new(&self.carrier, message, self.groundwork.parameters);
        self.groundwork.wanted(&messages.iter().map(spread).collect::<Vec<_>>(), progress)
    }

    /// Marks the map with a message; `wanted` are its displacements.
    ///
    /// # Errors
    /// [`Error::MessageLost`].
    pub fn settle(&self, message: &Message, wanted: &[[f64; 2]]) -> Result<Marked> {
        let settled = self.groundwork.settle(wanted);
        self.check_message(message, &settled)?;
        let hanging = self.groundwork.patches.constraints().junctions.hanging().len();
        Ok(Marked::new(&self.groundwork.map, settled, (self.patches(), hanging)))
    }

    /// Reads the message back as the verifier does by default, from as many patches as it takes: by
    /// the joint demodulator, as the noise of the grid and of the constraints is known here. The
    /// driver reads a written file back by [`crate::demodulation::paper`], which needs no estimate
    /// of the noise that the digits of a format add.
    fn check_message(&self, message: &Message, settled: &Settled) -> Result<()> {
        let Groundwork { bases, parameters, .. } = &self.groundwork;
        let places = |vertex: usize| Some(settled.coords[vertex]);
        let (observed, disturbance) = self.groundwork.seen(places, settled.deviation_m);
        let read = |patches: Patches| {
            let (from, bits) = ((&patches, &bases[..]), message.len());
            joint_solved(from, &self.carrier, &observed, bits, parameters, &disturbance)
        };
        if read(self.groundwork.patches.head(READ_BACK_PATCHES))?.message() == *message {
            return Ok(());
        }
        match read(self.groundwork.patches.clone())?.message().errors(message) {
            0 => Ok(()),
            errors => Err(Error::MessageLost { errors, bits: message.len() }),
        }
    }
}

/// The part of a marking that does not depend on what the mark carries.
pub(crate) struct Groundwork<'a> {
    pub map: Map<'a>,
    placement: Placement<'a>,
    tree: VertexTree<'a>,
    pub patches: Patches,
    /// The bases of the first patches, when they are kept.
    pub bases: Vec<Basis>,
    /// Coefficients of a patch and axis that carry the mark.
    pub coefficients: usize,
    pub parameters: &'a Parameters,
}

impl<'a> Groundwork<'a> {
    /// Meshes the map and cuts it into patches, of which `coefficients` returns how many
    /// coefficients carry the mark.
    pub fn new(
        map: Map<'a>,
        parameters: &'a Parameters,
        coefficients: impl FnOnce(&Patches) -> Result<usize>,
    ) -> Result<Self> {
        let placement = Placement::new(&map, parameters)?;
        let tree = VertexTree::of_all(&map);
        let patches = Patches::with_tree(&map, &tree, parameters)?;
        let coefficients = coefficients(&patches)?;
        Ok(Groundwork { map, placement, tree, patches, bases: Vec::new(), coefficients, parameters })
    }

    /// Solves for the bases of the first patches, from which each mark is read back first, and keeps
    /// them.
    pub fn for_many(mut self, read_back: usize) -> Result<Self> {
        let first = self.patches.as_slice().par_iter().take(read_back);
        let bases = first.map(|patch| Basis::low_frequencies(patch, self.coefficients + 1));
        self.bases = bases.collect::<Result<_>>()?;
        Ok(self)
    }

    /// Returns how many marks, at least one, [`Self::wanted`] handles at once within its memory.
    pub fn batch(&self) -> usize {
        batch_of(self.map.vertices.len())
    }

    /// Returns the displacements that are the marks, for the signs of each those of all vertices,
    /// CRS units. Every patch is solved once for all marks, and its basis is not kept. `progress`
    /// is called once for every patch.
    pub fn wanted<S: Signs>(
        &self,
        marks: &[S],
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<Vec<[f64; 2]>>> {
        let all = self.patches.as_slice();
        // Blocks bound the displacements that are held twice.
        let block = 64 * rayon::current_num_threads();
        let mut wanted = vec![vec![[0.0; 2]; self.map.vertices.len()]; marks.len()];
        for (first, patches) in (0..all.len()).step_by(block).zip(all.chunks(block)) {
            let of_patch = |(i, patch)| {
                let found = self.wanted_of_patch(first + i, patch, marks);
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

    /// Returns the displacements of the vertices of a patch for the signs of every mark, CRS units.
    fn wanted_of_patch<S: Signs>(
        &self,
        number: usize,
        patch: &Patch,
        marks: &[S],
    ) -> Result<Vec<Vec<[f64; 2]>>> {
        let basis = Basis::known_or_solved(&self.bases, number, patch, self.coefficients + 1)?;
        let in_units = |(&vertex, [x, y]): (&u32, [f64; 2])| {
            let scale = self.map.ground.metres_per_unit(self.map.at(vertex));
            [x / scale[0], y / scale[1]]
        };
        let synthesis = Synthesis::new(patch, &basis, self.parameters);
        let of_mark = |mark: &S| {
            let of_axis = |axis| -> Vec<f64> {
                let signs = mark.signs(number, axis, self.coefficients).into_iter();
                signs.map(|sign| self.parameters.amplitude_m * sign).collect()
            };
            let displacements_m = synthesis.displacements_m(&[0, 1].map(of_axis));
            patch.vertices.iter().zip(displacements_m).map(in_units).collect()
        };
        Ok(marks.iter().map(of_mark).collect())
    }

    /// Returns the places of the vertices that are displaced as wanted, as far as the constraints
    /// allow.
    pub fn settle(&self, wanted: &[[f64; 2]]) -> Settled {
        settle(&self.map, &self.tree, (self.patches.constraints(), &[]), wanted, &self.placement)
    }

    /// Returns the displacements of the vertices to their places, metres, and their noise, which is
    /// that of the grid and of the constraints. A vertex without a place was not found.
    pub fn seen(
        &self,
        places: impl Fn(usize) -> Option<[f64; 2]>,
        deviation_m: f64,
    ) -> (Vec<Option<[f64; 2]>>, Prediction) {
        let from = self.map.vertices.coords().iter().enumerate();
        let moved = |(v, from): (usize, &[f64; 2])| Some(self.map.ground.metres_between(*from, places(v)?));
        let observed: Vec<Option<[f64; 2]>> = from.map(moved).collect();
        let [_, metres_per_unit] = self.map.ground.metres_per_unit(self.map.vertices.centre());
        let rounding_m = self.parameters.precision_crs_units.unwrap_or(0.0) * metres_per_unit / 12f64.sqrt();
        let noise_m = rounding_m.hypot(deviation_m).max(LEAST_NOISE_M);
        let disturbance = Prediction::of_noise(noise_m, observed.len());
        (observed, disturbance)
    }
}

/// What makes displacements of coefficients.
enum Synthesis<'a> {
    /// The basis alone, from which [`settle`] makes those of bodies and hanging vertices: the last
    /// bits of marks of messages depend on this order.
    Basis { basis: &'a Basis, gain: f64 },
    /// The response, with all constraints.
    Response(Box<Response>),
}

impl<'a> Synthesis<'a> {
    fn new(patch: &Patch, basis: &'a Basis, parameters: &Parameters) -> Self {
        let carriers = || basis.vectors.subcols(1, basis.vectors.ncols() - 1).to_owned();
        match (parameters.amplitude_of, parameters.shape) {
            (AmplitudeOf::Coefficient, Rigidity::Free) => Synthesis::Basis { basis, gain: 1.0 },
            (AmplitudeOf::Coefficient, Rigidity::Rigid) => {
                let gain = Response::new(patch, carriers()).gain(patch, carriers());
                Synthesis::Basis { basis, gain }
            }
            _ => Synthesis::Response(Box::new(Response::carriers(patch, basis, parameters))),
        }
    }

    /// Returns the displacements of all rows, metres, by the coefficients of either axis.
    fn displacements_m(&self, coefficients: &[Vec<f64>; 2]) -> Vec<[f64; 2]> {
        match self {
            Synthesis::Response(response) => response.synthesise(coefficients),
            Synthesis::Basis { basis, gain } => {
                let [x, y] = coefficients.each_ref().map(|values| {
                    let amplified = values.iter().map(|value| gain * value);
                    // Coefficient 0 is the mean.
                    basis.synthesise(&std::iter::once(0.0).chain(amplified).collect::<Vec<_>>())
                });
                x.into_iter().zip(y).map(|(x, y)| [x, y]).collect()
            }
        }
    }
}
