//! Parts: a part is a set of vertices with a mesh, patches and secret signs of its own.

use crate::{hex, vertices::VertexTable};
use serde::{Deserialize, Serialize};

/// The name of a part: the SHA-256 of its vertices, see [`VertexTable::sha256`]. In JSON it is 64
/// hexadecimal digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct PartDigest([u8; 32]);

impl PartDigest {
    /// Returns the name of the part that has these vertices.
    pub fn new(vertices: &VertexTable) -> Self {
        PartDigest(vertices.sha256())
    }

    pub(crate) fn as_bytes(&self) -> &[u8; 32] {
        &self.0
    }
}

/// The parts of a map that carry signs, in the order of their patches.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parts(Vec<PlacedPart>);

/// A part among the patches of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlacedPart {
    /// Its name.
    pub digest: PartDigest,
    /// The number of its first patch.
    pub first_patch: usize,
}

impl Parts {
    /// Returns the only part of a map that has these vertices.
    pub fn whole(vertices: &VertexTable) -> Self {
        Parts(vec![PlacedPart { digest: PartDigest::new(vertices), first_patch: 0 }])
    }

    /// Puts parts one after the other, given the name and the number of patches of each.
    pub fn in_turn(parts: impl IntoIterator<Item = (PartDigest, usize)>) -> Self {
        let mut patches = 0;
        let place = |(digest, count)| {
            let first_patch = patches;
            patches += count;
            PlacedPart { digest, first_patch }
        };
        Parts(parts.into_iter().map(place).collect())
    }

    /// Returns the parts in order.
    pub fn as_slice(&self) -> &[PlacedPart] {
        &self.0
    }
}

impl std::fmt::Display for PartDigest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&hex::encode(&self.0))
    }
}

impl From<PartDigest> for String {
    fn from(part: PartDigest) -> Self {
        part.to_string()
    }
}

impl TryFrom<String> for PartDigest {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        let mut digest = [0; 32];
        hex::decode_into(&text, &mut digest).ok_or("a digest has 64 hexadecimal digits")?;
        Ok(PartDigest(digest))
    }
}
