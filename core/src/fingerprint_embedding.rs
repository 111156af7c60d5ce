//! Embedding of fingerprints into the newest map of a series, part by part.

use crate::{
    Result,
    agreement::Evidence,
    boxes::{BoxMap, Boxes},
    columns::{Columns, InMemory},
    embedding::{Groundwork, Marked, READ_BACK_PATCHES, batch_of},
    estimation::Estimates,
    fingerprint::{Fingerprint, LEAST_SCORE, check_score},
    fingerprint_record::{Divided, PartEntry},
    key::SecretKey,
    part::{PartDigest, Parts},
    patches::Patches,
    series::Series,
    settled_boxes::{Score, SettledBox, SettledBoxes, StoredPlaces},
    topology::Settled,
    vertices::VertexTable,
};
use rayon::prelude::*;
use std::borrow::Cow;

/// The part of a marking for recipients that does not depend on the recipient.
pub struct FingerprintEmbedding<'a> {
    series: &'a Series<'a>,
    works: Vec<Work<'a>>,
    key: &'a SecretKey,
    coefficients: usize,
    parts: Parts,
    /// A fingerprint is read back from so many patches of a part first.
    read_back: usize,
    /// Where the numbers of settled boxes wait.
    columns: &'a dyn Columns,
}

/// An edition that has parts.
struct Work<'a> {
    /// The number of the edition.
    edition: usize,
    /// The number of its first part.
    first: usize,
    ground: Ground<'a>,
}

/// What the parts of an edition are made from.
enum Ground<'a> {
    /// One part.
    Part(Box<Groundwork<'a>>),
    /// Boxes, of which one at a time is meshed and solved.
    Boxes(&'a Boxes<'a>),
}

/// The mark of a recipient before the topology of the map is settled.
#[derive(Default)]
pub struct Wanted {
    /// The displacements of the vertices of the parts that are not in boxes, part after part, CRS units.
    displacements: Vec<[f64; 2]>,
    /// The editions in boxes, which are settled box by box.
    in_boxes: Vec<SettledBoxes>,
}

impl Wanted {
    /// Returns the displacements of the vertices of the parts that are not in boxes, part after part,
    /// CRS units.
    pub fn displacements(&self) -> &[[f64; 2]] {
        &self.displacements
    }
}

/// A map that was marked, and whose places may wait outside memory.
pub struct Settlement {
    /// Without places, where these are stored.
    marked: Marked,
    stored: Option<StoredPlaces>,
}

impl Settlement {
    /// Returns the marked map; `vertices` are those of the unmarked one. What else was needed for the
    /// marking can be released before.
    ///
    /// # Errors
    /// [`crate::Error::Column`].
    pub fn marked(self, vertices: &VertexTable) -> Result<Marked> {
        match self.stored {
            Some(places) => Ok(Marked { coords: places.load(vertices)?, ..self.marked }),
            None => Ok(self.marked),
        }
    }
}

impl From<Marked> for Settlement {
    fn from(marked: Marked) -> Self {
        Settlement { marked, stored: None }
    }
}

impl<'a> FingerprintEmbedding<'a> {
    /// Meshes the newest map of a series, and what its bases had, and cuts them into patches, for
    /// fingerprints of `coefficients` coefficients of every patch and axis. Boxes are left to
    /// [`Self::wanted`].
    ///
    /// # Errors
    /// Returns the errors of [`Patches::new`] and [`Patches::check_room`], and
    /// [`crate::Error::PrecisionTooCoarse`].
    pub fn new(series: &'a Series<'a>, key: &'a SecretKey, coefficients: usize) -> Result<Self> {
        let room = |patches: &Patches| patches.check_room(coefficients);
        let mut works: Vec<Work> = Vec::new();
        let mut named: Vec<(PartDigest, usize)> = Vec::new();
        for edition in 0..series.len() {
            let first = named.len();
            if let Some(boxes) = series.boxes(edition) {
                // The signs of a box follow from its name and its own patches, whose number is not yet known.
                named.extend((0..boxes.len()).map(|number| (boxes.digest(number), 0)));
                works.push(Work { edition, first, ground: Ground::Boxes(boxes) });
            } else if let Some((part, groundwork)) =
                series.part(edition, |part| Groundwork::new(part, series.parameters(), room))?
            {
                named.push((PartDigest::new(part.vertices), groundwork.patches.as_slice().len()));
                works.push(Work { edition, first, ground: Ground::Part(Box::new(groundwork)) });
            }
        }
        let (parts, read_back) = (Parts::in_turn(named), READ_BACK_PATCHES);
        Ok(FingerprintEmbedding { series, works, key, coefficients, parts, read_back, columns: &InMemory })
    }

