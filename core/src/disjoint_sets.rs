//! Disjoint sets of numbers (union-find).

/// The numbers from 0 to n − 1 in sets; one member of each set, its root, stands for it.
#[derive(Debug, Clone)]
pub struct DisjointSets(Vec<u32>);

impl DisjointSets {
    /// Creates a set for every number.
    pub fn new(count: usize) -> Self {
        DisjointSets((0..count as u32).collect())
    }

    /// Returns the root of a number's set.
    pub fn root(&mut self, mut v: u32) -> u32 {
        while self.0[v as usize] != v {
            let above = self.0[self.0[v as usize] as usize];
            self.0[v as usize] = above;
            v = above;
        }
        v
    }

    /// Joins two sets; the smaller root stays the root.
    pub fn join(&mut self, v: u32, w: u32) {
        let (a, b) = (self.root(v), self.root(w));
        self.put_under(a.max(b), a.min(b));
    }

    /// Joins the sets of two roots; `parent` stays the root.
    pub fn put_under(&mut self, root: u32, parent: u32) {
        self.0[root as usize] = parent;
    }

    /// Returns the root of every number.
    pub fn roots(mut self) -> Vec<u32> {
        (0..self.0.len() as u32).for_each(|v| self.0[v as usize] = self.root(v));
        self.0
    }
}
