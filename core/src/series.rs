//! Series: the editions of a map, of which each leaves in place what earlier ones had.
//!
//! A vertex that a base of an edition has, at the same coordinates, *stands*: it moves as there, to
//! the last bit. New vertices that a segment, a body or a T-junction joins to standing ones are
//! *attached*: they follow these and carry no signs. All other new vertices are the part of the
//! edition, where they are enough of them; fewer stay in place. So every vertex is in at most one
//! part, each part is the same in all editions, and the evidence of the parts adds up.

use crate::{
    Error, Result,
    bodies::{Body, Motion},
    constraints::Constraints,
    embedding::Groundwork,
    map::Map,
    nearness::VertexTree,
    options::Parameters,
    part::{PartDigest, Parts},
    patches::Patches,
    placement::Placement,
    topology::{Settled, settle},
    vertices::VertexTable,
};
use std::collections::BTreeMap;

/// The editions of a map, the oldest first.
pub struct Series<'a> {
    editions: Vec<Edition<'a>>,
    parameters: &'a Parameters,
}

/// An edition among those before it.
struct Edition<'a> {
    map: Map<'a>,
    /// What the bases determine; `None` without bases.
    changes: Option<Changes<'a>>,
}

/// What an edition changes on its bases.
struct Changes<'a> {
    /// For every vertex that stands, the number of its edition and its index there.
    origins: Vec<Option<(usize, u32)>>,
    tree: VertexTree<'a>,
    placement: Placement<'a>,
    /// The constraints on the vertices that do not stand.
    constraints: Constraints,
    attached: Vec<Attached>,
    part: OwnPart,
}

/// Vertices that follow standing ones together.
struct Attached {
    followers: Vec<u32>,
    standing: Vec<u32>,
}

/// The part of an edition with bases, as a map.
struct OwnPart {
    /// Its vertices on the map of the edition, ascending.
    indices: Vec<u32>,
    vertices: VertexTable,
    segments: Vec<[u32; 2]>,
    polygon_roots: Vec<u32>,
}

impl<'a> Series<'a> {
    /// Returns the series of a single map.
    pub fn of_one(map: Map<'a>, parameters: &'a Parameters) -> Self {
        Series { editions: vec![Edition { map, changes: None }], parameters }
    }

