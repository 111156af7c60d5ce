//! The request for a time stamp.

use super::StampFault;
use crate::{Error, Result};
use der::{
    Any, Decode, Encode,
    asn1::{Int, OctetString},
    oid::db::rfc5912::ID_SHA_256,
};
use ring::digest::{SHA256, digest};
use x509_cert::spki::AlgorithmIdentifier;
use x509_tsp::{MessageImprint, TimeStampReq, TspVersion};

const NONCE_BYTES: usize = 16;

/// Returns a request for a time stamp of these bytes. It asks for the certificate of the signer, and
/// its random nonce makes it impossible to present an older answer.
///
/// # Errors
/// Fails when the operating system gives no random bytes.
pub fn request(stamped: &[u8]) -> Result<Vec<u8>> {
    let mut nonce = [0; NONCE_BYTES];
    getrandom::fill(&mut nonce).map_err(|source| Error::Random { source })?;
    nonce[0] = nonce[0] & 0x7f | 0x40; // positive, and as long as any other
    let request = TimeStampReq {
        version: TspVersion::V1,
        message_imprint: MessageImprint {
            hash_algorithm: AlgorithmIdentifier { oid: ID_SHA_256, parameters: Some(Any::null()) },
            hashed_message: OctetString::new(digest(&SHA256, stamped).as_ref()).expect("32 bytes"),
        },
        req_policy: None,
        nonce: Some(Int::new(&nonce).expect("16 bytes")),
        cert_req: true,
        extensions: None,
    };
    Ok(request.to_der().expect("a short message"))
}

/// Returns the digest and the nonce of a request.
pub(super) fn of_request(bytes: &[u8]) -> std::result::Result<(MessageImprint, Option<Int>), StampFault> {
    let malformed = |error: der::Error| StampFault::Malformed(format!("its request is none, {error}"));
    let request = TimeStampReq::from_der(bytes).map_err(malformed)?;
    Ok((request.message_imprint, request.nonce))
}
