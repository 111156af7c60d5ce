//! Which part of a suspect comes from whose copy, where several fingerprints are in it.

use super::{
    evidence::FingerprintEvidence,
    request::{Request, Sought},
};
use crate::report::{Member, PatchAgreement};
use meshmark_detection::decision::Verdict;

/// The recipients whose fingerprints are in a suspect, and whose copy each patch comes from.
#[derive(Default)]
pub struct Members {
    /// The recipients, with the scores of every patch.
    pub members: Vec<Member>,
    /// The number of the member of every patch.
    pub of_patch: Vec<Option<usize>>,
}

impl Members {
    /// Finds the recipients that match, and attributes the patches to them.
    pub fn new(request: &Request, found: &FingerprintEvidence) -> Self {
        let names = match &request.sought {
            Sought::Fingerprint { recipients, .. } => &recipients[..],
            Sought::Message { .. } => &[],
        };
        let mut members: Vec<Member> = Vec::new();
        for (name, (_, answer)) in names.iter().zip(&found.recipients) {
            let is_new = members.iter().all(|member| member.recipient != *name);
            if answer.verdict == Verdict::Match && is_new {
                let patch_scores = found.patch_scores(&request.settings.key, name);
                members.push(Member { recipient: name.clone(), patch_scores });
            }
        }
        let patches = members.first().map_or(0, |member| member.patch_scores.len());
        let of_patch = (0..patches).map(|patch| owner(&members, patch)).collect();
        Members { members, of_patch }
    }

    /// Returns the recipient of every patch.
    pub fn recipients(&self) -> Vec<Option<String>> {
        let name = |number: &Option<usize>| number.map(|number| self.members[number].recipient.clone());
        self.of_patch.iter().map(name).collect()
    }
}

/// Returns the member with a clear score in a patch, clearly above that of all others: an average of
/// copies has no owner.
fn owner(members: &[Member], patch: usize) -> Option<usize> {
    let score = |number: usize| members[number].patch_scores[patch].unwrap_or(0.0);
    let best = (0..members.len()).max_by(|a, b| score(*a).total_cmp(&score(*b)))?;
    let others = (0..members.len()).filter(|number| *number != best).map(score);
    let least = others.fold(0.0, f64::max) + PatchAgreement::CLEAR;
    (score(best) >= least).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patch_belongs_to_a_member_that_is_clearly_above_all_others() {
        let member =
            |scores: [Option<f64>; 5]| Member { recipient: String::new(), patch_scores: scores.into() };
        let members = [
            member([Some(20.0), Some(20.0), Some(3.9), None, Some(-1.0)]),
            member([Some(-9.0), Some(17.0), Some(0.0), None, Some(4.0)]),
        ];
        let owners: Vec<_> = (0..5).map(|patch| owner(&members, patch)).collect();
        assert_eq!(owners, [Some(0), None, None, None, Some(1)]);
        assert_eq!(owner(&[], 0), None);
    }
}
