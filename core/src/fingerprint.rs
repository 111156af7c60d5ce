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
    constraints::Constraints,
    embedding::{Groundwork, Marked},
    estimation::Estimates,
    fingerprint_record::PartEntry,
    key::SecretKey,
    part::{PartDigest, Parts, PlacedPart},
    patches::Patches,
    series::Series,
    signs::{Sequence, Signs, is_pilot},
    topology::Settled,
};
use std::borrow::Cow;

/// A marked map is refused when the score of its own recipient is below this many standard
/// deviations of those of others, p = 10⁻¹⁵.
const LEAST_SCORE: f64 = 8.0;

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
    fn part(&self, number: usize) -> Self {
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

/// The part of a marking for recipients that does not depend on the recipient.
pub struct FingerprintEmbedding<'a> {
    series: &'a Series<'a>,
    works: Vec<PartWork<'a>>,
    key: &'a SecretKey,
    parts: Parts,
}

/// Chooses patches of a part.
type Chosen = for<'g, 'a> fn(&'g Groundwork<'a>) -> Cow<'g, Patches>;

/// A part of a series.
struct PartWork<'a> {
    /// The number of its edition.
    edition: usize,
    groundwork: Groundwork<'a>,
}

impl<'a> FingerprintEmbedding<'a> {
    /// Meshes the newest map of a series, and what its bases had, and cuts them into patches, for
    /// fingerprints of `coefficients` coefficients of every patch and axis.
    ///
    /// # Errors
    /// Returns the errors of [`Patches::new`] and [`Patches::check_room`], and
    /// [`Error::PrecisionTooCoarse`].
    pub fn new(series: &'a Series<'a>, key: &'a SecretKey, coefficients: usize) -> Result<Self> {
        let room = |patches: &Patches| patches.check_room(coefficients);
        let parts = series.parts(|part| Groundwork::new(part, series.parameters(), room))?;
        let works = parts.into_iter().map(|(edition, _, groundwork)| PartWork { edition, groundwork });
        let works: Vec<PartWork> = works.collect();
        let named = works.iter().map(|PartWork { groundwork, .. }| {
            (PartDigest::new(groundwork.map.vertices), groundwork.patches.as_slice().len())
        });
        let parts = Parts::in_turn(named);
        Ok(FingerprintEmbedding { series, works, key, parts })
    }

    /// Prepares for many recipients: it solves once for the bases of the patches from which each
    /// fingerprint is read back, and keeps them.
    ///
    /// # Errors
    /// Fails on a patch that cannot be solved.
    pub fn for_many(self) -> Result<Self> {
        let prepare = |work: PartWork<'a>| Ok(PartWork { groundwork: work.groundwork.for_many()?, ..work });
        Ok(FingerprintEmbedding {
            works: self.works.into_iter().map(prepare).collect::<Result<_>>()?,
            ..self
        })
    }

    /// Returns the parts of the series.
    pub fn parts(&self) -> &Parts {
        &self.parts
    }

    /// Returns the parts of the series for its record.
    pub fn part_entries(&self) -> Vec<PartEntry> {
        let entry = |(part, work): (&PlacedPart, &PartWork)| PartEntry {
            sha256: part.digest,
            vertices: work.groundwork.map.vertices.len(),
            patches: work.groundwork.patches.as_slice().len(),
        };
        self.parts.as_slice().iter().zip(&self.works).map(entry).collect()
    }

    /// Returns how many patches there are.
    pub fn patches(&self) -> usize {
        self.works.iter().map(|work| work.groundwork.patches.as_slice().len()).sum()
    }

    /// Returns how many recipients, at least one, [`Self::wanted`] handles at once within its
    /// memory.
    pub fn batch(&self) -> usize {
        let batches = self.works.iter().map(|work| work.groundwork.batch());
        batches.min().map_or(1, |least| (least / self.works.len()).max(1))
    }

    /// Returns the fingerprint of a recipient on this map.
    pub fn fingerprint(&self, recipient: &str) -> Fingerprint {
        Fingerprint::new(self.key, &self.parts, recipient)
    }

