//! One attack by name.

use crate::attacks::{Attack, quantisation::Quantisation};

/// One row of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The number in the paper ("9c"), or a short name.
    pub id: String,
    /// A description of the attack.
    pub title: String,
    /// The attack.
    pub attack: Attack,
}

impl Row {
    pub(super) fn new(id: &str, title: &str, attack: Attack) -> Self {
        Row { id: id.into(), title: title.into(), attack }
    }

    /// Returns whether the remaining features keep their attributes, ids and layers.
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
