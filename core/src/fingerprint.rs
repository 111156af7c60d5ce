//! The fingerprint of a recipient: secret signs that only the key can make, one for every
//! coefficient of a part.
//!
//! Every eighth coefficient is a *pilot*: its sign is that of the key alone and the same in all
//! copies of a part, so that a mark of the key shows when its recipient is unknown, and in an
//! average of any number of copies. All other signs belong to one recipient. Each axis has signs of
//! its own: for the same displacement they give twice as many signs as one for both would, and a
//! mixture of copies has fewer than signs divided by copies to tell them apart by.

pub use crate::signs::COEFFICIENTS;

use crate::{
    Error, Result,
    agreement::Evidence,
    embedding::{Groundwork, Marked},
    estimation::Estimates,
    key::SecretKey,
    map::Map,
    options::Parameters,
    part::PartDigest,
    patches::Patches,
    signs::{Sequence, Signs, is_pilot},
};

/// A marked map is refused when the score of its own recipient is below this many standard
/// deviations of those of others, p = 10⁻¹⁵.
const LEAST_SCORE: f64 = 8.0;

/// Returns the pilots of a key on a part.
pub fn pilots(key: &SecretKey, part: &PartDigest) -> Sequence {
    Sequence::new(key.pilot_seed(part))
}

/// Returns the signs of a recipient under a key on a part, from which those of pilots are unused.
pub fn recipient_signs(key: &SecretKey, part: &PartDigest, recipient: &str) -> Sequence {
    Sequence::new(key.recipient_seed(part, recipient))
}

/// The mark of a recipient: all its signs, pilots included.
#[derive(Clone, Copy)]
pub struct Fingerprint {
    /// The signs of the recipient.
    pub own: Sequence,
    pilots: Sequence,
}

impl Fingerprint {
    /// Derives the fingerprint of a recipient under a key on a part.
    pub fn new(key: &SecretKey, part: &PartDigest, recipient: &str) -> Self {
        Fingerprint { own: recipient_signs(key, part, recipient), pilots: pilots(key, part) }
    }
}

impl Signs for Fingerprint {
    fn signs(&self, patch: usize, axis: usize, count: usize) -> Vec<f64> {
        let [own, pilots] = [self.own, self.pilots].map(|signs| signs.signs(patch, axis, count));
        let chosen = |(i, (own, pilot))| if is_pilot(i + 1) { pilot } else { own };
        own.into_iter().zip(pilots).enumerate().map(chosen).collect()
    }
}

/// The pilots of a mark without the signs of its recipient, which are 0.
#[derive(Clone, Copy)]
pub struct PilotsAlone(pub Sequence);

impl Signs for PilotsAlone {
    fn signs(&self, patch: usize, axis: usize, count: usize) -> Vec<f64> {
        let pilots = self.0.signs(patch, axis, count).into_iter().enumerate();
        pilots.map(|(i, pilot)| if is_pilot(i + 1) { pilot } else { 0.0 }).collect()
    }
}

/// The part of a marking for recipients that does not depend on the recipient.
pub struct FingerprintEmbedding<'a> {
    groundwork: Groundwork<'a>,
    key: &'a SecretKey,
    part: PartDigest,
}

impl<'a> FingerprintEmbedding<'a> {
    /// Meshes the map and cuts it into patches, for fingerprints of `coefficients` coefficients of
    /// every patch and axis.
    ///
    /// # Errors
    /// Returns the errors of [`Patches::new`] and [`Patches::check_room`], and
    /// [`Error::PrecisionTooCoarse`].
    pub fn new(
        map: &'a Map<'a>,
        key: &'a SecretKey,
        coefficients: usize,
        parameters: &'a Parameters,
    ) -> Result<Self> {
        let room = |patches: &Patches| patches.check_room(coefficients);
        let groundwork = Groundwork::new(map, parameters, room)?;
        Ok(FingerprintEmbedding { groundwork, key, part: PartDigest::of(map.vertices) })
    }

    /// Prepares for many recipients: it solves once for the bases of the patches from which each
    /// fingerprint is read back, and keeps them.
    ///
    /// # Errors
    /// Fails on a patch that cannot be solved.
    pub fn for_many(self) -> Result<Self> {
        Ok(FingerprintEmbedding { groundwork: self.groundwork.for_many()?, ..self })
    }

    /// Returns the name of the part, which is the whole map.
    pub fn part(&self) -> PartDigest {
        self.part
    }

    /// Returns how many patches there are.
    pub fn patches(&self) -> usize {
        self.groundwork.patches.as_slice().len()
    }

    /// Returns how many recipients, at least one, [`Self::wanted`] handles at once within its
    /// memory.
    pub fn batch(&self) -> usize {
        self.groundwork.batch()
    }

    /// Returns the fingerprint of a recipient on this map.
    pub fn fingerprint(&self, recipient: &str) -> Fingerprint {
        Fingerprint::new(self.key, &self.part, recipient)
    }

