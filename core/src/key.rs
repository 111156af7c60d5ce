//! The secret key k_w and its derived values.

pub use crate::options::RECIPIENT_BITS;

use crate::{Error, Result, error::KeyFault, hex, message::Message, part::PartDigest};
use hmac::{Hmac, KeyInit, Mac};
use serde::{Deserialize, Serialize};
use sha2::Sha256;
use std::{
    io::{self, Read},
    sync::Arc,
};
use zeroize::{Zeroize, ZeroizeOnDrop, Zeroizing};

const VERSION: u32 = 1;

/// A key file has 150 bytes and a record a few thousand, but the anchors of the sheets of a country take
/// some ten million; a mistaken /dev/zero has no end.
const LONGEST_TEXT: u64 = 1 << 26;
/// This many bytes are reserved for a text: a buffer that grows would leave copies of a secret
/// behind.
const USUAL_TEXT: usize = 1024;
const BYTE_ORDER_MARK: char = '\u{feff}';

/// Reads the text of a key file, a record or a plan of sheets, without the byte order mark that some
/// editors write.
///
/// # Errors
/// Fails when `source` fails, on bytes that are not UTF-8, and on more than 64 MiB.
pub fn read_text(source: impl Read) -> io::Result<Zeroizing<String>> {
    let mut text = Zeroizing::new(String::with_capacity(USUAL_TEXT));
    source.take(LONGEST_TEXT + 1).read_to_string(&mut text)?;
    if text.len() as u64 > LONGEST_TEXT {
        return Err(io::Error::other(format!(
            "it is longer than the {LONGEST_TEXT} bytes of any key, record or plan"
        )));
    }
    if text.starts_with(BYTE_ORDER_MARK) {
        text.remove(0);
    }
    Ok(text)
}

/// Returns whether a passphrase protects a text, which then is in the format of `age`, armoured.
pub fn is_protected(text: &str) -> bool {
    text.trim_start().starts_with("-----BEGIN AGE ENCRYPTED FILE-----")
}

/// The versions of the mark, whose secrets are independent of each other.
#[derive(Clone, Copy)]
enum MarkVersion {
    /// A message.
    One,
    /// A fingerprint.
    Two,
}

/// A 256-bit secret. `Debug` does not show it, and it is wiped from memory when dropped. It stays in
/// one place: whatever holds it moves without leaving copies behind, and clones share it.
#[derive(Clone)]
pub struct SecretKey(Arc<Zeroizing<[u8; SECRET_BYTES]>>);

const SECRET_BYTES: usize = 32;

/// The key file (JSON).
#[derive(Serialize, Deserialize, ZeroizeOnDrop)]
#[serde(deny_unknown_fields)]
struct KeyFile {
    #[zeroize(skip)]
    meshmark_key: u32,
    #[zeroize(skip)]
    id: String,
    secret: String,
}

impl SecretKey {
    /// Creates the key with the secret that `fill` writes, which must come from the operating
    /// system's generator.
    ///
    /// # Errors
    /// Returns the error of `fill`.
    pub fn filled<E>(
        fill: impl FnOnce(&mut [u8]) -> std::result::Result<(), E>,
    ) -> std::result::Result<Self, E> {
        let mut secret = Arc::new(Zeroizing::new([0; SECRET_BYTES]));
        fill(Arc::get_mut(&mut secret).expect("nobody shares it yet").as_mut_slice())?;
        Ok(SecretKey(secret))
    }

    /// Creates the key with these 32 bytes, for trials and tests: the caller has a copy.
    pub fn from_bytes(secret: [u8; SECRET_BYTES]) -> Self {
        SecretKey(Arc::new(Zeroizing::new(secret)))
    }

    /// Reads a key file's text.
    ///
    /// # Errors
    /// [`Error::Key`] when it is not a key file of this version or its id is not that of its
    /// secret. The message never holds the secret.
    pub fn from_json(text: &str) -> Result<Self> {
        if is_protected(text) {
            return Err(Error::Key(KeyFault::Protected));
        }
        // The messages of serde may quote values of the file, so they are not shown.
        let file: KeyFile = serde_json::from_str(text).map_err(|_| Error::Key(KeyFault::Json))?;
        if file.meshmark_key != VERSION {
            let found = file.meshmark_key;
            return Err(Error::Key(KeyFault::Version { found, expected: VERSION }));
        }
        let decoded =
            |secret: &mut [u8]| hex::decode_into(&file.secret, secret).ok_or(Error::Key(KeyFault::Secret));
        let key = SecretKey::filled(decoded)?;
        if key.id() != file.id {
            return Err(Error::Key(KeyFault::Id));
        }
        Ok(key)
    }

