//! Anchors: vertices that stay in place, so that what is marked apart fits together.

use serde::{Deserialize, Serialize};

/// The anchors of a map. In JSON they are a text of numbers, one an anchor: how many vertices lie
/// between it and the anchor before, or the first vertex.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Anchors(Vec<u32>);

impl Anchors {
    /// Creates anchors from canonical indices of vertices, in any order.
    pub fn new(mut vertices: Vec<u32>) -> Self {
        vertices.sort_unstable();
        vertices.dedup();
        Anchors(vertices)
    }

    /// Returns the canonical indices of the vertices, ascending.
    pub fn as_slice(&self) -> &[u32] {
        &self.0
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns whether a map of so many vertices has all of them.
    pub fn fit(&self, vertices: usize) -> bool {
        self.0.last().is_none_or(|&last| (last as usize) < vertices)
    }
}

impl From<Anchors> for String {
    fn from(anchors: Anchors) -> Self {
        let gap = |(number, vertex): (usize, &u32)| match number {
            0 => vertex.to_string(),
            _ => (vertex - anchors.0[number - 1] - 1).to_string(),
        };
        anchors.0.iter().enumerate().map(gap).collect::<Vec<_>>().join(" ")
    }
}

impl TryFrom<String> for Anchors {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        const FAULT: &str = "anchors are numbers of vertices between them";
        let mut next = 0u32;
        let vertex = |gap: &str| {
            let vertex = gap.parse().ok().and_then(|gap: u32| next.checked_add(gap)).ok_or(FAULT)?;
            next = vertex.checked_add(1).ok_or(FAULT)?;
            Ok(vertex)
        };
        text.split_ascii_whitespace().map(vertex).collect::<Result<_, _>>().map(Anchors)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anchors_are_written_as_the_gaps_between_them_and_read_back() {
        for (vertices, text) in [(vec![], ""), (vec![0], "0"), (vec![9, 3, 4, 3], "3 0 4")] {
            let anchors = Anchors::new(vertices);
            assert_eq!(String::from(anchors.clone()), text);
            assert_eq!(Anchors::try_from(text.to_string()), Ok(anchors));
        }
        assert!(Anchors::new(vec![3]).fit(4) && !Anchors::new(vec![3]).fit(3) && Anchors::default().fit(0));
        for bad in ["-1", "1,2", "x", "4294967295", "4294967294 4294967295"] {
            assert!(Anchors::try_from(bad.to_string()).is_err(), "{bad}");
        }
    }
}
