//! Modulation: a message as the displacement of every vertex, constraints included.

use crate::{
    Result,
    carrier::{Carrier, bit_of_coefficient},
    message::Message,
    options::Parameters,
    patches::{Patch, Patches},
    response::Response,
    signs::Signs,
    spectrum::Basis,
};
use rayon::prelude::*;

/// A message as signs: p_i b′_j for every chip of the carrier.
pub struct SpreadMessage<'a> {
    carrier: &'a Carrier,
    /// The channel bits b′.
    bits: Vec<f64>,
    chip_rate: usize,
}

impl<'a> SpreadMessage<'a> {
    /// Codes and spreads a message.
    pub fn new(carrier: &'a Carrier, message: &Message, parameters: &Parameters) -> Self {
        SpreadMessage { carrier, bits: parameters.code.encode(message), chip_rate: parameters.chip_rate }
    }
}

impl Signs for SpreadMessage<'_> {
    fn signs(&self, patch: usize, axis: usize, count: usize) -> Vec<f64> {
        let chips = self.carrier.chips(patch, axis, count).into_iter().enumerate();
        chips.map(|(i, chip)| chip * self.bits[bit_of_coefficient(i + 1, self.chip_rate)]).collect()
    }
}

/// Returns the displacements by marks of full amplitude, metres, for each those of all vertices in
/// canonical order: α times the signs of `coefficients` coefficients on both axes of every patch.
/// Every patch is solved once for all marks. T-junctions and bodies follow as in
/// [`crate::embedding`]; tolerance, grid and the neighbourhood of a vertex are not considered.
///
/// # Errors
/// Fails when a patch cannot be solved.
pub fn displacements_m<S: Signs>(
    patches: &Patches,
    marks: &[S],
    coefficients: usize,
    parameters: &Parameters,
) -> Result<Vec<Vec<[f64; 2]>>> {
    let of_patch = |(number, patch): (usize, &Patch)| -> Result<Vec<Vec<[f64; 2]>>> {
        let basis = Basis::low_frequencies(patch, coefficients + 1)?;
        let response = Response::carriers(patch, &basis, parameters);
        let of_mark = |mark: &S| {
            response.synthesise(&[0, 1].map(|axis| {
                let signs = mark.signs(number, axis, coefficients);
                signs.iter().map(|sign| parameters.amplitude_m * sign).collect()
            }))
        };
        Ok(marks.iter().map(of_mark).collect())
    };
    let each = patches.as_slice().par_iter().enumerate().map(of_patch).collect::<Result<Vec<_>>>()?;
    let mut all = vec![vec![[0.0; 2]; patches.vertex_count()]; marks.len()];
    for (patch, of_marks) in patches.as_slice().iter().zip(each) {
        let own: Vec<_> =
            patch.vertices.iter().enumerate().filter(|(row, _)| !patch.hangs_elsewhere(*row)).collect();
        for (all, displacements) in all.iter_mut().zip(of_marks) {
            own.iter().for_each(|(row, vertex)| all[**vertex as usize] = displacements[*row]);
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        embedding::embed,
        ground::Ground,
        key::SecretKey,
        map_data::{ChainKind, MapData},
        options::Rigidity,
    };

    /// Houses of four corners on a grid.
    fn town() -> MapData {
        let corner = |i: usize| [[0.0, 0.0], [9.0, 0.0], [9.0, 7.0], [0.0, 7.0], [0.0, 0.0]][i % 5];
        let house = |i: usize| [(i / 5 % 20 * 20 + i / 5 % 7) as f64, (i / 100 * 20 + i / 5 % 3) as f64];
        let coords = (0..1500).map(|i| [0, 1].map(|axis| corner(i)[axis] + house(i)[axis])).collect();
        let starts: Vec<u32> = (0..1500).step_by(5).collect();
        MapData::from_chains(coords, &starts, vec![ChainKind::Shell; 300]).unwrap().0
    }

    #[test]
    fn a_mark_moves_vertices_as_its_modulation_does() {
        let town = town();
        let map = town.on(&Ground::METRES, &Ground::METRES);
        let (key, message) = (SecretKey::from_bytes([4; 32]), Message::from_bytes(&[0x5a; 16]));
        // A body turns by an angle, which the response takes as its sine.
        for (shape, most_m) in [(Rigidity::Free, 1e-9), (Rigidity::Rigid, 5e-3), (Rigidity::Stiff, 5e-3)] {
            let parameters = Parameters { shape, ..Parameters::default() };
            let patches = Patches::new(&map, &parameters).unwrap();
            let carrier = Carrier::new(&key);
            let signs = SpreadMessage::new(&carrier, &message, &parameters);
            let carriers = patches.carriers(message.len(), &parameters).unwrap();
            let planned = displacements_m(&patches, &[signs], carriers, &parameters).unwrap();
            let planned = &planned[0];
            let marked = embed(&map, &key, &message, &parameters).unwrap();
            let miss = |((from, to), by): ((&[f64; 2], &[f64; 2]), &[f64; 2])| {
                (to[0] - from[0] - by[0]).hypot(to[1] - from[1] - by[1])
            };
            let each = town.vertices.coords().iter().zip(&marked.coords).zip(planned).map(miss);
            let missed = each.filter(|miss| *miss > most_m).count();
            assert!(missed <= marked.attenuated, "{shape:?} {missed} {}", marked.attenuated);
        }
    }
}
