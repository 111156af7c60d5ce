//! The evidence for a verdict as a map: the places of matched vertices, and the score of each
//! patch.

/// A matched vertex of the reference.
#[derive(Debug, Clone, Copy)]
pub struct FoundVertex {
    /// Its place in the reference, CRS units.
    pub at: [f64; 2],
    /// The number of its patch.
    pub patch: usize,
    /// Its displacement; `None` unless exact displacements are asked for.
    pub displacement: Option<ExactDisplacement>,
    /// The weight: 1, or less where the displacement disagrees with the others.
    pub weight: f64,
}

/// The exact displacement of a matched vertex.
#[derive(Debug, Clone, Copy)]
pub struct ExactDisplacement {
    /// Its place in the suspect after registration, CRS units.
    pub to: [f64; 2],
    /// The displacement from the reference, metres on the ground.
    pub moved_m: [f64; 2],
}

/// The evidence of one patch.
#[derive(Debug, Clone)]
pub struct PatchEvidence {
    /// The vertices of the reference in the patch, CRS units.
    pub vertices: Vec<[f64; 2]>,
    /// Number of matched vertices.
    pub found: usize,
    /// The score in standard deviations of a random key; `None` where no vertex matches or no
    /// message is expected.
    pub score: Option<f64>,
    /// The recipient from whose copy the patch comes; `None` where it is not clear.
    pub recipient: Option<String>,
}

/// The places of matched vertices, and the evidence of each patch.
#[derive(Debug, Clone)]
pub struct EvidenceMap {
    /// Matched vertices in canonical order.
    pub vertices: Vec<FoundVertex>,
    /// Whether the vertices have their exact displacements.
    pub has_displacements: bool,
    /// All patches, with or without matched vertices.
    pub patches: Vec<PatchEvidence>,
}

impl EvidenceMap {
    /// Adds the score of every patch for the expected mark, and the recipient from whose copy it
    /// comes; without these the map stays unchanged.
    pub fn scored(mut self, scores: Vec<Option<f64>>, recipients: Vec<Option<String>>) -> Self {
        self.patches.iter_mut().zip(scores).for_each(|(patch, score)| patch.score = score);
        self.patches.iter_mut().zip(recipients).for_each(|(patch, recipient)| patch.recipient = recipient);
        self
    }
}
