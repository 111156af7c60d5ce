//! Registration: the map that brings a suspect back onto the reference (paper, section 3.5): an affine one, and
//! where that leaves a smooth distortion, a cubic polynomial.
//!
//! Starting points are the identity, landmarks (features with the same attribute values) and geometry
//! (features of the same shape, then the same arrangement of neighbouring vertices). Each is refined on matched
//! vertices, and the one under which most vertices match wins. Nothing here knows a key.

use crate::{
    affine::Affine,
    cubic::{Cubic, Transform},
    matching::Matcher,
    search::{Search, Way},
};
use meshmark_core::{counted, ground::Ground, vertices::VertexTable};
use meshmark_dataset::{Label, Shape};
use serde::Serialize;

/// Reference vertices used while refining; more would not make it better.
const SAMPLE: usize = 20_000;
/// The share of the smaller map's vertices that is most of them: the search ends.
const AGREE: f64 = 0.5;
/// The share of the smaller map's vertices that chance does not reach: what is costly is not tried.
const SOME_AGREE: f64 = 0.2;
/// Fewer matched vertices than this are chance: nothing was found.
pub const LEAST_MATCHED: usize = 30;
/// And so are fewer than this many times those that match out of place.
pub const TIMES_CHANCE: usize = 2;
/// A shift, in matching radii, after which no map is in place.
pub const OUT_OF_PLACE: [f64; 2] = [7.3, -5.1];

/// How a suspect was brought onto the reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Registration {
    /// "identity", "landmarks" or "geometry": where the search started.
    pub method: &'static str,
    /// What the suspect's numbers were taken for, where its CRS is missing or wrong.
    pub read_as: Option<ReadAs>,
    /// Suspect (in the reference's CRS) to reference coordinates: x′ = a x + b y + c, y′ = d x + e y + f,
    /// CRS units.
    pub affine: [f64; 6],
    /// The polynomial that comes after the affine map; null when that is enough.
    pub polynomial: Option<Cubic>,
    /// Pairs of features that agree with the result; 0 when none were needed.
    pub landmarks: usize,
    /// Root mean square distance of matched vertices after it, metres; null when none matched.
    pub rms_m: Option<f64>,
    /// Matched vertices, of a sample.
    #[serde(skip)]
    pub matched: usize,
    /// The same as a share of the smaller map.
    #[serde(skip)]
    pub share: f64,
}

/// What the numbers of a map were taken for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadAs {
    /// "EPSG:3857", or WKT.
    pub crs: String,
    /// Whether x and y were exchanged first.
    pub axes_swapped: bool,
}

impl std::fmt::Display for ReadAs {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let exchanged = if self.axes_swapped { " with x and y exchanged" } else { "" };
        write!(f, "{}{exchanged}", self.crs)
    }
}

impl Registration {
    /// The suspect's vertices in reference coordinates.
    pub fn apply(&self, suspect: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let transform = Transform { affine: Affine { coefficients: self.affine }, cubic: self.polynomial };
        suspect.iter().map(|p| transform.apply(*p)).collect()
    }

    /// What was done, for a person.
    pub fn to_text(&self) -> String {
        let read_as = self.read_as.as_ref().map_or(String::new(), |read_as| format!(", read as {read_as}"));
        let landmarks = match self.landmarks {
            0 => String::new(),
            count => format!(", {}", counted(count, "landmark")),
        };
        let polynomial = self.polynomial.map_or("", |_| ", then a cubic polynomial");
        let rms = self.rms_m.map_or(String::new(), |rms| format!(", residual {rms:.3} m RMS"));
        format!("{}{read_as}{landmarks}{polynomial}{rms}", self.method)
    }

    /// Whether most vertices match: there is nothing better to search for.
    pub fn agrees(&self) -> bool {
        self.share >= AGREE
    }

    /// Whether more vertices match than chance makes.
    pub fn agrees_in_part(&self) -> bool {
        self.share >= SOME_AGREE
    }
}

/// Where to start a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Start {
    /// As it stands, by landmarks or by geometry, whichever is best
    Auto,
    /// Features with the same attribute values
    Landmarks,
    /// Features of the same shape
    Geometry,
    /// Nowhere: the suspect is taken as it stands
    None,
}

/// One map of the two.
#[derive(Clone, Copy)]
pub struct Side<'a> {
    /// Its distinct vertices.
    pub vertices: &'a VertexTable,
    /// Its labels.
    pub labels: &'a [Label],
    /// Its rings and lines.
    pub shapes: &'a [Shape],
}

/// Brings suspects onto one reference.
pub struct Registrar<'a> {
    pub(crate) matcher: Matcher<'a>,
    pub(crate) reference: Side<'a>,
    pub(crate) ground: &'a Ground,
    pub(crate) radius_m: f64,
}

