//! `keygen`: a secret key, and the key pair that signs deposits.

use super::{
    arguments::KeygenArgs,
    printing::{print, warn},
};
use meshmark_core::key::SecretKey;
use meshmark_verifier::{
    Error, Result,
    deposit::{SigningKey, public_key_file, signing_key_file},
    inputs::{
        passphrase::{Passphrase, is_protected_file},
        texts,
    },
    outputs::NewFile,
};
use zeroize::Zeroizing;

pub(super) fn run(args: &KeygenArgs) -> Result<()> {
    let path = &args.key_file;
    let (signing_path, public_path) = (signing_key_file(path), public_key_file(path));
    let file = args.opening.passphrase_file.as_deref();
    let known = Passphrase::new(file);
    if args.signing_key_only {
        texts::key(path, &known, &mut warn)?; // the new key pair belongs to it
    }
    let key_file = (!args.signing_key_only).then(|| NewFile::secret("key file", path)).transpose()?;
    let signing_file = NewFile::secret("signing key", &signing_path)?;
    let public_file = NewFile::new("public key", &public_path)?;
    let passphrase = match args.signing_key_only && is_protected_file(path) {
        true => Some(known), // both have the same one
        false => args.is_protected().then(|| Passphrase::chosen(file)).transpose()?,
    };
    let protected = |text: Zeroizing<String>| match &passphrase {
        Some(passphrase) => passphrase.protect(&text).map(Zeroizing::new),
        None => Ok(text),
    };
    let key = SecretKey::filled(getrandom::fill).map_err(|source| Error::Random { source })?;
    let signing = SigningKey::random()?;
    let (public, text) = (signing.public().to_pem(), protected(key.to_json())?);
    let signing_text = protected(signing.to_pem())?;
    let is_new = key_file.is_some();
    let mut files: Vec<(NewFile, &[u8])> = key_file.into_iter().map(|file| (file, text.as_bytes())).collect();
    files.extend([(signing_file, signing_text.as_bytes()), (public_file, public.as_bytes())]);
    NewFile::write_all(&files)?;
    if is_new {
        print(&format!("key {} written to {}\n", key.id(), path.display()))?;
    }
    print(&format!("signing key written to {}\n", signing_path.display()))?;
    print(&format!("public key {} written to {}\n", signing.public().to_hex(), public_path.display()))
}
