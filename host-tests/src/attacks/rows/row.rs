//! One attack by name.

use crate::attacks::{Attack, quantisation::Quantisation};

/// One row of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// As the paper counts ("9c"), or a short name for what it does not have.
    pub id: String,
    /// What is done.
    pub title: String,
    /// How.
    pub attack: Attack,
}

impl Row {
    pub(super) fn new(id: &str, title: &str, attack: Attack) -> Self {
        Row { id: id.into(), title: title.into(), attack }
    }

    /// Whether features that are left have their attributes and ids, in the layers they were in.
    pub fn keeps_features(&self) -> bool {
        fn keeps(attack: &Attack) -> bool {
            match attack {
                Attack::Scramble
                | Attack::DropAttributes
                | Attack::Merge(_)
                | Attack::RoundTrip(_)
                | Attack::Vectorise { .. }
                | Attack::Dissolve
                | Attack::Planarise
                | Attack::Quantise(Quantisation::Svg { .. }) => false,
                Attack::Sequence(attacks) => attacks.iter().all(keeps),
                _ => true,
            }
        }
        keeps(&self.attack)
    }
}
