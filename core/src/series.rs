//! Series: the editions of a map, of which each leaves in place what earlier ones had.
//!
//! A vertex that a base of an edition has, at the same coordinates, *stands*: it moves as there, to
//! the last bit. New vertices that a segment, a body or a T-junction joins to standing ones are
//! *attached*: they follow these and carry no signs. All other new vertices are the part of the
//! edition, where they are enough of them; fewer stay in place. So every vertex is in at most one
//! part, each part is the same in all editions, and the evidence of the parts adds up.
//!
//! The *anchors* of an edition, which other sheets of the map have or are near to, stay in place
//! whatever its bases have, and vertices are attached to them likewise.
//!
//! A large edition without either is cut into boxes, each a part of its own.

use crate::{
    Error, Result,
    boxes::{BoxMap, Boxes},
    changes::{Changes, Origin},
    embedding::Groundwork,
    map::Map,
    options::Parameters,
    part::{PartDigest, Parts},
    patches::Patches,
    topology::Settled,
};
use serde::{Deserialize, Serialize};

/// The editions of a map, the oldest first.
pub struct Series<'a> {
    editions: Vec<Placed<'a>>,
    parameters: &'a Parameters,
}

/// An edition of a map.
pub struct Edition<'a> {
    /// The map.
    pub map: Map<'a>,
    /// The numbers of its bases. Where several have a vertex, the first one determines its place.
    pub bases: Vec<usize>,
    /// Canonical indices of the vertices that stay in place, ascending.
    pub anchors: &'a [u32],
    /// A map of more vertices without bases and anchors is cut into parts of nearly so many; `None`
    /// leaves it in one part, whatever its size.
    pub part_size: Option<usize>,
}

/// How the vertices of an edition are divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Census {
    /// Vertices that move as in a base.
    pub standing: usize,
    /// Vertices that stay in place, as other sheets have them or are near.
    pub anchored: usize,
    /// Vertices that follow these.
    pub attached: usize,
    /// All others.
    pub free: usize,
}

/// An edition among those before it.
struct Placed<'a> {
    map: Map<'a>,
    division: Division<'a>,
}

