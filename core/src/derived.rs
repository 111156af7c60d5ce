//! What is observed of the displacements of vertices: those of the vertices themselves, or those of
//! points that are derived from them, such as the centroid of a polygon.
//!
//! To first order the displacement of a derived point is a linear function of those of vertices. Its
//! signature under a mark is the same function of their signatures, so that the demodulation is the
//! same for both.

use crate::{
    patches::{ALONE, PatchRow, Patches},
    response::Response,
};
use std::collections::BTreeMap;

pub use crate::response::Shares;

/// The place of a point that is observed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Site {
    /// Metres.
    pub at_m: [f64; 2],
    /// Its polygon group.
    pub group: u32,
}

/// The points of a map whose displacements are observed. Every point is in one patch.
#[derive(Clone, Copy)]
pub enum Observables<'a> {
    /// The vertices, in canonical order.
    Vertices(&'a Patches),
    /// Points that are derived from vertices.
    Derived(&'a DerivedPoints<'a>),
}

/// Points that are derived from vertices.
pub struct DerivedPoints<'a> {
    patches: &'a Patches,
    /// The points of each patch, ascending.
    of_patch: Vec<Vec<u32>>,
    points: Vec<Derived>,
}

/// A point in its patch.
struct Derived {
    place: Site,
    /// The shares of the vertices of its patch, by their positions in the patch.
    shares: Vec<(u32, [[f64; 2]; 2])>,
    /// The sum of the squared shares of all other vertices, mean of both axes.
    rest2: f64,
}

impl<'a> DerivedPoints<'a> {
    /// Puts every point into the patch with most of its shares. The vertices of other patches, and
    /// those that hang on other patches, move the point independently of its patch.
    pub fn new<'s>(patches: &'a Patches, points: impl Iterator<Item = &'s Shares>) -> Self {
        let rows = patches.rows();
        let mut derived = DerivedPoints {
            patches,
            of_patch: vec![Vec::new(); patches.as_slice().len()],
            points: Vec::new(),
        };
        for shares in points {
            let (patch, point) = in_patch(patches, &rows, shares);
            derived.of_patch[patch].push(derived.points.len() as u32);
            derived.points.push(point);
        }
        derived
    }

    /// Returns the variance of each point's displacement, per axis, that is no function of its
    /// patch, where that of a vertex is `mark2`.
    pub fn foreign_variance(&self, mark2: f64) -> impl Iterator<Item = f64> {
        self.points.iter().map(move |point| point.rest2 * mark2)
    }
}

impl<'a> From<&'a Patches> for Observables<'a> {
    fn from(patches: &'a Patches) -> Self {
        Observables::Vertices(patches)
    }
}

impl<'a> Observables<'a> {
    /// Returns the patches of the map.
    pub fn patches(self) -> &'a Patches {
        match self {
            Observables::Vertices(patches) => patches,
            Observables::Derived(derived) => derived.patches,
        }
    }

    /// Returns the number of points.
    pub fn count(self) -> usize {
        match self {
            Observables::Vertices(patches) => patches.vertex_count(),
            Observables::Derived(derived) => derived.points.len(),
        }
    }

    /// Returns the points of a patch, ascending.
    pub(crate) fn in_patch(self, patch: usize) -> &'a [u32] {
        match self {
            Observables::Vertices(patches) => &patches.as_slice()[patch].vertices,
            Observables::Derived(derived) => &derived.of_patch[patch],
        }
    }

    /// Returns whether the patch determines the movement of the point at a position in it.
    pub(crate) fn is_determined(self, patch: usize, row: usize) -> bool {
        match self {
            Observables::Vertices(patches) => !patches.as_slice()[patch].hangs_elsewhere(row),
            Observables::Derived(_) => true,
        }
    }

    pub(crate) fn place(self, point: u32) -> Site {
        match self {
            Observables::Vertices(patches) => {
                Site { at_m: patches.positions_m()[point as usize], group: patches.group(point) }
            }
            Observables::Derived(derived) => derived.points[point as usize].place,
        }
    }

    /// Returns the response of the points at these positions in a patch, given that of its vertices.
    pub(crate) fn seen(self, patch: usize, response: &Response, rows: &[usize]) -> Response {
        match self {
            Observables::Vertices(_) => response.rows(rows),
            Observables::Derived(derived) => {
                let point = |row: &usize| &derived.points[derived.of_patch[patch][*row] as usize];
                let shares: Vec<&Shares> = rows.iter().map(|row| &point(row).shares[..]).collect();
                response.derived(&shares)
            }
        }
    }
}

