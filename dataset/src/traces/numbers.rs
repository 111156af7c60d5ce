//! The numbers in texts and bytes, whatever the format: WKT, GeoJSON, GML, lists; well-known binary
//! geometries, their hexadecimal digits or base64, the blobs of GeoPackage and SpatiaLite.

use base64::{
    Engine, alphabet,
    engine::{GeneralPurpose, GeneralPurposeConfig},
};

/// This many hexadecimal digits have a coordinate pair.
const LEAST_DIGITS: usize = 32;
const PAIR_BYTES: usize = 16;
/// This many characters of base64 hold a coordinate pair (RFC 4648).
const LEAST_CHARACTERS: usize = 22;
/// Padding stands apart from the characters, and the last of them may have bits to spare.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_allow_trailing_bits(true)
        .with_decode_padding_mode(base64::engine::DecodePaddingMode::RequireNone),
);

/// Returns the numbers of a text in their order.
pub(super) fn of_text(text: &str) -> Vec<f64> {
    let bytes = text.as_bytes();
    let (mut numbers, mut at) = (Vec::new(), 0);
    while let Some(start) = (at..bytes.len()).find(|&i| bytes[i].is_ascii_digit()) {
        let end = end_of_number(bytes, start);
        let mut start = start;
        for prefix in [b".".as_slice(), b"+-"] {
            if start > at && prefix.contains(&bytes[start - 1]) {
                start -= 1;
            }
        }
        numbers.extend(text[start..end].parse::<f64>());
        at = end;
    }
    numbers
}

/// Returns where a number ends whose first digit is at `start`.
fn end_of_number(bytes: &[u8], start: usize) -> usize {
    let digits =
        |from: usize| (from..bytes.len()).find(|&i| !bytes[i].is_ascii_digit()).unwrap_or(bytes.len());
    let mut end = digits(start);
    let has_point = start > 0 && bytes[start - 1] == b'.';
    if !has_point && bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + sign);
        if exponent > end + 1 + sign {
            end = exponent;
        }
    }
    end
}

/// Returns the number that a text is, also with a decimal comma.
pub(super) fn of_value(text: &str) -> Option<f64> {
    let text = text.trim();
    text.parse().ok().or_else(|| text.replacen(',', ".", 1).parse().ok())
}

/// Calls `f` with every two neighbouring 64-bit numbers, of either byte order, at any place.
pub(super) fn pairs_of_bytes(bytes: &[u8], mut f: impl FnMut([f64; 2])) {
    for pair in bytes.windows(PAIR_BYTES) {
        let number = |at: usize| pair[at..at + 8].try_into().expect("eight bytes");
        let (x, y) = (number(0), number(8));
        f([f64::from_le_bytes(x), f64::from_le_bytes(y)]);
        f([f64::from_be_bytes(x), f64::from_be_bytes(y)]);
    }
}

/// Returns the bytes of every run of hexadecimal digits that is long enough for a coordinate pair.
pub(super) fn bytes_of_digits(text: &str) -> impl Iterator<Item = Vec<u8>> {
    let runs = text.as_bytes().split(|byte| !byte.is_ascii_hexdigit());
    let digit = |digit: u8| char::from(digit).to_digit(16).expect("a hexadecimal digit") as u8;
    let decoded =
        move |run: &[u8]| run.chunks_exact(2).map(|pair| digit(pair[0]) << 4 | digit(pair[1])).collect();
    runs.filter(|run| run.len() >= LEAST_DIGITS).map(decoded)
}

/// Returns the bytes of every run of base64, in either alphabet (RFC 4648), that is long enough for a
/// coordinate pair.
pub(super) fn bytes_of_base64(text: &str) -> impl Iterator<Item = Vec<u8>> {
    let is_of_base64 = |byte: &u8| byte.is_ascii_alphanumeric() || b"+/-_".contains(byte);
    let standard = |byte: &u8| match byte {
        b'-' => b'+',
        b'_' => b'/',
        other => *other,
    };
    let runs = text.as_bytes().split(move |byte| !is_of_base64(byte));
    runs.filter(|run| run.len() >= LEAST_CHARACTERS).filter_map(move |run| {
        // One character alone is no byte.
        let whole = if run.len() % 4 == 1 { &run[..run.len() - 1] } else { run };
        BASE64.decode(whole.iter().map(standard).collect::<Vec<u8>>()).ok()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::engine::general_purpose;

    #[test]
    fn numbers_are_found_in_any_notation() {
        for (text, numbers) in [
            ("SRID=3067;POINT Z (1.5 -2e3 .25)", &[3067.0, 1.5, -2000.0, 0.25][..]),
            (r#"{"type":"Point","coordinates":[24.9,60.25]}"#, &[24.9, 60.25]),
            ("M1,2L-3-4e", &[1.0, 2.0, -3.0, -4.0]),
            ("1.2.3 5.", &[1.2, 0.3, 5.0]),
            ("é7E+1ä8e", &[70.0, 8.0]),
            ("no number, - . e5", &[5.0]),
            ("", &[]),
        ] {
            assert_eq!(of_text(text), numbers, "{text}");
        }
        assert_eq!(
            [of_value(" 496888,51 "), of_value("1.5"), of_value("1,2,3"), of_value("")],
            [Some(496888.51), Some(1.5), None, None]
        );
    }

    #[test]
    fn pairs_are_found_in_bytes_and_in_their_digits() {
        let wkb = |order: fn(f64) -> [u8; 8]| [&[1, 0, 0, 0, 1][..], &order(1.5), &order(-7.25)].concat();
        for bytes in [wkb(f64::to_le_bytes), wkb(f64::to_be_bytes)] {
            let has = |bytes: &[u8]| {
                let mut pairs = Vec::new();
                pairs_of_bytes(bytes, |pair| pairs.push(pair));
                pairs.contains(&[1.5, -7.25])
            };
            let text = format!("\\x{}", meshmark_core::hex::encode(&bytes));
            assert!(has(&bytes) && !has(&bytes[..20]));
            assert!(bytes_of_digits(&text).any(|bytes| has(&bytes)), "{text}");
            assert!(bytes_of_digits(&text.to_uppercase()).any(|bytes| has(&bytes)), "{text}");
            for engine in [general_purpose::STANDARD, general_purpose::URL_SAFE_NO_PAD] {
                let text = format!("data:;base64,{}", engine.encode(&bytes));
                assert!(bytes_of_base64(&text).any(|bytes| has(&bytes)), "{text}");
            }
        }
    }
}