    /// Returns the text of a key file.
    pub fn to_json(&self) -> Zeroizing<String> {
        let file = KeyFile { meshmark_key: VERSION, id: self.id(), secret: hex::encode(self.0.as_slice()) };
        let mut text = Zeroizing::new(Vec::with_capacity(USUAL_TEXT));
        serde_json::to_writer_pretty(&mut *text, &file).expect("strings are JSON");
        text.push(b'\n');
        Zeroizing::new(String::from_utf8(std::mem::take(&mut *text)).expect("JSON is UTF-8"))
    }

    /// Returns the public name of the key: 64 bits of a keyed hash, in hexadecimal.
    pub fn id(&self) -> String {
        hex::encode(&self.derive("key id", b"")[..8])
    }

    /// Returns the message of a recipient: [`RECIPIENT_BITS`] of a keyed hash of the text.
    pub fn recipient_message(&self, recipient: &str) -> Message {
        Message::from_bytes(&self.derive("recipient", recipient.as_bytes())[..RECIPIENT_BITS / 8])
    }

    /// Returns as many key-dependent bits as `half` has, for one round of the whitening of messages
    /// of `message_bits` bits.
    pub(crate) fn round_bits(&self, message_bits: usize, round: u8, half: &[bool]) -> Vec<bool> {
        const BITS: usize = 256; // of one HMAC
        let half_bytes: Vec<u8> = half.iter().map(|bit| u8::from(*bit)).collect();
        let block = |number: usize| {
            let [low, high] = (message_bits as u16).to_le_bytes();
            let text = [&[low, high, round, number as u8], &half_bytes[..]].concat();
            Message::from_bytes(&self.derive("whitening", &text)).bits().to_vec()
        };
        (0..half.len().div_ceil(BITS)).flat_map(block).take(half.len()).collect()
    }

    /// Returns the seed of the chip streams.
    pub(crate) fn chip_seed(&self) -> [u8; 32] {
        self.derive("chips", b"")
    }

    /// Returns 256 bits of a keyed hash, in hexadecimal, that commit to the key: nobody can find
    /// another key with the same ones.
    pub fn commitment(&self) -> String {
        hex::encode(&self.derive_for(MarkVersion::Two, "key commitment", b""))
    }

    /// Returns 256 bits of a keyed hash of a recipient, in hexadecimal: whoever has the key finds the
    /// recipient in a list of them, and nobody else learns a name from it.
    pub fn blinded(&self, recipient: &str) -> String {
        hex::encode(&self.derive_for(MarkVersion::Two, "blinded recipient", recipient.as_bytes()))
    }

    /// Returns the seed of the signs that all copies of a part have in common.
    pub(crate) fn pilot_seed(&self, part: &PartDigest) -> [u8; 32] {
        self.derive_for(MarkVersion::Two, "pilots", part.as_bytes())
    }

    /// Returns the seed of the signs of a recipient on a part.
    pub(crate) fn recipient_seed(&self, part: &PartDigest, recipient: &str) -> [u8; 32] {
        // The digest has a fixed length, so that part and recipient cannot run into each other.
        let text = [part.as_bytes(), recipient.as_bytes()].concat();
        self.derive_for(MarkVersion::Two, "fingerprint", &text)
    }

    fn derive(&self, purpose: &str, text: &[u8]) -> [u8; 32] {
        self.derive_for(MarkVersion::One, purpose, text)
    }

    /// Returns the HMAC-SHA-256 (FIPS 198-1) of a version of the mark, a purpose and a text, so
    /// that one use of the key reveals nothing about another.
    fn derive_for(&self, version: MarkVersion, purpose: &str, text: &[u8]) -> [u8; 32] {
        let hash = self.keyed_hash(version, purpose, text);
        wipe_stack();
        hash
    }