/// Returns the patch of a point, and the point in it.
fn in_patch(patches: &Patches, rows: &[PatchRow], shares: &Shares) -> (usize, Derived) {
    let energy = |matrix: &[[f64; 2]; 2]| matrix.as_flattened().iter().map(|s| s * s).sum::<f64>() / 2.0;
    let determined = shares.iter().filter_map(|(vertex, matrix)| {
        let PatchRow { patch, row } = Some(rows[*vertex as usize]).filter(|row| *row != PatchRow::NONE)?;
        let hangs = patches.as_slice()[patch as usize].hangs_elsewhere(row as usize);
        (!hangs).then_some((patch, row, matrix))
    });
    let mut energies: BTreeMap<u32, f64> = BTreeMap::new();
    determined.clone().for_each(|(patch, _, matrix)| *energies.entry(patch).or_default() += energy(matrix));
    let best = energies.into_iter().reduce(|best, next| if next.1 > best.1 { next } else { best });
    let (patch, inside) = best.unwrap_or_default();
    let total: f64 = shares.iter().map(|(_, matrix)| energy(matrix)).sum();
    let own = determined.filter(|(its, ..)| *its == patch);
    let point = Derived {
        place: place(patches, shares),
        shares: own.map(|(_, row, matrix)| (row, *matrix)).collect(),
        rest2: (total - inside).max(0.0),
    };
    (patch as usize, point)
}

