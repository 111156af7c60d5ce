//! The response of an authority, and what it proves.

use super::{
    Authorities, StampFault,
    request::of_request,
    signer::{Signer, algorithm},
};
use crate::{Error, inputs::texts};
use cms::signed_data::{SignedData, SignerInfo};
use der::{
    Any, Choice, DateTime, Decode, DecodeValue, Encode, Sequence, Tag, Tagged,
    asn1::{Int, ObjectIdentifier, OctetString},
};
use ring::digest::digest;
use serde::Serialize;
use std::{path::Path, time::Duration};
use x509_cert::{
    attr::Attributes,
    ext::{Extensions, pkix::name::GeneralName},
};
use x509_tsp::{Accuracy, MessageImprint, TimeStampResp, TspVersion};

const CONTENT_TYPE: ObjectIdentifier = ObjectIdentifier::new_unwrap("1.2.840.113549.1.9.3");
const MESSAGE_DIGEST: ObjectIdentifier = ObjectIdentifier::new_unwrap("1.2.840.113549.1.9.4");
const SIGNED_DATA: ObjectIdentifier = ObjectIdentifier::new_unwrap("1.2.840.113549.1.7.2");
const TIME_STAMP: ObjectIdentifier = ObjectIdentifier::new_unwrap("1.2.840.113549.1.9.16.1.4");

type Result<T> = std::result::Result<T, StampFault>;

/// A time stamp whose digest, signature and certificates are right.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TimeStamp {
    /// The time at which the file existed, "2026-11-28 01:59:00 UTC".
    pub time: String,
    /// The signer, by the name in its certificate.
    pub authority: String,
}

/// TSTInfo of RFC 3161, whose time may have fractions of seconds.
#[derive(Sequence)]
struct Info {
    version: TspVersion,
    policy: ObjectIdentifier,
    message_imprint: MessageImprint,
    serial_number: Int,
    time: Any,
    #[asn1(optional = "true")]
    accuracy: Option<Accuracy>,
    #[asn1(default = "Default::default")]
    ordering: bool,
    #[asn1(optional = "true")]
    nonce: Option<Int>,
    #[asn1(context_specific = "0", tag_mode = "EXPLICIT", optional = "true")]
    authority: Option<GeneralName>,
    #[asn1(context_specific = "1", tag_mode = "IMPLICIT", optional = "true")]
    extensions: Option<Extensions>,
}

/// Verifies the response in a file as the time stamp of these bytes, and as the answer to the request
/// in a file if there is one.
///
/// # Errors
/// Fails on unreadable files, and with [`Error::TimeStamp`].
pub fn verify(
    path: &Path,
    stamped: &[u8],
    request: Option<&Path>,
    trusted: &Authorities,
) -> crate::Result<TimeStamp> {
    let response = texts::bytes("time stamp", path)?;
    let request = request.map(|path| texts::bytes("time-stamp request", path)).transpose()?;
    verify_bytes(&response, stamped, request.as_deref(), trusted)
        .map_err(|source| Error::TimeStamp { path: path.into(), source })
}

fn malformed(error: der::Error) -> StampFault {
    StampFault::Malformed(error.to_string())
}

fn is_no(what: &str) -> StampFault {
    StampFault::Malformed(format!("it is no {what}"))
}

fn verify_bytes(
    response: &[u8],
    stamped: &[u8],
    request: Option<&[u8]>,
    trusted: &Authorities,
) -> Result<TimeStamp> {
    let signed = signed_data(response)?;
    if signed.encap_content_info.econtent_type != TIME_STAMP {
        return Err(is_no("time stamp"));
    }
    let content = signed.encap_content_info.econtent.as_ref().ok_or_else(|| is_no("complete time stamp"))?;
    let content: OctetString = content.decode_as().map_err(malformed)?;
    let info = Info::from_der(content.as_bytes()).map_err(malformed)?;
    check_imprint(&info.message_imprint, stamped)?;
    if let Some(request) = request {
        let (imprint, nonce) = of_request(request)?;
        if imprint.hashed_message != info.message_imprint.hashed_message || nonce != info.nonce {
            return Err(StampFault::OtherRequest);
        }
    }
    let [signer_info] = signed.signer_infos.0.as_slice() else { return Err(is_no("stamp of one signer")) };
    let (time, stated) = time_of(&info.time)?;
    let signer = Signer::find(&signed, &signer_info.sid, trusted)?;
    check_signature(signer_info, &signer, content.as_bytes())?;
    signer.check_purpose()?;
    signer.check_chain(trusted, time, &stated)?;
    Ok(TimeStamp { time: stated, authority: signer.name() })
}