impl<'a> Registrar<'a> {
    /// `radius_m` is the matching radius t.
    pub fn new(reference: Side<'a>, ground: &'a Ground, radius_m: f64) -> Self {
        let matcher = Matcher::new(reference.vertices.coords(), ground, reference.vertices.centre());
        Registrar { matcher, reference, ground, radius_m }
    }

    /// The map from the suspect to the reference, which are in the same CRS.
    pub fn register(&self, suspect: Side, start: Start) -> Registration {
        let search = Search { registrar: self, suspect };
        let found = match start {
            Start::None => return self.as_it_stands(suspect),
            Start::Auto => {
                search.best(&[Way::AsItStands, Way::Landmarks, Way::Shapes, Way::Lines, Way::Points])
            }
            Start::Landmarks => search.best(&[Way::Landmarks]),
            Start::Geometry => search.best(&[Way::Shapes, Way::Lines, Way::Points]),
        };
        if found.matched == 0 { self.as_it_stands(suspect) } else { found }
    }

    /// No map at all.
    pub fn as_it_stands(&self, suspect: Side) -> Registration {
        let search = Search { registrar: self, suspect };
        search.registration("identity", 0, &search.matched(Affine::IDENTITY.into(), self.radius_m))
    }

    /// The map from a suspect that is about in place.
    pub fn refine_in_place(&self, suspect: Side) -> Registration {
        Search { registrar: self, suspect }.refine("identity", Affine::IDENTITY, 0)
    }

    pub(crate) fn unit(&self) -> [f64; 2] {
        self.ground.metres_per_unit(self.reference.vertices.centre())
    }

    /// A centimetre in CRS units.
    pub(crate) fn centimetre(&self) -> f64 {
        0.01 / self.unit()[0].max(self.unit()[1])
    }

    pub(crate) fn step(&self) -> usize {
        self.reference.vertices.len().div_ceil(SAMPLE).max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use meshmark_dataset::Dimension;
    use rand_chacha::{
        ChaCha8Rng,
        rand_core::{Rng, SeedableRng},
    };

    const METRES: Ground = Ground::Plane { metres_per_unit: 1.0 };

    fn label(value: &str, point: [f64; 2]) -> Label {
        Label { value: value.into(), point, dimension: Dimension::Area }
    }

    fn scattered(n: u64, width: u64) -> Vec<[f64; 2]> {
        let mut random = ChaCha8Rng::seed_from_u64(n);
        let mut next = || (random.next_u64() % (width * 1000)) as f64 / 1000.0;
        (0..n).map(|_| [next(), next()]).collect()
    }

    #[test]
    fn landmarks_recover_a_mirrored_sheared_map_with_two_fifths_of_wrong_pairs() {
        let truth = Affine { coefficients: [-0.7, 0.4, 1.0e6, 0.2, 0.9, -5.0e5] };
        let back: Vec<[f64; 2]> = scattered(2000, 800); // reference
        let reference = VertexTable::new(back.clone()).unwrap();
        let [a, b, c, d, e, f] = truth.coefficients;
        let det = a * e - b * d;
        let invert = |p: [f64; 2]| {
            let (x, y) = (p[0] - c, p[1] - f);
            [(e * x - b * y) / det, (a * y - d * x) / det]
        };
        let suspect = VertexTable::new(back.iter().map(|p| invert(*p)).collect()).unwrap();
        let labels: Vec<Label> = (0..50).map(|i| label(&format!("n{i}"), back[i])).collect();
        let moved = |(i, l): (usize, &Label)| {
            let wrong = if i % 5 < 2 { 40.0 * (i as f64 + 1.0) } else { 0.0 };
            label(&l.value, invert([l.point[0] + wrong, l.point[1] - wrong]))
        };
        let theirs: Vec<Label> = labels.iter().enumerate().map(moved).collect();
        let ours = Side { vertices: &reference, labels: &labels, shapes: &[] };
        let theirs = Side { vertices: &suspect, labels: &theirs, shapes: &[] };
        let found = Registrar::new(ours, &METRES, 1.0).register(theirs, Start::Auto);
        assert_eq!((found.method, found.landmarks), ("landmarks", 30));
        assert!(found.rms_m.unwrap() < 1e-6, "{found:?}");
    }

    #[test]
    fn a_map_that_agrees_as_it_stands_needs_no_landmarks() {
        let reference = VertexTable::new(scattered(500, 400)).unwrap();
        let moved = reference.coords().iter().map(|p| [p[0] + 0.3, p[1] - 0.2]).collect();
        let suspect = VertexTable::new(moved).unwrap();
        let side = |vertices| Side { vertices, labels: &[], shapes: &[] };
        let found = Registrar::new(side(&reference), &METRES, 1.0).register(side(&suspect), Start::Auto);
        assert_eq!(found.method, "identity");
        assert!(found.rms_m.unwrap() < 1e-6, "{found:?}");
    }
}