/// Returns the place of a point. A point that is homogeneous in the places of its vertices lies at
/// the sum of their places with its shares (Euler).
fn place(patches: &Patches, shares: &Shares) -> Site {
    let moved = |axis: usize| {
        let term = |(vertex, matrix): &(u32, [[f64; 2]; 2])| {
            let [x, y] = patches.positions_m()[*vertex as usize];
            matrix[axis][0] * x + matrix[axis][1] * y
        };
        shares.iter().map(term).sum()
    };
    let group = shares.first().map_or(ALONE, |(vertex, _)| patches.group(*vertex));
    Site { at_m: [moved(0), moved(1)], group }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        carrier::Carrier,
        deformation::Deformation,
        demodulation,
        embedding::embed,
        ground::Ground,
        key::SecretKey,
        map::Map,
        map_data::{ChainKind, MapData},
        message::Message,
        modulation::{SpreadMessage, displacements_m},
        options::{Parameters, Rigidity},
        spectrum::Basis,
    };

    const EQUAL: [[f64; 2]; 2] = [[0.25, 0.0], [0.0, 0.25]];

    /// 400 houses of four corners on a grid, and the vertices of each.
    fn town() -> (MapData, Vec<[u32; 4]>) {
        let corner = |i: usize| [[0.0, 0.0], [9.0, 0.0], [9.0, 7.0], [0.0, 7.0], [0.0, 0.0]][i % 5];
        let house = |i: usize| [(i / 5 % 20 * 20 + i / 5 % 7) as f64, (i / 100 * 20 + i / 5 % 3) as f64];
        let coords = (0..2000).map(|i| [0, 1].map(|axis| corner(i)[axis] + house(i)[axis])).collect();
        let starts: Vec<u32> = (0..2000).step_by(5).collect();
        let (town, indices) = MapData::from_chains(coords, &starts, vec![ChainKind::Shell; 400]).unwrap();
        (town, indices.chunks(5).map(|ring| [0, 1, 2, 3].map(|i| ring[i])).collect())
    }

    fn on(town: &MapData) -> Map<'_> {
        town.on(&Ground::METRES, &Ground::METRES)
    }

    /// Returns the means of the vertices of houses as points.
    fn means(houses: &[[u32; 4]]) -> Vec<Vec<(u32, [[f64; 2]; 2])>> {
        houses.iter().map(|house| house.map(|vertex| (vertex, EQUAL)).to_vec()).collect()
    }

    #[test]
    fn points_respond_as_the_function_of_their_vertices_does() {
        let (town, houses) = town();
        for shape in [Rigidity::Free, Rigidity::Rigid, Rigidity::Stiff] {
            let parameters = Parameters { shape, ..Parameters::default() };
            let patches = Patches::new(&on(&town), &parameters).unwrap();
            let row = |vertex: &u32| patches.rows()[*vertex as usize];
            // A skew function of three vertices of the first patch.
            let skew = [[0.5, -0.2], [0.3, 0.7]];
            let vertices = &patches.as_slice()[0].vertices[4..7];
            let shares: Vec<(u32, [[f64; 2]; 2])> = vertices.iter().map(|vertex| (*vertex, skew)).collect();
            let points = DerivedPoints::new(&patches, [&shares[..]].into_iter());
            let basis = Basis::low_frequencies(&patches.as_slice()[0], 60).unwrap();
            let response = Response::carriers(&patches.as_slice()[0], &basis, &parameters);
            let coefficients =
                [0, 1].map(|axis| (0..59).map(|i| ((i * 7 + axis) % 5) as f64 - 2.0).collect());
            let all = response.synthesise(&coefficients);
            let seen = Observables::Derived(&points).seen(0, &response, &[0]).synthesise(&coefficients);
            for axis in 0..2 {
                let expected: f64 = vertices.iter().map(row).fold(0.0, |sum, PatchRow { row, .. }| {
                    let [x, y] = all[row as usize];
                    sum + skew[axis][0] * x + skew[axis][1] * y
                });
                assert!((seen[0][axis] - expected).abs() < 1e-12, "{shape:?} {} {expected}", seen[0][axis]);
            }
        }
        assert_eq!(houses.len(), 400);
    }

    #[test]
    fn a_point_between_patches_is_in_that_of_most_shares_and_the_rest_is_variance() {
        let (town, _) = town();
        let patches = Patches::new(&on(&town), &Parameters::default()).unwrap();
        let [a, b] = [0, 1].map(|patch: usize| patches.as_slice()[patch].vertices[0]);
        let double = EQUAL.map(|row| row.map(|share| 2.0 * share));
        let shares = [[(a, EQUAL), (b, double)], [(a, EQUAL), (a, EQUAL)]];
        let points = DerivedPoints::new(&patches, shares.iter().map(|shares| &shares[..]));
        assert_eq!(points.of_patch[..2], [vec![1], vec![0]]);
        assert_eq!(points.foreign_variance(0.01).collect::<Vec<_>>(), [0.01 * 0.0625, 0.0]);
        let place = Observables::Derived(&points).place(1);
        assert_eq!(place.at_m, patches.positions_m()[a as usize].map(|value| value / 2.0));
    }

    #[test]
    fn a_message_is_read_from_the_means_of_houses() {
        let (town, houses) = town();
        let (key, message) = (SecretKey::from_bytes([4; 32]), Message::from_bytes(&[0x5a; 16]));
        let parameters = Parameters::default();
        let marked = embed(&on(&town), &key, &message, &parameters).unwrap();
        let patches = Patches::new(&on(&town), &parameters).unwrap();
        let shares = means(&houses);
        let points = DerivedPoints::new(&patches, shares.iter().map(|shares| &shares[..]));
        let moved = |vertex: u32, axis: usize| {
            marked.coords[vertex as usize][axis] - town.vertices.coords()[vertex as usize][axis]
        };
        let mean = |house: &[u32; 4], axis| house.iter().map(|v| moved(*v, axis)).sum::<f64>() / 4.0;
        let observed: Vec<Option<[f64; 2]>> =
            houses.iter().map(|house| Some([mean(house, 0), mean(house, 1)])).collect();
        let of = Observables::Derived(&points);
        let carriers = patches.carriers(message.len(), &parameters).unwrap();
        let disturbance = Deformation::estimate(of, &observed, carriers, &parameters).unwrap().predict(
            of,
            &observed,
            carriers,
            parameters.amplitude_m,
        );
        let score = |key: &SecretKey| {
            let carrier = Carrier::new(key);
            let found = demodulation::joint(
                of,
                &carrier,
                &observed,
                message.len(),
                &parameters,
                &disturbance,
                &|_| (),
            );
            found.unwrap().mark_score(&message)
        };
        assert!(score(&key) > 15.0, "{}", score(&key));
        assert!(score(&SecretKey::from_bytes([5; 32])).abs() < 5.0);
        // The mean of what is planned is what is observed.
        let carrier = Carrier::new(&key);
        let signs = SpreadMessage::new(&carrier, &message, &parameters);
        let coefficients = patches.carriers(message.len(), &parameters).unwrap();
        let planned = displacements_m(&patches, &[signs], coefficients, &parameters).unwrap().remove(0);
        let expected = houses[0].iter().map(|v| planned[*v as usize][0]).sum::<f64>() / 4.0;
        assert!((observed[0].unwrap()[0] - expected).abs() < 1e-9);
    }
}
