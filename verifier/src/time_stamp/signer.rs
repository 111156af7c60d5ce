//! The signer of a time stamp: its certificate, the purpose of that, and its chain.

use super::{Authorities, StampFault};
use cms::{
    cert::CertificateChoices,
    signed_data::{SignedData, SignerIdentifier},
};
use der::{
    Any, Decode, Encode, Sequence,
    asn1::{ObjectIdentifier, OctetString},
    oid::{AssociatedOid, db::rfc5912::ID_SHA_256},
};
use ring::digest::{self, SHA1_FOR_LEGACY_USE_ONLY, digest};
use rustls_pki_types::{CertificateDer, UnixTime};
use std::time::Duration;
use webpki::{ALL_VERIFICATION_ALGS, EndEntityCert, KeyUsage, anchor_from_trusted_cert};
use x509_cert::{
    Certificate,
    attr::Attributes,
    ext::pkix::{ExtendedKeyUsage, SubjectKeyIdentifier},
    spki::AlgorithmIdentifierOwned,
};

/// The purpose of certificates that sign time stamps.
const TIME_STAMPING: ObjectIdentifier = ObjectIdentifier::new_unwrap("1.3.6.1.5.5.7.3.8");
const TIME_STAMPING_BYTES: &[u8] = &[0x2b, 6, 1, 5, 5, 7, 3, 8];
/// The attributes that name the certificate of the signer.
const SIGNING_CERTIFICATE: ObjectIdentifier = ObjectIdentifier::new_unwrap("1.2.840.113549.1.9.16.2.12");
const SIGNING_CERTIFICATE_2: ObjectIdentifier = ObjectIdentifier::new_unwrap("1.2.840.113549.1.9.16.2.47");

type Result<T> = std::result::Result<T, StampFault>;

/// The certificate of a signer, among those that came with it.
pub(super) struct Signer {
    certificate: Certificate,
    bytes: CertificateDer<'static>,
    others: Vec<CertificateDer<'static>>,
}

impl Signer {
    /// Finds the certificate in a response or, where the response has none, among the authorities'.
    pub(super) fn find(signed: &SignedData, id: &SignerIdentifier, trusted: &Authorities) -> Result<Self> {
        let in_response = signed.certificates.iter().flat_map(|set| set.0.iter());
        let in_response = in_response.filter_map(|choice| match choice {
            CertificateChoices::Certificate(certificate) => Some(certificate.clone()),
            CertificateChoices::Other(_) => None,
        });
        let of_authorities =
            trusted.certificates().iter().filter_map(|bytes| Certificate::from_der(bytes).ok());
        let all: Vec<Certificate> = in_response.chain(of_authorities).collect();
        let own =
            all.iter().find(|certificate| is_named(certificate, id)).ok_or(StampFault::NoCertificate)?;
        let bytes = |certificate: &Certificate| certificate.to_der().map(CertificateDer::from).ok();
        Ok(Signer {
            certificate: own.clone(),
            bytes: bytes(own).ok_or(StampFault::NoCertificate)?,
            others: all.iter().filter(|certificate| *certificate != own).filter_map(bytes).collect(),
        })
    }

    /// Returns the name of the signer.
    pub(super) fn name(&self) -> String {
        self.certificate.tbs_certificate.subject.to_string()
    }

    /// Checks a signature by the key of the certificate over the digest of this algorithm.
    pub(super) fn check_signature(&self, text: &[u8], signature: &[u8]) -> Result<()> {
        let certificate = EndEntityCert::try_from(&self.bytes).map_err(chain)?;
        let is_right = |algorithm| certificate.verify_signature(algorithm, text, signature).is_ok();
        match ALL_VERIFICATION_ALGS.iter().any(|algorithm| is_right(*algorithm)) {
            true => Ok(()),
            false => Err(StampFault::Signature),
        }
    }

    /// Checks that the signed attributes name this certificate, so that no other one with the same key
    /// takes its place (RFC 5816).
    pub(super) fn check_attributes(&self, attributes: &Attributes) -> Result<()> {
        let value = |kind: ObjectIdentifier| {
            attributes.iter().find(|one| one.oid == kind)?.values.get(0)?.to_der().ok()
        };
        let named = match (value(SIGNING_CERTIFICATE_2), value(SIGNING_CERTIFICATE)) {
            (Some(bytes), _) => CertificatesV2::from_der(&bytes).ok().and_then(|named| {
                let first = named.certificates.into_iter().next()?;
                let oid = first.hash_algorithm.map_or(ID_SHA_256, |algorithm| algorithm.oid);
                Some((algorithm(&oid)?, first.hash))
            }),
            (None, Some(bytes)) => CertificatesV1::from_der(&bytes).ok().and_then(|named| {
                Some((&SHA1_FOR_LEGACY_USE_ONLY, named.certificates.into_iter().next()?.hash))
            }),
            (None, None) => None,
        };
        match named {
            Some((algorithm, hash)) if digest(algorithm, &self.bytes).as_ref() == hash.as_bytes() => Ok(()),
            _ => Err(StampFault::Signature),
        }
    }

