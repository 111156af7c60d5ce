//! The key pair that signs deposits, Ed25519, as PEM files that other programs read, too. It is not
//! derived from the secret of the marks: an auditor holds that secret and must not be able to sign.

use crate::{
    Error, Result,
    inputs::{passphrase::Passphrase, texts},
};
use ed25519_dalek::{
    Signature, Signer,
    pkcs8::{
        DecodePrivateKey, DecodePublicKey, EncodePrivateKey, EncodePublicKey, KeypairBytes,
        spki::der::pem::LineEnding,
    },
};
use meshmark_core::hex;
use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};
use zeroize::Zeroizing;

/// The secret half.
pub struct SigningKey(ed25519_dalek::SigningKey);

/// The public half.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PublicKey(ed25519_dalek::VerifyingKey);

/// Returns the path of the signing key beside a key file: `key.signing.pem` beside `key.json`.
pub fn signing_key_file(key: &Path) -> PathBuf {
    beside(key, ".signing.pem")
}

/// Returns the path of the public key beside a key file: `key.public.pem` beside `key.json`.
pub fn public_key_file(key: &Path) -> PathBuf {
    beside(key, ".public.pem")
}

fn beside(key: &Path, ending: &str) -> PathBuf {
    let is_json = key.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json"));
    let mut path = OsString::from(if is_json { key.with_extension("") } else { key.into() });
    path.push(ending);
    path.into()
}

impl SigningKey {
    /// Makes a key from random bytes of the operating system.
    ///
    /// # Errors
    /// Fails when the operating system gives none.
    pub fn random() -> Result<Self> {
        let mut bytes = Zeroizing::new([0; 32]);
        getrandom::fill(bytes.as_mut_slice()).map_err(|source| Error::Random { source })?;
        Ok(SigningKey(ed25519_dalek::SigningKey::from_bytes(&bytes)))
    }

    /// Reads the file of a signing key; `warn` receives a warning if others can read it, too.
    ///
    /// # Errors
    /// Fails on a file that is unreadable or no signing key.
    pub fn read(path: &Path, passphrase: &Passphrase, warn: &mut dyn FnMut(&str)) -> Result<Self> {
        let text = texts::secret("signing key", path, passphrase, warn)?;
        match ed25519_dalek::SigningKey::from_pkcs8_pem(&text) {
            Ok(key) => Ok(SigningKey(key)),
            Err(_) => Err(Error::NoSigningKey { path: path.into() }),
        }
    }

    /// Returns the text of its file.
    pub fn to_pem(&self) -> Zeroizing<String> {
        // Without the public half, which OpenSSL 3.0 does not read there.
        let bytes = KeypairBytes { secret_key: self.0.to_bytes(), public_key: None };
        bytes.to_pkcs8_pem(LineEnding::LF).expect("32 bytes are a key")
    }

    /// Returns the public half.
    pub fn public(&self) -> PublicKey {
        PublicKey(self.0.verifying_key())
    }

    pub(super) fn sign(&self, bytes: &[u8]) -> [u8; 64] {
        self.0.sign(bytes).to_bytes()
    }
}

impl PublicKey {
    /// Reads the file of a public key.
    ///
    /// # Errors
    /// Fails on a file that is unreadable or no public key.
    pub fn read(path: &Path) -> Result<Self> {
        let text = texts::small("public key", path)?;
        match ed25519_dalek::VerifyingKey::from_public_key_pem(&text) {
            Ok(key) => Ok(PublicKey(key)),
            Err(_) => Err(Error::NoPublicKey { path: path.into() }),
        }
    }

    /// Returns the text of its file.
    pub fn to_pem(&self) -> String {
        self.0.to_public_key_pem(LineEnding::LF).expect("32 bytes are a key")
    }

    /// Reads its 32 bytes as hexadecimal digits.
    pub(super) fn from_hex(text: &str) -> Option<Self> {
        let mut bytes = [0; 32];
        hex::decode_into(text, &mut bytes)?;
        ed25519_dalek::VerifyingKey::from_bytes(&bytes).ok().map(PublicKey)
    }

    /// Returns its 32 bytes as hexadecimal digits.
    pub fn to_hex(&self) -> String {
        hex::encode(self.0.as_bytes())
    }

    /// Returns whether the owner of the key signed `bytes`, by the strict rules of RFC 8032.
    pub(super) fn has_signed(&self, bytes: &[u8], signature: &[u8]) -> bool {
        let signature = Signature::from_slice(signature);
        signature.is_ok_and(|signature| self.0.verify_strict(bytes, &signature).is_ok())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_files_of_a_key_pair_are_named_after_the_key() {
        for (key, signing, public) in [
            ("a/key.json", "a/key.signing.pem", "a/key.public.pem"),
            ("series.1", "series.1.signing.pem", "series.1.public.pem"),
        ] {
            assert_eq!(signing_key_file(Path::new(key)), Path::new(signing));
            assert_eq!(public_key_file(Path::new(key)), Path::new(public));
        }
    }

    #[test]
    fn a_key_pair_reads_back_and_signs() {
        let folder = tempfile::tempdir().unwrap();
        let [secret, public] = ["secret.pem", "public.pem"].map(|name| folder.path().join(name));
        let key = SigningKey::random().unwrap();
        fs::write(&secret, key.to_pem().as_bytes()).unwrap();
        fs::write(&public, key.public().to_pem()).unwrap();
        let mut warnings = Vec::new();
        let none = Passphrase::new(None);
        let read = SigningKey::read(&secret, &none, &mut |text| warnings.push(text.to_string())).unwrap();
        let read_public = PublicKey::read(&public).unwrap();
        assert_eq!((read.public(), warnings.len()), (read_public.clone(), 1));
        assert_eq!(PublicKey::from_hex(&read_public.to_hex()), Some(read_public.clone()));
        let signature = read.sign(b"text");
        assert!(read_public.has_signed(b"text", &signature) && !read_public.has_signed(b"texT", &signature));
        assert!(!SigningKey::random().unwrap().public().has_signed(b"text", &signature));
        assert!(PublicKey::read(&secret).is_err() && SigningKey::read(&public, &none, &mut |_| ()).is_err());
    }
}
