//! The names of recipients: which a new mark may have, and which look alike. A copy that was marked
//! earlier keeps any name.

use crate::{Error, Result, error::RecipientFault};
use std::collections::BTreeMap;
use unicode_normalization::UnicodeNormalization;

/// Returns why no new mark may have a name, if so.
pub fn recipient_fault(name: &str) -> Option<RecipientFault> {
    let breaks = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
    match name.contains(breaks) {
        true => Some(RecipientFault::Control),
        false => (name.trim() != name).then_some(RecipientFault::Blanks),
    }
}

/// Returns a name in the composed form of Unicode (NFC), in which spellings of one name are equal: é as
/// one character or as two.
pub fn composed(name: &str) -> String {
    name.nfc().collect()
}

/// Checks the names of the recipients of new marks, each of which gets a copy.
///
/// # Errors
/// [`Error::Recipient`], and [`Error::AlikeRecipients`] for two spellings of one name.
pub fn check_recipients(names: &[impl AsRef<str>]) -> Result<()> {
    let mut spellings = BTreeMap::new();
    for name in names.iter().map(AsRef::as_ref) {
        if let Some(fault) = recipient_fault(name) {
            return Err(Error::Recipient { name: name.into(), fault });
        }
        if *spellings.entry(composed(name)).or_insert(name) != name {
            return Err(Error::AlikeRecipients { name: name.into() });
        }
    }
    Ok(())
}
