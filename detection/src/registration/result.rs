//! What a registration found.

use super::{
    affine::Affine,
    cubic::{Cubic, Transform},
};
use meshmark_core::counted;
use serde::Serialize;

/// The share of the smaller map's vertices that is most of them: the search ends.
const AGREE: f64 = 0.5;
/// The share of the smaller map's vertices that chance does not reach: what is costly is not tried.
const SOME_AGREE: f64 = 0.2;

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