/// Returns the signed data of a response that grants the stamp.
fn signed_data(response: &[u8]) -> Result<SignedData> {
    let response = TimeStampResp::from_der(response).map_err(malformed)?;
    let status = response.status.status as u32;
    const GRANTED: u32 = 1; // 0, or 1 with modifications
    if status > GRANTED {
        let texts = response.status.status_string.iter().flatten();
        let reason: String = texts.map(|text| format!(", {}", text.as_str())).collect();
        return Err(StampFault::Refused { status, reason });
    }
    let token = response.time_stamp_token.ok_or_else(|| is_no("complete response"))?;
    match token.content_type {
        SIGNED_DATA => token.content.decode_as().map_err(malformed),
        _ => Err(is_no("signed message")),
    }
}

fn check_imprint(imprint: &MessageImprint, stamped: &[u8]) -> Result<()> {
    let oid = &imprint.hash_algorithm.oid;
    let algorithm = algorithm(oid).ok_or_else(|| StampFault::OtherAlgorithm(oid.to_string()))?;
    match digest(algorithm, stamped).as_ref() == imprint.hashed_message.as_bytes() {
        true => Ok(()),
        false => Err(StampFault::OtherFile),
    }
}

/// Checks the signature over the attributes, which hold the digest of the content.
fn check_signature(info: &SignerInfo, signer: &Signer, content: &[u8]) -> Result<()> {
    let attributes = info.signed_attrs.as_ref().ok_or(StampFault::Signature)?;
    let algorithm = algorithm(&info.digest_alg.oid)
        .ok_or_else(|| StampFault::OtherAlgorithm(info.digest_alg.oid.to_string()))?;
    let of_content: Option<OctetString> = attribute(attributes, MESSAGE_DIGEST);
    let kind: Option<ObjectIdentifier> = attribute(attributes, CONTENT_TYPE);
    let is_of_content = of_content.is_some_and(|held| held.as_bytes() == digest(algorithm, content).as_ref());
    if !is_of_content || kind != Some(TIME_STAMP) {
        return Err(StampFault::Signature);
    }
    let text = attributes.to_der().map_err(malformed)?;
    signer.check_signature(&text, info.signature.as_bytes())?;
    signer.check_attributes(attributes)
}

/// Returns the only value of an attribute.
fn attribute<T: for<'a> Choice<'a> + for<'a> DecodeValue<'a>>(
    attributes: &Attributes,
    kind: ObjectIdentifier,
) -> Option<T> {
    let values = &attributes.iter().find(|one| one.oid == kind)?.values;
    match values.len() {
        1 => values.get(0)?.decode_as().ok(),
        _ => None,
    }
}

/// Returns a time since 1970, and its text. Fractions of a second are cut off.
fn time_of(time: &Any) -> Result<(Duration, String)> {
    let no_time = || is_no("time stamp with a time in UTC");
    let text = std::str::from_utf8(time.value()).map_err(|_| no_time())?;
    let (seconds, fraction) =
        text.strip_suffix('Z').and_then(|text| text.split_at_checked(14)).ok_or_else(no_time)?;
    let is_fraction = |text: &str| text.len() > 1 && text[1..].bytes().all(|byte| byte.is_ascii_digit());
    let is_legal = seconds.bytes().all(|byte| byte.is_ascii_digit())
        && (fraction.is_empty() || fraction.starts_with('.') && is_fraction(fraction));
    if time.tag() != Tag::GeneralizedTime || !is_legal {
        return Err(no_time());
    }
    let part = |range: std::ops::Range<usize>| seconds[range].parse().expect("digits");
    let year = seconds[..4].parse().expect("digits");
    let at = DateTime::new(year, part(4..6), part(6..8), part(8..10), part(10..12), part(12..14));
    let at = at.map_err(|_| no_time())?;
    let text = format!(
        "{:04}-{:02}-{:02} {:02}:{:02}:{:02} UTC",
        at.year(),
        at.month(),
        at.day(),
        at.hour(),
        at.minutes(),
        at.seconds()
    );
    Ok((at.unix_duration(), text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_in_utc_with_or_without_fractions() {
        let time = |text: &str| time_of(&Any::new(Tag::GeneralizedTime, text.as_bytes()).unwrap());
        for text in ["20261128015900Z", "20261128015900.5Z", "20261128015900.123456Z"] {
            let (since, stated) = time(text).unwrap();
            assert_eq!((since.as_secs(), stated.as_str()), (1_795_831_140, "2026-11-28 01:59:00 UTC"));
        }
        for text in [
            "20261128015900",
            "20261128015900+0100",
            "20261328015900Z",
            "2026112801590Z",
            "20261128015900.Z",
            "",
        ] {
            assert!(time(text).is_err(), "{text}");
        }
        assert!(time_of(&Any::new(Tag::UtcTime, b"20261128015900Z".as_slice()).unwrap()).is_err());
    }
}
