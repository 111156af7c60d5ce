//! The kinds of observations.

use serde::Serialize;

/// What the displacements of the reference vertices were observed on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Observations {
    /// On matched vertices of the suspect.
    Vertices,
    /// On the corners between edges of the reference on which lines of the suspect lie.
    Corners,
    /// On the centroids of polygons.
    Centroids,
    /// On opposite corners of the bounding boxes of polygons.
    Boxes,
}

impl Observations {
    /// Returns whether points of features are observed in place of vertices.
    pub fn is_of_features(self) -> bool {
        matches!(self, Observations::Centroids | Observations::Boxes)
    }
}
