//! Why a map cannot be marked, whatever reads it.

use meshmark_core::options::Spelling;
use std::fmt;

/// The errors of maps. Every message names the input and the remedy.
#[derive(Debug)]
#[allow(missing_docs)] // the messages are the documentation
pub enum Error {
    UnknownLayer { name: String, known: String },
    MixedCrs { first: String, first_crs: String, second: String, second_crs: String },
    NoCrs,
    ContradictingSrs { crs: String, srs: String },
    UnknownSrs(String),
    Geocentric(String),
    NotFinite { layer: String, fid: String, x: f64, y: f64 },
    TooFar { layer: String, fid: String, x: f64, y: f64 },
    Geometry { layer: String, fid: String, source: Fault },
    TooLarge { most: usize },
    TooSmall { size_m: f64, tolerance_m: f64 },
    UnevenScale { ends: [[f64; 2]; 2], off_percent: f64, crs: String },
    Reprojection { layer: String, source: Fault },
    FewPlaces { layer: String, crs: String },
    LostBase { vertices_sha256: String },
    Core(meshmark_core::Error),
}

/// The fault of a library, or of the bytes of a geometry.
pub type Fault = Box<dyn std::error::Error + Send + Sync>;

/// The result of every fallible function of this crate.
pub type Result<T> = std::result::Result<T, Error>;

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.text(Spelling::OpenOption))
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Error::Geometry { source, .. } | Error::Reprojection { source, .. } => Some(&**source),
            Error::Core(source) => Some(source),
            _ => None,
        }
    }
}

impl From<meshmark_core::Error> for Error {
    fn from(error: meshmark_core::Error) -> Self {
        Error::Core(error)
    }
}

impl Error {
    /// Creates the error of a geometry that cannot be read.
    pub fn geometry(layer: &str, fid: String, source: impl Into<Fault>) -> Self {
        Error::Geometry { layer: layer.into(), fid, source: source.into() }
    }

    /// Returns whether other options, layers or another CRS would allow a mark, while the features can
    /// be read.
    pub fn is_about_options(&self) -> bool {
        match self {
            Error::UnknownLayer { .. }
            | Error::MixedCrs { .. }
            | Error::NoCrs
            | Error::Geocentric(_)
            | Error::Core(_) => true,
            Error::ContradictingSrs { .. } | Error::UnknownSrs(_) => true,
            Error::TooSmall { .. } | Error::UnevenScale { .. } | Error::Reprojection { .. } => true,
            Error::NotFinite { .. } | Error::TooFar { .. } | Error::Geometry { .. } => false,
            Error::TooLarge { .. } | Error::FewPlaces { .. } | Error::LostBase { .. } => false,
        }
    }

    /// Returns whether a map lacks the layers or the CRS that options give it.
    pub fn is_of_other_layers(&self) -> bool {
        matches!(self, Error::UnknownLayer { .. } | Error::ContradictingSrs { .. })
    }

    /// Returns the fault of a feature without the remedy.
    pub(crate) fn fault(&self) -> String {
        match self {
            Error::NotFinite { layer, fid, x, y } => format!(
                "layer \"{layer}\", feature {fid}: the coordinates ({x:?}, {y:?}) are not finite numbers"
            ),
            Error::TooFar { layer, fid, x, y } => format!(
                "layer \"{layer}\", feature {fid}: the coordinates ({x:?}, {y:?}) are further away than any place in the \
                 CRS of the map"
            ),
            other => other.to_string(),
        }
    }

    /// Returns the message, with options spelled as in the user's front end.
    pub fn text(&self, spelling: Spelling) -> String {
        match self {
            Error::UnknownLayer { name, known } => {
                format!("the map has no layer \"{name}\": {} may name {known}", spelling.name("LAYERS"))
            }
            Error::MixedCrs { first, first_crs, second, second_crs } => {
                // In Python the layers are the argument itself.
                let with = match spelling {
                    Spelling::Keyword => String::new(),
                    _ => format!(" with {}", spelling.name("LAYERS")),
                };
                format!(
                    "layers \"{first}\" ({first_crs}) and \"{second}\" ({second_crs}) are not in the same CRS, and a \
                     mark needs one: choose layers of one CRS{with}, or reproject first"
                )
            }
            Error::NoCrs => format!(
                "the map has no CRS and all its coordinates could be degrees: say which CRS it is, for example {}",
                spelling.value("SRS", "EPSG:4326")
            ),
            Error::ContradictingSrs { crs, srs } => format!(
                "the map has a CRS of its own ({crs}), and {} is another one: leave {} out",
                spelling.value("SRS", srs),
                spelling.name("SRS")
            ),
            Error::UnknownSrs(text) => {
                format!(
                    "{} is not a CRS that PROJ knows: use for example EPSG:3067",
                    spelling.value("SRS", text)
                )
            }
            Error::Geocentric(crs) => {
                format!(
                    "the CRS {crs} is geocentric, and a map needs a projected or geographic one: reproject first"
                )
            }
            Error::NotFinite { .. } | Error::TooFar { .. } => {
                format!("{}: correct the feature, or leave it out", self.fault())
            }
            Error::Geometry { layer, fid, source } => format!("layer \"{layer}\", feature {fid}: {source}"),
            Error::TooLarge { most } => format!("the map has more than {most} vertices: cut it into sheets"),
            Error::TooSmall { size_m, tolerance_m } => format!(
                "the whole map is {size_m:.1e} m wide, and the mark moves vertices by up to {} m: if the units are not \
                 those of its CRS, correct that ({}, -a_srs), else lower {} and {}",
                spelling.value("TOLERANCE", tolerance_m),
                spelling.name("SRS"),
                spelling.name("TOLERANCE"),
                spelling.name("AMPLITUDE")
            ),
            Error::UnevenScale { ends: [shortest, longest], off_percent, crs } => format!(
                "the scale of {crs} differs by {off_percent:.0} % from the one that the mark of a message takes for the whole \
                 map, so vertices would move further than is asked for: a unit is the shortest at the vertex ({}, {}), and \
                 the longest at ({}, {}); mark for a recipient without {} and {}, reproject the map, for example to its UTM zone or to \
                 EPSG:4326, or leave out what lies far from the rest",
                shortest[0],
                shortest[1],
                longest[0],
                longest[1],
                spelling.name("CODE"),
                spelling.name("CHIP_RATE")
            ),
            Error::Reprojection { layer, source } => format!(
                "coordinates of layer \"{layer}\" cannot be brought into the CRS of the reference: {source}"
            ),
            Error::FewPlaces { layer, crs } => {
                format!("most coordinates of layer \"{layer}\" have no place in {crs}: it is not their CRS")
            }
            Error::LostBase { vertices_sha256 } => format!(
                "no map given is the reference of a base whose vertices have the SHA-256 {vertices_sha256}: give its file, \
                 unchanged, with those of all editions that the bases rest on"
            ),
            Error::Core(error) => error.text(spelling),
        }
    }
}
