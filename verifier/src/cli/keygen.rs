//! `keygen`: a secret key, and the key pair that signs deposits.

use super::{arguments::KeygenArgs, printing::print};
use meshmark_core::key::SecretKey;
use meshmark_verifier::{
    Error, Result,
    deposit::{SigningKey, public_key_file, signing_key_file},
    inputs::texts,
    outputs::NewFile,
};

pub(super) fn run(args: &KeygenArgs) -> Result<()> {
    let path = &args.key_file;
    let (signing_path, public_path) = (signing_key_file(path), public_key_file(path));
    let key = match args.signing_key_only {
        true => None,
        false => Some(SecretKey::filled(getrandom::fill).map_err(|source| Error::Random { source })?),
    };
    if key.is_none() {
        texts::key(path, &mut super::printing::warn)?; // there is a key that the new one belongs to
    }
    let signing = SigningKey::random()?;
    let (text, secret, public) =
        (key.as_ref().map(SecretKey::to_json), signing.to_pem(), signing.public().to_pem());
    let mut files = Vec::new();
    if let Some(text) = &text {
        files.push((NewFile::secret("key file", path)?, text.as_bytes()));
    }
    files.push((NewFile::secret("signing key", &signing_path)?, secret.as_bytes()));
    files.push((NewFile::new("public key", &public_path)?, public.as_bytes()));
    NewFile::write_all(&files)?;
    if let Some(key) = key {
        print(&format!("key {} written to {}\n", key.id(), path.display()))?;
    }
    print(&format!("signing key written to {}\n", signing_path.display()))?;
    print(&format!("public key {} written to {}\n", signing.public().to_hex(), public_path.display()))
}