    /// Creates a series from maps, the oldest first, each with the numbers of its bases. Where
    /// several bases have a vertex, the first one determines its place.
    ///
    /// # Errors
    /// [`Error::PrecisionTooCoarse`].
    pub fn new(maps: Vec<(Map<'a>, Vec<usize>)>, parameters: &'a Parameters) -> Result<Self> {
        let mut series = Series { editions: Vec::new(), parameters };
        for (map, bases) in maps {
            let changes = match bases.is_empty() {
                true => None,
                false => Some(Changes::new(map, series.origins(map, &bases), parameters)?),
            };
            series.editions.push(Edition { map, changes });
        }
        Ok(series)
    }

    fn origins(&self, map: Map, bases: &[usize]) -> Vec<Option<(usize, u32)>> {
        let origin = |point: &[f64; 2]| {
            let find =
                |&base: &usize| Some((base, self.editions[base].map.vertices.index_of(*point)? as u32));
            bases.iter().find_map(find)
        };
        map.vertices.coords().iter().map(origin).collect()
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

    /// Returns the part of an edition as a map; `None` where it has too few vertices to be one.
    fn part(&self, edition: usize) -> Option<Map<'_>> {
        let Edition { map, changes } = &self.editions[edition];
        let Some(Changes { part, .. }) = changes else { return Some(*map) };
        let OwnPart { vertices, segments, polygon_roots, .. } = part;
        (vertices.len() >= self.parameters.patch_size).then_some(Map {
            vertices,
            segments,
            polygon_roots,
            ..*map
        })
    }

    /// Returns what `make` makes of the part of every edition that has one. A part of new vertices
    /// on which no mesh can be built, or which has no room for the coefficients, is none.
    pub(crate) fn parts<'s, T>(
        &'s self,
        make: impl Fn(Map<'s>) -> Result<T>,
    ) -> Result<Vec<(usize, Map<'s>, T)>> {
        let mut parts = Vec::new();
        for number in 0..self.editions.len() {
            let Some(map) = self.part(number) else { continue };
            match make(map) {
                Ok(made) => parts.push((number, map, made)),
                Err(Error::Collinear { .. } | Error::TooManySigns { .. })
                    if self.editions[number].changes.is_some() => {}
                Err(error) => return Err(error),
            }
        }
        Ok(parts)
    }

    /// Returns the patches of all parts on `map`, which has the vertices of all editions, and the
    /// parts.
    ///
    /// # Errors
    /// Returns the errors of [`Patches::new`] and [`Patches::check_room`].
    pub fn patches_on(&self, map: &Map, coefficients: usize) -> Result<(Patches, Parts)> {
        let parts = self.parts(|part| {
            let patches = Patches::new(&part, self.parameters)?;
            patches.check_room(coefficients)?;
            Ok(patches)
        })?;
        let index = |point: &[f64; 2]| map.vertices.index_of(*point).expect("it has all vertices") as u32;
        let placed = parts.into_iter().map(|(_, part, patches)| {
            let digest = PartDigest::new(part.vertices);
            (digest, patches, part.vertices.coords().iter().map(index).collect::<Vec<u32>>())
        });
        let placed: Vec<_> = placed.collect();
        let counts = placed.iter().map(|(digest, patches, _)| (*digest, patches.as_slice().len()));
        let parts = Parts::in_turn(counts);
        Ok((Patches::in_turn(map, placed.into_iter().map(|(_, patches, on_map)| (patches, on_map))), parts))
    }

    /// Moves an edition, after those before it have been moved. `wanted` are the displacements of
    /// its part, CRS units, none where it has none.
    pub(crate) fn settle(
        &self,
        number: usize,
        groundwork: Option<&Groundwork>,
        wanted: &[[f64; 2]],
        before: &[Settled],
    ) -> Settled {
        match (&self.editions[number], groundwork) {
            (Edition { map, changes: Some(changes) }, _) => changes.settle(*map, wanted, before),
            (_, Some(groundwork)) => groundwork.settle(wanted),
            (_, None) => unreachable!("an edition without bases is a part"),
        }
    }

    /// Returns how many vertices of the newest map hang on a segment, of which only those count that
    /// do not stand; `None` without bases.
    pub(crate) fn hanging(&self) -> Option<usize> {
        let changes = self.editions.last()?.changes.as_ref()?;
        Some(changes.constraints.junctions.hanging().len())
    }
}

impl<'a> Changes<'a> {
    fn new(map: Map<'a>, origins: Vec<Option<(usize, u32)>>, parameters: &Parameters) -> Result<Self> {
        let (placement, tree) = (Placement::new(&map, parameters)?, VertexTree::of_all(&map));
        let stands: Vec<bool> = origins.iter().map(Option::is_some).collect();
        let (constraints, torn) = Constraints::around(&map, &tree, parameters.shape, &stands);
        let attached = attach(&map, &constraints, &torn, &stands);
        let mut is_own: Vec<bool> = stands.iter().map(|stands| !stands).collect();
        attached.iter().flat_map(|group| &group.followers).for_each(|&v| is_own[v as usize] = false);
        for hanging in constraints.junctions.hanging() {
            // Its anchors are free, or belong to bodies.
            if hanging.anchors.iter().any(|(anchor, _)| !is_own[*anchor as usize]) {
                is_own[hanging.vertex as usize] = false;
            }
        }
        let part = OwnPart::new(&map, &is_own);
        Ok(Changes { origins, tree, placement, constraints, attached, part })
    }