    /// Lets the numbers of settled boxes wait in such columns instead of memory.
    pub fn with_columns(self, columns: &'a dyn Columns) -> Self {
        FingerprintEmbedding { columns, ..self }
    }

    /// Prepares for many recipients: it solves once for the bases of the patches from which each
    /// fingerprint is read back, and keeps them.
    ///
    /// # Errors
    /// Fails on a patch that cannot be solved.
    pub fn for_many(self) -> Result<Self> {
        let prepare = |work: Work<'a>| match work.ground {
            Ground::Part(groundwork) => {
                Ok(Work { ground: Ground::Part(Box::new(groundwork.for_many(self.read_back)?)), ..work })
            }
            Ground::Boxes(_) => Ok(work),
        };
        Ok(FingerprintEmbedding {
            works: self.works.into_iter().map(prepare).collect::<Result<_>>()?,
            ..self
        })
    }

    /// Returns the parts of the series; those of an edition in boxes have no patches yet.
    pub fn parts(&self) -> &Parts {
        &self.parts
    }

    /// Returns how the map is divided, for its record.
    pub fn divided(&self, wanted: &Wanted) -> Divided {
        let mut in_boxes = wanted.in_boxes.iter();
        let mut parts = Vec::new();
        let mut census = self.series.census();
        for Work { edition, first, ground } in &self.works {
            let digest = |number: usize| self.parts.as_slice()[first + number].digest;
            match ground {
                Ground::Part(groundwork) => parts.push(PartEntry {
                    sha256: digest(0),
                    vertices: groundwork.map.vertices.len(),
                    patches: groundwork.patches.as_slice().len(),
                }),
                Ground::Boxes(boxes) => {
                    let settled = in_boxes.next().expect("the mark is of this embedding");
                    let entry = |(number, &patches): (usize, &usize)| PartEntry {
                        sha256: digest(number),
                        vertices: boxes.vertices(number),
                        patches,
                    };
                    parts.extend(settled.patches.iter().enumerate().map(entry));
                    census = census.or((edition + 1 == self.series.len()).then_some(settled.census));
                }
            }
        }
        Divided { parts, census }
    }

    /// Returns how many patches there are, or for boxes the most that there may be.
    pub fn patches(&self) -> usize {
        let of_work = |work: &Work| match &work.ground {
            Ground::Part(groundwork) => groundwork.patches.as_slice().len(),
            Ground::Boxes(boxes) => boxes.map().vertices.len() / self.series.parameters().patch_size,
        };
        self.works.iter().map(of_work).sum()
    }

    /// Returns how many recipients, at least one, [`Self::wanted`] handles at once within its
    /// memory.
    pub fn batch(&self) -> usize {
        let batch = |work: &Work| match &work.ground {
            Ground::Part(groundwork) => groundwork.batch(),
            Ground::Boxes(boxes) => batch_of(boxes.map().vertices.len()),
        };
        let batches = self.works.iter().map(batch);
        batches.min().map_or(1, |least| (least / self.works.len()).max(1))
    }

    /// Returns the fingerprint of a recipient on this map.
    pub fn fingerprint(&self, recipient: &str) -> Fingerprint {
        Fingerprint::new(self.key, &self.parts, recipient)
    }

    /// Returns the marks of fingerprints. Every patch is solved once for all. `progress` is called once
    /// for every patch.
    ///
    /// # Errors
    /// Fails on a patch that cannot be solved, and returns [`crate::Error::TooFewInParts`] where no box
    /// carries signs, and [`crate::Error::Column`].
    pub fn wanted(
        &self,
        fingerprints: &[Fingerprint],
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<Wanted>> {
        let mut all: Vec<Wanted> = fingerprints.iter().map(|_| Wanted::default()).collect();
        for work in &self.works {
            match &work.ground {
                Ground::Part(groundwork) => {
                    let of_part: Vec<Fingerprint> =
                        fingerprints.iter().map(|all| all.part(work.first)).collect();
                    let found = groundwork.wanted(&of_part, progress)?;
                    all.iter_mut().zip(found).for_each(|(all, found)| all.displacements.extend(found));
                }
                Ground::Boxes(boxes) => {
                    let settled = self.settle_boxes((work, boxes), fingerprints, progress)?;
                    all.iter_mut().zip(settled).for_each(|(all, settled)| all.in_boxes.push(settled));
                }
            }
        }
        Ok(all)
    }

    /// Marks an edition box by box.
    fn settle_boxes(
        &self,
        (work, boxes): (&Work, &Boxes),
        fingerprints: &[Fingerprint],
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<SettledBoxes>> {
        let mut all = fingerprints
            .iter()
            .map(|_| SettledBoxes::new(boxes, self.columns))
            .collect::<Result<Vec<SettledBoxes>>>()?;
        let newest = (work.edition + 1 < self.series.len()).then(|| self.series.map().vertices);
        for number in 0..boxes.len() {
            let of_box: Vec<Fingerprint> =
                fingerprints.iter().map(|all| all.part(work.first + number)).collect();
            self.on_box(boxes, number, |embedding, cut| {
                let embedding = embedding.for_many()?;
                let wanted = embedding.wanted(&of_box, progress)?;
                let settle = |((all, fingerprint), wanted): ((&mut SettledBoxes, &Fingerprint), Wanted)| {
                    let settled = embedding.settle_all(wanted)?.pop().expect("a box is an edition");
                    // Evidence of an earlier edition is that of the vertices that are still there.
                    let vertices = embedding.series.map().vertices;
                    let place = |at: [f64; 2]| {
                        let is_there = newest.is_none_or(|newest| newest.index_of(at).is_some());
                        is_there.then(|| vertices.index_of(at).map(|v| settled.coords[v])).flatten()
                    };
                    let deviation_m = |_| settled.deviation_m;
                    let score =
                        embedding.score_on(fingerprint, &place, &deviation_m, Some(embedding.read_back))?;
                    all.add(cut, &embedding.series.map(), embedding.settled_box(settled, score))
                };
                all.par_iter_mut().zip(&of_box).zip(wanted).try_for_each(settle)
            })?;
        }
        match all.iter().any(|settled| settled.patches.iter().all(|patches| *patches == 0)) {
            true => Err(self.series.without_parts()),
            false => Ok(all),
        }
    }

    /// Describes the only edition, a box, after marking.
    fn settled_box(&self, settled: Settled, score: Score) -> SettledBox {
        let census = self.series.census().expect("a box has a census");
        let hanging = self.series.hanging().unwrap_or(0);
        SettledBox { settled, hanging, census, patches: self.patches(), score }
    }

    /// Returns what `f` makes of the embedding into a box alone.
    fn on_box<T>(
        &self,
        boxes: &Boxes,
        number: usize,
        f: impl FnOnce(FingerprintEmbedding, &BoxMap) -> Result<T>,
    ) -> Result<T> {
        let cut = boxes.cut(number);
        let series = Series::of_box(cut.submap.on(boxes.map()), &cut.anchors, self.series.parameters())?;
        let embedding = FingerprintEmbedding::new(&series, self.key, self.coefficients)?;
        // Of all boxes together about as many patches are read back as of a map in one part.
        f(FingerprintEmbedding { read_back: READ_BACK_PATCHES.div_ceil(boxes.len()), ..embedding }, &cut)
    }

    /// Marks the newest map with a fingerprint, of which `wanted` is the mark. The fingerprint is read
    /// back from the result, from as many patches as it takes.
    ///
    /// # Errors
    /// [`crate::Error::FingerprintLost`], [`crate::Error::Column`].
    pub fn settle(&self, fingerprint: &Fingerprint, wanted: Wanted) -> Result<Marked> {
        self.settle_stored(fingerprint, wanted)?.marked(self.series.map().vertices)
    }

    /// Does the same as [`Self::settle`], and leaves the places of a map in boxes where they are.
    ///
    /// # Errors
    /// Returns the errors of [`Self::settle`].
    pub fn settle_stored(&self, fingerprint: &Fingerprint, mut wanted: Wanted) -> Result<Settlement> {
        let Some(boxes) = self.series.boxes(0).filter(|_| self.series.len() == 1) else {
            return Ok(self.settle_editions(fingerprint, wanted)?.into());
        };
        let settled = wanted.in_boxes.pop().expect("the mark is of this embedding");
        let vertices = self.series.map().vertices;
        if settled.score.deviations() < LEAST_SCORE {
            let Settled { coords, deviation_m, .. } = settled.settled(vertices)?;
            let place = |at: [f64; 2]| vertices.index_of(at).map(|v| coords[v]);
            check_score(self.score_on_boxes(fingerprint, &place, &|_| deviation_m)?.deviations())?;
        }
        let (displacement, angles) = settled.changes()?;
        let marked = Marked {
            coords: Vec::new(),
            patches: settled.patches.iter().sum(),
            displacement,
            angles,
            junctions: settled.hanging,
            attenuated: settled.attenuated,
            signless: signless_in(boxes, &settled.patches),
        };
        Ok(Settlement { marked, stored: Some(settled.into_places()) })
    }

    /// Marks the newest map of several editions, or a map in one part.
    fn settle_editions(&self, fingerprint: &Fingerprint, wanted: Wanted) -> Result<Marked> {
        let patches = self.divided(&wanted).parts.iter().map(|part| part.patches).sum();
        let signless = self.signless(&wanted);
        let in_boxes: Score =
            wanted.in_boxes.iter().fold(Score::default(), |all, settled| all.and(settled.score));
        let hanging_in_boxes = self.newest_in_boxes(&wanted).map(|newest| newest.hanging);
        let mut settled = self.settle_all(wanted)?;
        let newest = settled.pop().expect("a series has an edition");
        let mut deviations: Vec<f64> = settled.iter().map(|settled| settled.deviation_m).collect();
        deviations.push(newest.deviation_m);
        let deviation_m = |edition: usize| deviations[edition];
        let vertices = self.series.map().vertices;
        let place = |at: [f64; 2]| vertices.index_of(at).map(|v| newest.coords[v]);
        let first_score =
            in_boxes.and(self.score_on(fingerprint, &place, &deviation_m, Some(self.read_back))?);
        if first_score.deviations() < LEAST_SCORE {
            let of_boxes = self.score_on_boxes(fingerprint, &place, &deviation_m)?;
            let all = of_boxes.and(self.score_on(fingerprint, &place, &deviation_m, None)?);
            check_score(all.deviations())?;
        }
        let of_whole = || match &self.works.last()?.ground {
            Ground::Part(groundwork) => Some(groundwork.patches.constraints().junctions.hanging().len()),
            Ground::Boxes(_) => None,
        };
        let hanging = hanging_in_boxes.or_else(|| self.series.hanging()).or_else(of_whole).unwrap_or(0);
        Ok(Marked { signless, ..Marked::new(&self.series.map(), newest, (patches, hanging)) })
    }

    /// Returns how many vertices of the newest map carry no sign, as a part has too few that are free.
    fn signless(&self, wanted: &Wanted) -> usize {
        let newest = self.series.len() - 1;
        match (self.series.boxes(newest), self.newest_in_boxes(wanted)) {
            (Some(boxes), Some(settled)) => signless_in(boxes, &settled.patches),
            _ if self.works.iter().any(|work| work.edition == newest) => 0,
            _ => self.series.census().map_or(0, |census| census.free),
        }
    }

    /// Returns the newest map after marking, if it is in boxes.
    fn newest_in_boxes<'w>(&self, wanted: &'w Wanted) -> Option<&'w SettledBoxes> {
        self.series.boxes(self.series.len() - 1).and(wanted.in_boxes.last())
    }

    /// Returns the score of a fingerprint on the newest map whose vertices have these places, with
    /// noise of this standard deviation, metres.
    ///
    /// # Errors
    /// Fails on a patch that cannot be solved.
    pub fn score(&self, fingerprint: &Fingerprint, places: &[[f64; 2]], noise_m: f64) -> Result<f64> {
        let vertices = self.series.map().vertices;
        let place = |at: [f64; 2]| vertices.index_of(at).map(|v| places[v]);
        let of_parts = self.score_on(fingerprint, &place, &|_| noise_m, None)?;
        Ok(self.score_on_boxes(fingerprint, &place, &|_| noise_m)?.and(of_parts).deviations())
    }

    /// Moves all editions, one after the other.
    fn settle_all(&self, wanted: Wanted) -> Result<Vec<Settled>> {
        let mut settled: Vec<Settled> = Vec::new();
        let mut works = self.works.iter().peekable();
        let (mut rest, mut in_boxes) = (&wanted.displacements[..], wanted.in_boxes.into_iter());
        for edition in 0..self.series.len() {
            let groundwork = match works.next_if(|work| work.edition == edition).map(|work| &work.ground) {
                Some(Ground::Boxes(boxes)) => {
                    let of_boxes = in_boxes.next().expect("the mark is of this embedding");
                    settled.push(of_boxes.settled(boxes.map().vertices)?);
                    continue;
                }
                Some(Ground::Part(groundwork)) => Some(&**groundwork),
                None => None,
            };
            let (own, later) = rest.split_at(groundwork.map_or(0, |work| work.map.vertices.len()));
            settled.push(self.series.settle(edition, groundwork, own, &settled));
            rest = later;
        }
        Ok(settled)
    }

    /// Returns the score on the `first` patches of every part that is not a box, or on all, given the
    /// place of every vertex, and the deviation of each edition.
    fn score_on(
        &self,
        fingerprint: &Fingerprint,
        place: &dyn Fn([f64; 2]) -> Option<[f64; 2]>,
        deviation_m: &dyn Fn(usize) -> f64,
        first: Option<usize>,
    ) -> Result<Score> {
        let mut score = Score::default();
        for Work { edition, first: part, ground } in &self.works {
            let Ground::Part(groundwork) = ground else { continue };
            let of_part = groundwork.map.vertices.coords();
            let (observed, disturbance) = groundwork.seen(|v| place(of_part[v]), deviation_m(*edition));
            let Groundwork { bases, parameters, coefficients, .. } = &**groundwork;
            let patches = match first {
                Some(count) => Cow::Owned(groundwork.patches.head(count)),
                None => Cow::Borrowed(&groundwork.patches),
            };
            let from = ((&*patches).into(), &bases[..]);
            let seen =
                Estimates::with_bases(from, &observed, *coefficients, parameters, &disturbance, &|_| ())?;
            let evidence = Evidence::of_recipients(&seen);
            let agreement = evidence.agreement(&fingerprint.own.part(*part));
            score = score.and(Score::new(evidence.energy(), agreement.score));
        }
        Ok(score)
    }

    /// Returns the score on all patches of all boxes, as [`Self::score_on`] does on other parts.
    fn score_on_boxes(
        &self,
        fingerprint: &Fingerprint,
        place: &dyn Fn([f64; 2]) -> Option<[f64; 2]>,
        deviation_m: &dyn Fn(usize) -> f64,
    ) -> Result<Score> {
        let mut score = Score::default();
        for Work { edition, first, ground } in &self.works {
            let Ground::Boxes(boxes) = ground else { continue };
            for number in 0..boxes.len() {
                let (of_box, deviation_m) = (fingerprint.part(first + number), |_| deviation_m(*edition));
                let found = self.on_box(boxes, number, |embedding, _| {
                    embedding.score_on(&of_box, place, &deviation_m, None)
                });
                score = score.and(found?);
            }
        }
        Ok(score)
    }
}

/// Marks the newest map of a series for a recipient: Δ = E (α s) on both axes of every patch, under
/// the constraints of [`crate::embedding::embed`]. Returns how the map is divided, too.
///
/// # Errors
/// Returns the errors of [`FingerprintEmbedding::new`], [`FingerprintEmbedding::wanted`] and
/// [`FingerprintEmbedding::settle`].
pub fn embed(
    series: &Series,
    key: &SecretKey,
    recipient: &str,
    coefficients: usize,
) -> Result<(Marked, Divided)> {
    let embedding = FingerprintEmbedding::new(series, key, coefficients)?;
    let fingerprint = embedding.fingerprint(recipient);
    let mut wanted = embedding.wanted(std::slice::from_ref(&fingerprint), &|_| ())?;
    let wanted = wanted.pop().expect("one for each fingerprint");
    let divided = embedding.divided(&wanted);
    Ok((embedding.settle(&fingerprint, wanted)?, divided))
}

/// Returns how many vertices are in boxes without patches.
fn signless_in(boxes: &Boxes, patches: &[usize]) -> usize {
    let is_empty = |number: &usize| patches[*number] == 0;
    (0..boxes.len()).filter(is_empty).map(|number| boxes.vertices(number)).sum()
}