    /// Returns the displacements that are the marks, for every fingerprint those of all vertices,
    /// CRS units. Every patch is solved once for all. `progress` is called once for every patch.
    ///
    /// # Errors
    /// Fails on a patch that cannot be solved.
    pub fn wanted(
        &self,
        fingerprints: &[Fingerprint],
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<Vec<[f64; 2]>>> {
        self.groundwork.wanted(fingerprints, progress)
    }

    /// Marks the map with a fingerprint; `wanted` are its displacements. The fingerprint is read
    /// back from the result, from as many patches as it takes.
    ///
    /// # Errors
    /// [`Error::FingerprintLost`].
    pub fn settle(&self, fingerprint: &Fingerprint, wanted: &[[f64; 2]]) -> Result<Marked> {
        let Groundwork { bases, parameters, coefficients, .. } = &self.groundwork;
        let settled = self.groundwork.settle(wanted);
        let (observed, disturbance) = self.groundwork.seen(&settled);
        let read = |patches: &Patches| {
            let (from, observed) = ((patches.into(), &bases[..]), &observed[..]);
            Estimates::with_bases(from, observed, *coefficients, parameters, &disturbance, &|_| ())
        };
        let score = |seen: Estimates| Evidence::of_recipients(&seen).agreement(&fingerprint.own).score;
        if score(read(&self.groundwork.first_patches())?) < LEAST_SCORE {
            check_score(score(read(&self.groundwork.patches)?))?;
        }
        Ok(self.groundwork.marked(settled))
    }
}

/// Marks a map for a recipient: Δ = E (α s) on both axes of every patch, under the constraints of
/// [`crate::embedding::embed`].
///
/// # Errors
/// Returns the errors of [`FingerprintEmbedding::new`] and [`FingerprintEmbedding::settle`].
pub fn embed(
    map: &Map,
    key: &SecretKey,
    recipient: &str,
    coefficients: usize,
    parameters: &Parameters,
) -> Result<Marked> {
    let embedding = FingerprintEmbedding::new(map, key, coefficients, parameters)?;
    let fingerprint = embedding.fingerprint(recipient);
    let wanted = embedding.wanted(&[fingerprint], &|_| ())?;
    embedding.settle(&fingerprint, &wanted[0])
}

/// Fails unless the score of its recipient shows that a copy can be recognised.
///
/// # Errors
/// [`Error::FingerprintLost`].
pub fn check_score(score: f64) -> Result<()> {
    if score < LEAST_SCORE { Err(Error::FingerprintLost { score, least: LEAST_SCORE }) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{signs::PILOT_EVERY, vertices::VertexTable};

    fn part(x: f64) -> PartDigest {
        PartDigest::of(&VertexTable::new(vec![[x, 2.0]]).unwrap())
    }

    fn agreement(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / (a.len() as f64).sqrt()
    }

    #[test]
    fn recipients_parts_keys_patches_and_axes_have_signs_of_their_own() {
        const COUNT: usize = 8000;
        let keys = [1, 2].map(|byte| SecretKey::from_bytes([byte; 32]));
        let of = |key: usize, x: f64, recipient: &str, patch: usize, axis: usize| {
            Fingerprint::new(&keys[key], &part(x), recipient).signs(patch, axis, COUNT)
        };
        let own = |signs: Vec<f64>| -> Vec<f64> {
            signs.into_iter().enumerate().filter(|(i, _)| !is_pilot(i + 1)).map(|(_, sign)| sign).collect()
        };
        let acme = own(of(0, 1.0, "ACME", 3, 0));
        assert_eq!(acme, own(of(0, 1.0, "ACME", 3, 0)));
        assert!(acme.iter().sum::<f64>().abs() < 5.0 * (acme.len() as f64).sqrt());
        for other in [
            of(1, 1.0, "ACME", 3, 0),
            of(0, 1.5, "ACME", 3, 0),
            of(0, 1.0, "ACME ", 3, 0),
            of(0, 1.0, "", 3, 0),
            of(0, 1.0, "ACME", 4, 0),
            of(0, 1.0, "ACME", 3, 1),
        ] {
            assert!(agreement(&acme, &own(other)).abs() < 5.0);
        }
    }

    #[test]
    fn pilots_are_those_of_the_key_and_part_and_equal_for_all_recipients() {
        let keys = [1, 2].map(|byte| SecretKey::from_bytes([byte; 32]));
        let pilots = |key: usize, x: f64, recipient: &str| -> Vec<f64> {
            let signs = Fingerprint::new(&keys[key], &part(x), recipient).signs(0, 0, 8000);
            signs.into_iter().skip(PILOT_EVERY - 1).step_by(PILOT_EVERY).collect()
        };
        let acme = pilots(0, 1.0, "ACME");
        assert_eq!((acme.len(), &acme), (1000, &pilots(0, 1.0, "Other Ltd")));
        for other in [pilots(1, 1.0, "ACME"), pilots(0, 1.5, "ACME")] {
            assert!(agreement(&acme, &other).abs() < 5.0);
        }
    }
}