    /// Checks that the certificate is for time stamps and nothing else (RFC 3161, section 2.3).
    pub(super) fn check_purpose(&self) -> Result<()> {
        let extensions = self.certificate.tbs_certificate.extensions.iter().flatten();
        let Some(usage) = extensions.into_iter().find(|one| one.extn_id == ExtendedKeyUsage::OID) else {
            return Err(StampFault::OtherPurpose("it names no purpose"));
        };
        let purposes = ExtendedKeyUsage::from_der(usage.extn_value.as_bytes());
        match purposes.map(|purposes| purposes.0 == [TIME_STAMPING]) {
            Ok(true) if usage.critical => Ok(()),
            Ok(true) => Err(StampFault::OtherPurpose("its purpose is not marked as critical")),
            _ => Err(StampFault::OtherPurpose("its purpose is another one")),
        }
    }

    /// Checks that a trusted authority vouched for the certificate at this time.
    pub(super) fn check_chain(&self, trusted: &Authorities, time: Duration, stated: &str) -> Result<()> {
        let anchors = trusted.certificates().iter().filter_map(|bytes| anchor_from_trusted_cert(bytes).ok());
        let anchors: Vec<_> = anchors.collect();
        let certificate = EndEntityCert::try_from(&self.bytes).map_err(chain)?;
        let verified = certificate.verify_for_usage(
            ALL_VERIFICATION_ALGS,
            &anchors,
            &self.others,
            UnixTime::since_unix_epoch(time),
            KeyUsage::required_if_present(TIME_STAMPING_BYTES),
            None, // a list of revoked certificates would have to be of that time
            None,
        );
        use webpki::Error as Fault;
        verified.map(drop).map_err(|error| match error {
            Fault::CertExpired { .. } | Fault::CertNotValidYet { .. } => StampFault::Expired(stated.into()),
            // An authority of the same name has another key.
            Fault::UnknownIssuer | Fault::InvalidSignatureForPublicKey => {
                StampFault::OtherAuthority(self.name())
            }
            other => chain(other),
        })
    }
}

fn chain(error: webpki::Error) -> StampFault {
    StampFault::Chain(error.to_string())
}

fn is_named(certificate: &Certificate, id: &SignerIdentifier) -> bool {
    let own = &certificate.tbs_certificate;
    match id {
        SignerIdentifier::IssuerAndSerialNumber(id) => {
            own.issuer == id.issuer && own.serial_number == id.serial_number
        }
        SignerIdentifier::SubjectKeyIdentifier(id) => {
            matches!(own.get::<SubjectKeyIdentifier>(), Ok(Some((_, own))) if own == *id)
        }
    }
}

/// Returns a digest algorithm that a time stamp may use.
pub(super) fn algorithm(oid: &ObjectIdentifier) -> Option<&'static digest::Algorithm> {
    use der::oid::db::rfc5912::{ID_SHA_384, ID_SHA_512};
    match *oid {
        ID_SHA_256 => Some(&digest::SHA256),
        ID_SHA_384 => Some(&digest::SHA384),
        ID_SHA_512 => Some(&digest::SHA512),
        _ => None,
    }
}

/// SigningCertificate of RFC 2634: digests by SHA-1.
#[derive(Sequence)]
struct CertificatesV1 {
    certificates: Vec<CertificateV1>,
    #[asn1(optional = "true")]
    policies: Option<Any>,
}

#[derive(Sequence)]
struct CertificateV1 {
    hash: OctetString,
    #[asn1(optional = "true")]
    issuer: Option<Any>,
}

/// SigningCertificateV2 of RFC 5035.
#[derive(Sequence)]
struct CertificatesV2 {
    certificates: Vec<CertificateV2>,
    #[asn1(optional = "true")]
    policies: Option<Any>,
}

#[derive(Sequence)]
struct CertificateV2 {
    /// SHA-256 by default.
    #[asn1(optional = "true")]
    hash_algorithm: Option<AlgorithmIdentifierOwned>,
    hash: OctetString,
    #[asn1(optional = "true")]
    issuer: Option<Any>,
}
