/// What can be wrong with a dataset. Every message names the input and the remedy.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // the messages are the documentation
pub enum Error {
    #[error("the source has no vector layer: give a vector dataset that GDAL can open")]
    NoLayers,
    #[error("the source has no layer \"{name}\": LAYERS may name {known}")]
    UnknownLayer { name: String, known: String },
    #[error(
        "layers \"{first}\" ({first_crs}) and \"{second}\" ({second_crs}) are not in the same CRS, and a mark \
         needs one: choose layers of one CRS with LAYERS, or reproject first"
    )]
    MixedCrs { first: String, first_crs: String, second: String, second_crs: String },
    #[error(
        "the source has no CRS and all its coordinates could be degrees: say which CRS it is with \
         SRS, for example SRS=EPSG:4326"
    )]
    NoCrs,
    #[error("the source has a CRS of its own ({crs}), and SRS={srs} is another one: leave SRS out")]
    ContradictingSrs { crs: String, srs: String },
    #[error("SRS={0} is not a CRS that PROJ knows: use for example EPSG:3067")]
    UnknownSrs(String),
    #[error("the CRS {0} is geocentric, and a map needs a projected or geographic one: reproject first")]
    Geocentric(String),
    #[error("layer \"{layer}\", feature {fid}: the coordinates ({x}, {y}) are not finite numbers")]
    NotFinite { layer: String, fid: String, x: f64, y: f64 },
    #[error("layer \"{layer}\", feature {fid}: {reason}")]
    Geometry { layer: String, fid: String, reason: String },
    #[error("layer \"{layer}\" cannot be read to its end: {reason}")]
    Unreadable { layer: String, reason: String },
    #[error("coordinates of layer \"{layer}\" cannot be brought into the CRS of the reference: {reason}")]
    Reprojection { layer: String, reason: String },
    #[error("the map has more than {most} vertices: cut it into sheets")]
    TooLarge { most: usize },
    #[error(transparent)]
    Gdal(#[from] gdal::errors::GdalError),
    #[error(transparent)]
    Core(#[from] meshmark_core::Error),
}

/// The result of every fallible function of this crate.
pub type Result<T> = std::result::Result<T, Error>;
