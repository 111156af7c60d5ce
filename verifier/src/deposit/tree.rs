//! The Merkle tree of RFC 6962 over digests. Its root stands for all of them, and the prefix that
//! distinguishes leaves from nodes makes it impossible to present one as the other.

use ct_merkle::mem_backed_tree::MemoryBackedTree;
use meshmark_core::hex;
use serde::{Deserialize, Serialize};
use sha2::Sha256;

/// Digests in ascending order, and the root of their tree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tree {
    /// The root, hexadecimal.
    pub merkle_root: String,
    /// The digests, hexadecimal: those of which the leaves of the tree are hashes.
    pub digests: Vec<String>,
}

impl Tree {
    /// Creates the tree of digests, each of which counts once.
    pub fn new(mut digests: Vec<String>) -> Self {
        digests.sort();
        digests.dedup();
        Tree { merkle_root: root(&digests), digests }
    }

    /// Returns whether the digests are in order and have this root.
    pub fn is_consistent(&self) -> bool {
        self.digests.is_sorted_by(|a, b| a < b) && root(&self.digests) == self.merkle_root
    }

    /// Returns whether it holds a digest.
    pub fn holds(&self, digest: &str) -> bool {
        self.digests.binary_search_by(|held| held.as_str().cmp(digest)).is_ok()
    }
}

/// Returns the root over the digits of the digests, which have one spelling in ascending order.
fn root(digests: &[String]) -> String {
    let mut tree = MemoryBackedTree::<Sha256, &[u8]>::new();
    digests.iter().for_each(|digest| tree.push(digest.as_bytes()));
    hex::encode(tree.root().as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sha2::Digest;

    fn hash(parts: &[&[u8]]) -> Vec<u8> {
        Sha256::digest(parts.concat()).to_vec()
    }

    /// The definition of RFC 6962, section 2.1.
    fn by_definition(leaves: &[&[u8]]) -> Vec<u8> {
        match leaves {
            [] => hash(&[]),
            [leaf] => hash(&[&[0], leaf]),
            _ => {
                let (left, right) = leaves.split_at(leaves.len().next_power_of_two() / 2);
                hash(&[&[1], &by_definition(left), &by_definition(right)])
            }
        }
    }

    #[test]
    fn the_root_is_that_of_rfc_6962_in_any_order() {
        let digests: Vec<String> = (0..9).map(|byte| hex::encode(&hash(&[&[byte]]))).collect();
        for count in 0..digests.len() {
            let mut sorted = digests[..count].to_vec();
            sorted.sort();
            let leaves: Vec<&[u8]> = sorted.iter().map(|digest| digest.as_bytes()).collect();
            let tree = Tree::new(digests[..count].iter().rev().cloned().collect());
            assert_eq!(tree.merkle_root, hex::encode(&by_definition(&leaves)), "{count} leaves");
            assert!(tree.is_consistent() && digests[..count].iter().all(|digest| tree.holds(digest)));
            assert!(!tree.holds(&digests[count]));
        }
    }

    #[test]
    fn a_tree_with_another_order_digest_or_root_is_not_consistent() {
        let tree = Tree::new(["a", "b", "c"].map(String::from).to_vec());
        let mut other = tree.clone();
        other.digests.swap(0, 1);
        assert!(!other.is_consistent());
        other = tree.clone();
        other.digests.push("d".into());
        assert!(!other.is_consistent());
        other = Tree { merkle_root: root(&[]), ..tree };
        assert!(!other.is_consistent());
    }
}
