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
    pub fn of(vertices: &VertexTable) -> Self {
        PartDigest(vertices.sha256())
    }

    pub(crate) fn as_bytes(&self) -> &[u8; 32] {
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
