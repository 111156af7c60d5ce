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
    key::SecretKey,
    part::{PartDigest, Parts},
    signs::{Sequence, Signs, is_pilot},
};

/// A marked map is refused when the score of its own recipient is below this many standard
/// deviations of those of others, p = 10⁻¹⁵.
pub(crate) const LEAST_SCORE: f64 = 8.0;

/// Returns the pilots of a key on the parts of a map.
pub fn pilots(key: &SecretKey, parts: &Parts) -> Sequence {
    of_parts(parts, |part| key.pilot_seed(part))
}

/// Returns the signs of a recipient under a key on the parts of a map, from which those of pilots are
/// unused.
pub fn recipient_signs(key: &SecretKey, parts: &Parts, recipient: &str) -> Sequence {
    of_parts(parts, |part| key.recipient_seed(part, recipient))
}

fn of_parts(parts: &Parts, seed: impl Fn(&PartDigest) -> [u8; 32]) -> Sequence {
    Sequence::of_parts(parts.as_slice().iter().map(|part| (part.first_patch, seed(&part.digest))))
}

/// The mark of a recipient: all its signs, pilots included.
#[derive(Clone)]
pub struct Fingerprint {
    /// The signs of the recipient.
    pub own: Sequence,
    pilots: Sequence,
}

impl Fingerprint {
    /// Derives the fingerprint of a recipient under a key on the parts of a map.
    pub fn new(key: &SecretKey, parts: &Parts, recipient: &str) -> Self {
        Fingerprint { own: recipient_signs(key, parts, recipient), pilots: pilots(key, parts) }
    }

    /// Returns the fingerprint on one part alone.
    pub(crate) fn part(&self, number: usize) -> Self {
        Fingerprint { own: self.own.part(number), pilots: self.pilots.part(number) }
    }
}

impl Signs for Fingerprint {
    fn signs(&self, patch: usize, axis: usize, count: usize) -> Vec<f64> {
        let [own, pilots] = [&self.own, &self.pilots].map(|signs| signs.signs(patch, axis, count));
        let chosen = |(i, (own, pilot))| if is_pilot(i + 1) { pilot } else { own };
        own.into_iter().zip(pilots).enumerate().map(chosen).collect()
    }
}

/// The pilots of a mark without the signs of its recipient, which are 0.
#[derive(Clone)]
pub struct PilotsAlone(pub Sequence);

impl Signs for PilotsAlone {
    fn signs(&self, patch: usize, axis: usize, count: usize) -> Vec<f64> {
        let pilots = self.0.signs(patch, axis, count).into_iter().enumerate();
        pilots.map(|(i, pilot)| if is_pilot(i + 1) { pilot } else { 0.0 }).collect()
    }
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

    fn part(x: f64) -> Parts {
        Parts::whole(&VertexTable::new(vec![[x, 2.0]]).unwrap())
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
