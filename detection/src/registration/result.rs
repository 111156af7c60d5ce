//! The result of a registration.

use super::{
    affine::Affine,
    cubic::{Cubic, Transform},
};
use meshmark_core::counted;
use serde::Serialize;

/// Share of the vertices of the smaller map above which the search ends.
const AGREE: f64 = 0.5;
/// Share of the vertices of the smaller map that chance does not reach; above it costly starts are
/// skipped.
const SOME_AGREE: f64 = 0.2;

/// The transformation of a suspect onto the reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Registration {
    /// How it was found.
    pub method: Method,
    /// The CRS assumed for the coordinates of the suspect, where its own is missing or wrong.
    pub read_as: Option<ReadAs>,
    /// Coefficients from the coordinates of the suspect, in the CRS of the reference, to those of
    /// the reference: x′ = a x + b y + c, y′ = d x + e y + f, CRS units.
    pub affine: [f64; 6],
    /// The polynomial applied after the affine map; null where the affine map suffices.
    pub polynomial: Option<Cubic>,
    /// Number of feature pairs that agree with the result; 0 where none were needed.
    pub landmarks: usize,
    /// Root mean square distance of matched vertices, or of laid lines, after registration, metres;
    /// null when none matched.
    pub rms_m: Option<f64>,
    /// Number of matched vertices, or of laid lines, in a sample.
    #[serde(skip)]
    pub matched: usize,
    /// The same number as a share of the smaller map.
    #[serde(skip)]
    pub share: f64,
}

/// How a registration was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// From the position as it stands.
    Identity,
    /// From features with equal attribute values.
    Landmarks,
    /// From features of equal shape, and vertices in equal arrangements.
    Geometry,
    /// By the course of lines, whose vertices are new.
    Curves,
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Method::Identity => "identity",
            Method::Landmarks => "landmarks",
            Method::Geometry => "geometry",
            Method::Curves => "curves",
        })
    }
}

/// The CRS assumed for a map.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadAs {
    /// The CRS: "EPSG:3857", or WKT.
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
    /// Returns the vertices of the suspect in reference coordinates.
    pub fn apply(&self, suspect: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let transform = Transform { affine: Affine { coefficients: self.affine }, cubic: self.polynomial };
        suspect.iter().map(|p| transform.apply(*p)).collect()
    }

    /// Describes the registration in text.
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

    /// Returns whether so many vertices match that the search can end.
    pub fn agrees(&self) -> bool {
        self.share >= AGREE
    }

    /// Returns whether a fifth of the smaller map matches, which makes costly ways unnecessary.
    pub fn agrees_in_part(&self) -> bool {
        self.share >= SOME_AGREE
    }
}