    fn settle(&self, map: Map, of_part: &[[f64; 2]], before: &[Settled]) -> Settled {
        let place = |origin: &Option<(usize, u32)>| {
            origin.map(|(edition, vertex)| before[edition].coords[vertex as usize])
        };
        let standing: Vec<Option<[f64; 2]>> = self.origins.iter().map(place).collect();
        let moved = |(from, to): (&[f64; 2], &Option<[f64; 2]>)| {
            to.map_or([0.0; 2], |to| [to[0] - from[0], to[1] - from[1]])
        };
        let mut wanted: Vec<[f64; 2]> = map.vertices.coords().iter().zip(&standing).map(moved).collect();
        self.part
            .indices
            .iter()
            .zip(of_part)
            .for_each(|(&v, displacement)| wanted[v as usize] = *displacement);
        self.attached.iter().for_each(|group| group.follow(&map, &mut wanted));
        settle(&map, &self.tree, (&self.constraints, &standing), &wanted, &self.placement)
    }
}

/// Returns the vertices that a segment or a body joins to standing ones, with these. The bodies that
/// have standing vertices are `torn`.
fn attach(map: &Map, constraints: &Constraints, torn: &[Body], stands: &[bool]) -> Vec<Attached> {
    let of_body = |body: &Body| {
        let (standing, followers) = body.members.iter().partition(|&&v| stands[v as usize]);
        Attached { followers, standing }
    };
    let mut attached: Vec<Attached> = torn.iter().map(of_body).collect();
    let mut is_attached = stands.to_vec();
    torn.iter().flat_map(|body| &body.members).for_each(|&v| is_attached[v as usize] = true);
    // A body is named by its first vertex.
    let mover = |v: u32| {
        let body = constraints.bodies.number_at(v).map(|body| &constraints.bodies.as_slice()[body]);
        body.map_or(v, |body| body.members[0])
    };
    let mut others: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (new, old) in map.segments.iter().flat_map(|&[a, b]| [(a, b), (b, a)]) {
        let hangs = constraints.junctions.hanging_at(new).is_some();
        if !is_attached[new as usize] && stands[old as usize] && !hangs {
            others.entry(mover(new)).or_default().push(old);
        }
    }
    let members = |first: u32| match constraints.bodies.number_at(first) {
        Some(body) => constraints.bodies.as_slice()[body].members.clone(),
        None => vec![first],
    };
    let of_mover = |(first, standing)| Attached { followers: members(first), standing };
    attached.extend(others.into_iter().map(of_mover));
    attached
}

impl Attached {
    /// Moves the followers as the standing vertices move, by the rigid motion nearest to theirs;
    /// `displacements` are those of all vertices, CRS units.
    fn follow(&self, map: &Map, displacements: &mut [[f64; 2]]) {
        let body = Body::new(map, self.standing.clone());
        let [x, y] = body.scale;
        let in_m = |&v: &u32| [displacements[v as usize][0] * x, displacements[v as usize][1] * y];
        let of_standing: Vec<[f64; 2]> = self.standing.iter().map(in_m).collect();
        let Motion { shift_m, turn } = body.nearest_motion(&of_standing);
        let (from, origin) = (map.at(self.standing[0]), body.arms_m[0]);
        let arm = |&v: &u32| {
            let at = map.at(v);
            [origin[0] + (at[0] - from[0]) * x, origin[1] + (at[1] - from[1]) * y]
        };
        let arms_m: Vec<[f64; 2]> = self.followers.iter().map(arm).collect();
        // A turn that near vertices show must not carry far ones away.
        let longest = |vectors: &[[f64; 2]]| vectors.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max);
        let most = longest(&of_standing) / longest(&arms_m).max(f64::MIN_POSITIVE);
        let motion = Motion { shift_m, turn: turn.clamp(-most, most) };
        let followers = Body { members: self.followers.clone(), arms_m, scale: body.scale };
        for (&v, [dx, dy]) in self.followers.iter().zip(followers.displacements_m(&motion)) {
            displacements[v as usize] = [dx / x, dy / y];
        }
    }
}

impl OwnPart {
    /// Cuts the vertices out of a map, with the segments and polygons among them.
    fn new(map: &Map, is_own: &[bool]) -> Self {
        let indices: Vec<u32> = (0..is_own.len() as u32).filter(|&v| is_own[v as usize]).collect();
        let position = |v: u32| indices.binary_search(&v).ok().map(|position| position as u32);
        let coords = indices.iter().map(|&v| map.at(v)).collect();
        let vertices = VertexTable::new(coords).expect("they are vertices of a map");
        let segments = map.segments.iter().filter_map(|&[a, b]| Some([position(a)?, position(b)?])).collect();
        let mut firsts: BTreeMap<u32, u32> = BTreeMap::new();
        let root = |(own, &v): (u32, &u32)| {
            map.polygon_roots.get(v as usize).map_or(own, |&root| *firsts.entry(root).or_insert(own))
        };
        let polygon_roots = (0..).zip(&indices).map(root).collect();
        OwnPart { indices, vertices, segments, polygon_roots }
    }
}