    /// Leaves copies of the secret on the stack.
    #[inline(never)]
    fn keyed_hash(&self, version: MarkVersion, purpose: &str, text: &[u8]) -> [u8; 32] {
        let mut mac = Hmac::<Sha256>::new_from_slice(self.0.as_slice()).expect("HMAC takes any key length");
        mac.update(match version {
            MarkVersion::One => b"meshmark v1 ",
            MarkVersion::Two => b"meshmark v2 ",
        });
        mac.update(purpose.as_bytes());
        mac.update(&[0]);
        mac.update(text);
        mac.finalize().into_bytes().into()
    }
}

/// Overwrites the stack below the caller, on which the functions that it called left their variables.
#[inline(never)]
fn wipe_stack() {
    let mut below = [0_u8; DEEPEST_BYTES];
    below.zeroize();
    std::hint::black_box(&below);
}

/// More stack than a keyed hash uses.
const DEEPEST_BYTES: usize = 8192;

impl std::fmt::Debug for SecretKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "SecretKey(id {})", self.id())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_file_reads_back_and_debug_hides_the_secret() {
        let key = SecretKey::from_bytes([0xab; 32]);
        let read = SecretKey::from_json(&key.to_json()).unwrap();
        assert_eq!(read.0, key.0);
        assert!(!format!("{read:?}").contains("abab"));
    }

    #[test]
    fn a_changed_key_file_is_refused_without_quoting_it() {
        let text = SecretKey::from_bytes([0xab; 32]).to_json().to_string();
        for bad in [
            text.replace("ababab", "ababac"),
            text.replace("\"abab", "\"ab"),
            text.replace("\"meshmark_key\": 1", "\"meshmark_key\": 2"),
            text.replace("secret", "password"),
            String::from("{}"),
            String::new(),
        ] {
            let error = SecretKey::from_json(&bad).unwrap_err().to_string();
            assert!(error.contains("malformed key") && !error.contains("abab"), "{error}");
        }
    }

    #[test]
    fn a_protected_key_is_refused_with_the_way_to_open_it() {
        let text = "-----BEGIN AGE ENCRYPTED FILE-----\nYWdl\n-----END AGE ENCRYPTED FILE-----\n";
        let error = SecretKey::from_json(text).unwrap_err().to_string();
        assert!(error.contains("age -d key.json"), "{error}");
        assert!(is_protected(text) && !is_protected(&SecretKey::from_bytes([1; 32]).to_json()));
    }

    #[test]
    fn a_text_is_read_to_its_end_or_refused() {
        let text = "ä".repeat(1 << 19);
        assert_eq!(*read_text(text.as_bytes()).unwrap(), text);
        assert_eq!(*read_text(format!("\u{feff}{text}").as_bytes()).unwrap(), text);
        for (endless, reason) in [(b' ', "longer than the 67108864 bytes"), (0xff, "UTF-8")] {
            let error = read_text(io::repeat(endless)).unwrap_err().to_string();
            assert!(error.contains(reason), "{error}");
        }
    }

    #[test]
    fn recipients_and_keys_have_messages_of_their_own() {
        let (a, b) = (SecretKey::from_bytes([1; 32]), SecretKey::from_bytes([2; 32]));
        assert_eq!(a.recipient_message("ACME").len(), RECIPIENT_BITS);
        assert_ne!(a.recipient_message("ACME"), a.recipient_message("ACME "));
        assert_ne!(a.recipient_message("ACME"), b.recipient_message("ACME"));
        assert_ne!(a.id(), b.id());
    }

    #[test]
    fn a_commitment_has_256_bits_of_its_own() {
        let [a, b] = [1, 2].map(|byte| SecretKey::from_bytes([byte; 32]));
        assert_eq!(a.commitment().len(), 64);
        assert_ne!(a.commitment(), b.commitment());
        assert!(!a.commitment().starts_with(&a.id()));
    }

    #[test]
    fn a_blinded_recipient_depends_on_key_and_name_and_on_no_other_use_of_them() {
        let [a, b] = [1, 2].map(|byte| SecretKey::from_bytes([byte; 32]));
        assert_eq!(a.blinded("ACME"), a.blinded("ACME"));
        assert_ne!(a.blinded("ACME"), a.blinded("ACME "));
        assert_ne!(a.blinded("ACME"), b.blinded("ACME"));
        assert_ne!(a.blinded(""), a.commitment());
    }
}