    /// Returns the displacements that are the marks, for every fingerprint those of the vertices of
    /// all parts, part after part, CRS units. Every patch is solved once for all. `progress` is
    /// called once for every patch.
    ///
    /// # Errors
    /// Fails on a patch that cannot be solved.
    pub fn wanted(
        &self,
        fingerprints: &[Fingerprint],
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<Vec<[f64; 2]>>> {
        let mut wanted = vec![Vec::new(); fingerprints.len()];
        for (number, work) in self.works.iter().enumerate() {
            let of_part: Vec<Fingerprint> = fingerprints.iter().map(|all| all.part(number)).collect();
            let found = work.groundwork.wanted(&of_part, progress)?;
            wanted.iter_mut().zip(found).for_each(|(all, found)| all.extend(found));
        }
        Ok(wanted)
    }

    /// Marks the newest map with a fingerprint; `wanted` are its displacements. The fingerprint is
    /// read back from the result, from as many patches as it takes.
    ///
    /// # Errors
    /// [`Error::FingerprintLost`].
    pub fn settle(&self, fingerprint: &Fingerprint, wanted: &[[f64; 2]]) -> Result<Marked> {
        let settled = self.settle_all(wanted);
        let newest = settled.last().expect("a series has an edition");
        let deviations: Vec<f64> = self.works.iter().map(|work| settled[work.edition].deviation_m).collect();
        let score = |patches: Chosen| {
            self.score_on(fingerprint, &newest.coords, |number| deviations[number], patches)
        };
        if score(|work| Cow::Owned(work.first_patches()))? < LEAST_SCORE {
            check_score(score(|work| Cow::Borrowed(&work.patches))?)?;
        }
        let of_whole = || self.works.last().map(|work| work.groundwork.patches.constraints());
        let hanging = |constraints: &Constraints| constraints.junctions.hanging().len();
        let hanging = self.series.hanging().or_else(|| of_whole().map(hanging)).unwrap_or(0);
        let map = self.series.map();
        let newest = settled.into_iter().next_back().expect("a series has an edition");
        Ok(Marked::new(&map, newest, (self.patches(), hanging)))
    }

    /// Returns the score of a fingerprint on the newest map whose vertices have these places, with
    /// noise of this standard deviation, metres.
    ///
    /// # Errors
    /// Fails on a patch that cannot be solved.
    pub fn score(&self, fingerprint: &Fingerprint, places: &[[f64; 2]], noise_m: f64) -> Result<f64> {
        self.score_on(fingerprint, places, |_| noise_m, |work| Cow::Borrowed(&work.patches))
    }

    /// Moves all editions, one after the other.
    fn settle_all(&self, wanted: &[[f64; 2]]) -> Vec<Settled> {
        let mut settled: Vec<Settled> = Vec::new();
        let mut works = self.works.iter().peekable();
        let mut rest = wanted;
        for edition in 0..self.series.len() {
            let work = works.next_if(|work| work.edition == edition).map(|work| &work.groundwork);
            let (own, later) = rest.split_at(work.map_or(0, |work| work.map.vertices.len()));
            settled.push(self.series.settle(edition, work, own, &settled));
            rest = later;
        }
        settled
    }

    /// Returns the score on these patches of every part, given the deviation of each.
    fn score_on(
        &self,
        fingerprint: &Fingerprint,
        places: &[[f64; 2]],
        deviation_m: impl Fn(usize) -> f64,
        patches: Chosen,
    ) -> Result<f64> {
        let newest = self.series.map().vertices;
        let (mut sum, mut energy) = (0.0, 0.0);
        for (number, PartWork { groundwork, .. }) in self.works.iter().enumerate() {
            let of_part = groundwork.map.vertices.coords();
            let place = |v: usize| newest.index_of(of_part[v]).map(|index| places[index]);
            let (observed, disturbance) = groundwork.seen(place, deviation_m(number));
            let Groundwork { bases, parameters, coefficients, .. } = groundwork;
            let patches = patches(groundwork);
            let from = ((&*patches).into(), &bases[..]);
            let seen =
                Estimates::with_bases(from, &observed, *coefficients, parameters, &disturbance, &|_| ())?;
            let evidence = Evidence::of_recipients(&seen);
            let weight = evidence.energy().sqrt();
            sum += weight * evidence.agreement(&fingerprint.own.part(number)).score;
            energy += weight * weight;
        }
        Ok(if energy > 0.0 { sum / energy.sqrt() } else { 0.0 })
    }
}

/// Marks the newest map of a series for a recipient: Δ = E (α s) on both axes of every patch, under
/// the constraints of [`crate::embedding::embed`]. Returns the parts, too.
///
/// # Errors
/// Returns the errors of [`FingerprintEmbedding::new`] and [`FingerprintEmbedding::settle`].
pub fn embed(
    series: &Series,
    key: &SecretKey,
    recipient: &str,
    coefficients: usize,
) -> Result<(Marked, Vec<PartEntry>)> {
    let embedding = FingerprintEmbedding::new(series, key, coefficients)?;
    let fingerprint = embedding.fingerprint(recipient);
    let wanted = embedding.wanted(std::slice::from_ref(&fingerprint), &|_| ())?;
    Ok((embedding.settle(&fingerprint, &wanted[0])?, embedding.part_entries()))
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
