//! The certificates of the authorities that an auditor trusts.

use crate::{Error, Result, inputs::texts};
use rustls_pki_types::{CertificateDer, pem::PemObject};
use std::path::Path;

/// Certificates of authorities, which vouch for those that sign time stamps.
pub struct Authorities(Vec<CertificateDer<'static>>);

impl Authorities {
    /// Reads a bundle of certificates, PEM.
    ///
    /// # Errors
    /// Fails on a file that is unreadable or has no certificate.
    pub fn read(path: &Path) -> Result<Self> {
        let text = texts::bytes("bundle of certificates", path)?;
        let certificates: std::result::Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&text).collect();
        match certificates {
            Ok(certificates) if !certificates.is_empty() => Ok(Authorities(certificates)),
            _ => Err(Error::NoAuthorities { path: path.into() }),
        }
    }

    /// Returns the certificates.
    pub(super) fn certificates(&self) -> &[CertificateDer<'static>] {
        &self.0
    }
}
