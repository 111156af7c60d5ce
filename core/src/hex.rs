//! Bytes as hexadecimal digits.

/// Encodes each byte as two lower-case digits. The text does not grow, as it would then leave copies
/// of a secret behind.
pub fn encode(bytes: &[u8]) -> String {
    let digit = |nibble: u8| char::from_digit(nibble.into(), 16).expect("four bits are a digit");
    let mut text = String::with_capacity(2 * bytes.len());
    text.extend(bytes.iter().flat_map(|byte| [digit(byte >> 4), digit(byte & 15)]));
    text
}

/// Decodes `text`, in either case, into `bytes` and makes no other copy; returns `None` unless the
/// text is exactly the digits of that many bytes.
pub fn decode_into(text: &str, bytes: &mut [u8]) -> Option<()> {
    if text.len() != 2 * bytes.len() {
        return None;
    }
    let digit = |digit: u8| char::from(digit).to_digit(16).map(|value| value as u8);
    for (byte, pair) in bytes.iter_mut().zip(text.as_bytes().chunks_exact(2)) {
        *byte = digit(pair[0])? << 4 | digit(pair[1])?;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_bytes_and_bytes_are_digits() {
        let all: Vec<u8> = (0..=255).collect();
        let text = encode(&all);
        assert!(text.starts_with("000102") && text.ends_with("fdfeff"));
        for text in [text.to_uppercase(), text] {
            let mut read = vec![0; 256];
            assert_eq!(decode_into(&text, &mut read), Some(()));
            assert_eq!(read, all);
        }
    }

    #[test]
    fn other_texts_are_no_bytes() {
        for text in ["", "0", "012", "0g", "g0", "+1", " 1", "é"] {
            assert_eq!(decode_into(text, &mut [0]), None, "{text}");
        }
    }
}