/// What determines the movement of the vertices of an edition.
enum Division<'a> {
    /// All of them are free.
    Whole,
    /// Bases and anchors determine some. Whether there may be too few others for a part.
    Changed(Box<Changes<'a>>, bool),
    /// Each box is a part.
    Boxes(Boxes<'a>),
}

impl<'a> Series<'a> {
    /// Returns the series of a single map.
    pub fn of_one(map: Map<'a>, parameters: &'a Parameters) -> Self {
        Series { editions: vec![Placed { map, division: Division::Whole }], parameters }
    }

    /// Returns the series of a box of a map, which may have too few free vertices for a part.
    pub(crate) fn of_box(map: Map<'a>, anchors: &[u32], parameters: &'a Parameters) -> Result<Self> {
        let mut origins = vec![None; map.vertices.len()];
        anchors.iter().for_each(|&v| origins[v as usize] = Some(Origin::Anchor));
        let division = Division::Changed(Box::new(Changes::new(map, origins, parameters)?), true);
        Ok(Series { editions: vec![Placed { map, division }], parameters })
    }

    /// Creates a series from editions, the oldest first.
    ///
    /// # Errors
    /// [`Error::PrecisionTooCoarse`], and [`Error::Anchors`] where anchors are none of the vertices.
    pub fn new(editions: Vec<Edition<'a>>, parameters: &'a Parameters) -> Result<Self> {
        let mut series = Series { editions: Vec::new(), parameters };
        for edition in editions {
            let Edition { map, ref bases, anchors, part_size } = edition;
            let vertices = map.vertices.len();
            if anchors.iter().any(|&v| v as usize >= vertices) {
                return Err(Error::Anchors { vertices });
            }
            let is_free = bases.is_empty() && anchors.is_empty();
            let division = match part_size.filter(|part_size| vertices > *part_size) {
                Some(part_size) if is_free => Division::Boxes(Boxes::new(map, part_size, parameters)),
                _ if is_free => Division::Whole,
                _ => {
                    let changes = Changes::new(map, series.origins(&edition), parameters)?;
                    Division::Changed(Box::new(changes), !bases.is_empty())
                }
            };
            series.editions.push(Placed { map, division });
        }
        Ok(series)
    }

    fn origins(&self, Edition { map, bases, anchors, .. }: &Edition) -> Vec<Option<Origin>> {
        let origin = |point: &[f64; 2]| {
            let find = |&base: &usize| {
                Some(Origin::Base(base, self.editions[base].map.vertices.index_of(*point)? as u32))
            };
            bases.iter().find_map(find)
        };
        let mut origins: Vec<Option<Origin>> = map.vertices.coords().iter().map(origin).collect();
        anchors.iter().for_each(|&v| origins[v as usize] = Some(Origin::Anchor));
        origins
    }

    /// Returns the newest map.
    pub(crate) fn map(&self) -> Map<'a> {
        self.editions.last().expect("a series has an edition").map
    }

    pub(crate) fn parameters(&self) -> &'a Parameters {
        self.parameters
    }

    pub(crate) fn len(&self) -> usize {
        self.editions.len()
    }

    /// Returns the boxes of an edition that is cut into some.
    pub(crate) fn boxes(&self, edition: usize) -> Option<&Boxes<'a>> {
        match &self.editions[edition].division {
            Division::Boxes(boxes) => Some(boxes),
            _ => None,
        }
    }

    /// Returns the names of the parts into which an edition is cut; `None` where it is not.
    pub fn cut_parts(&self, edition: usize) -> Option<Vec<PartDigest>> {
        let boxes = self.boxes(edition)?;
        Some((0..boxes.len()).map(|number| boxes.digest(number)).collect())
    }

    /// Returns what `make` makes of the part of an edition, which is not in boxes, if it has one. New
    /// vertices are none where they are too few, on one line, or have no room for the coefficients.
    pub(crate) fn part<'s, T>(
        &'s self,
        edition: usize,
        make: impl Fn(Map<'s>) -> Result<T>,
    ) -> Result<Option<(Map<'s>, T)>> {
        let Placed { map, division } = &self.editions[edition];
        let Division::Changed(changes, may_be_small) = division else {
            return make(*map).map(|made| Some((*map, made)));
        };
        let part = changes.part.on(map);
        let is_small = part.vertices.len() < self.parameters.patch_size;
        match if is_small { None } else { Some(make(part)) } {
            Some(Ok(made)) => Ok(Some((part, made))),
            Some(Err(error)) if !is_of_small_part(&error) => Err(error),
            _ if *may_be_small => Ok(None),
            _ => {
                let (free, vertices) = (part.vertices.len(), map.vertices.len());
                Err(Error::TooFewFree { free, vertices, patch_size: self.parameters.patch_size })
            }
        }
    }

    /// Returns what bases and anchors leave to the newest map.
    fn changes(&self) -> Option<&Changes<'a>> {
        match &self.editions.last()?.division {
            Division::Changed(changes, _) => Some(changes),
            _ => None,
        }
    }

    /// Returns how the vertices of the newest map are divided; `None` where they are all free, or in
    /// boxes.
    pub(crate) fn census(&self) -> Option<Census> {
        let changes = self.changes()?;
        let count = |is_meant: fn(&Origin) -> bool| {
            changes.origins.iter().flatten().filter(|origin| is_meant(origin)).count()
        };
        let standing = count(|origin| matches!(origin, Origin::Base(..)));
        let anchored = count(|origin| matches!(origin, Origin::Anchor));
        let free = changes.part.len();
        let attached = changes.origins.len() - standing - anchored - free;
        Some(Census { standing, anchored, attached, free })
    }

    /// Returns the patches of all parts on `map`, which has the vertices of all editions, and the
    /// parts. A box with too few free vertices is a part without patches.
    ///
    /// # Errors
    /// Returns the errors of [`Patches::new`] and [`Patches::check_room`].
    pub fn patches_on(&self, map: &Map, coefficients: usize) -> Result<(Patches, Parts)> {
        let index = |point: &[f64; 2]| map.vertices.index_of(*point).expect("it has all vertices") as u32;
        let placed = |part: Map, patches| (patches, part.vertices.coords().iter().map(index).collect());
        let patches = |part: Map| {
            let patches = Patches::new(&part, self.parameters)?;
            patches.check_room(coefficients)?;
            Ok(patches)
        };
        let mut counts: Vec<(PartDigest, usize)> = Vec::new();
        let mut all: Vec<(Patches, Vec<u32>)> = Vec::new();
        for edition in 0..self.editions.len() {
            for number in 0..self.boxes(edition).map_or(0, Boxes::len) {
                let boxes = self.boxes(edition).expect("it has some");
                let BoxMap { submap, anchors, .. } = boxes.cut(number);
                let of_box = Series::of_box(submap.on(boxes.map()), &anchors, self.parameters)?;
                let found = of_box.part(0, patches)?;
                counts.push((boxes.digest(number), found.as_ref().map_or(0, |(_, p)| p.as_slice().len())));
                all.extend(found.map(|(part, patches)| placed(part, patches)));
            }
            if self.boxes(edition).is_none()
                && let Some((part, patches)) = self.part(edition, patches)?
            {
                counts.push((PartDigest::new(part.vertices), patches.as_slice().len()));
                all.push(placed(part, patches));
            }
        }
        if all.is_empty() {
            return Err(self.without_parts());
        }
        Ok((Patches::in_turn(map, all.into_iter()), Parts::in_turn(counts)))
    }

    /// Returns the error of a series of which no part has enough free vertices.
    pub(crate) fn without_parts(&self) -> Error {
        Error::TooFewInParts { vertices: self.map().vertices.len(), patch_size: self.parameters.patch_size }
    }

    /// Moves an edition that is not in boxes, after those before it have been moved. `wanted` are the
    /// displacements of its part, CRS units, none where it has none.
    pub(crate) fn settle(
        &self,
        number: usize,
        groundwork: Option<&Groundwork>,
        wanted: &[[f64; 2]],
        before: &[Settled],
    ) -> Settled {
        match (&self.editions[number], groundwork) {
            (Placed { map, division: Division::Changed(changes, _) }, _) => {
                changes.settle(*map, wanted, before)
            }
            (_, Some(groundwork)) => groundwork.settle(wanted),
            (_, None) => unreachable!("an edition without bases and anchors is a part"),
        }
    }

    /// Returns how many vertices of the newest map hang on a segment, of which only those count that
    /// do not stand; `None` without bases and anchors.
    pub(crate) fn hanging(&self) -> Option<usize> {
        Some(self.changes()?.constraints.junctions.hanging().len())
    }
}

/// Returns whether vertices of a part are on one line, or have no room for the coefficients.
fn is_of_small_part(error: &Error) -> bool {
    matches!(error, Error::Collinear { .. } | Error::TooManySigns { .. })
}
