//! Long lists of a printed scene: each is one text in base64 (RFC 4648).
//!
//! Points are their coordinates as f32, little-endian. Lists of indices are numbers in LEB128, as the packed varints of
//! protobuf: of each list, its length and its indices.

const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Returns the text of points.
pub(super) fn print_points<const N: usize>(points: &[[f32; N]]) -> String {
    let numbers = points.as_flattened().iter();
    encode(&numbers.flat_map(|number| number.to_le_bytes()).collect::<Vec<_>>())
}

/// Parses the text of points. `None`: it is something else.
pub(super) fn parse_points<const N: usize>(text: &str) -> Option<Vec<[f32; N]>> {
    let bytes = decode(text)?;
    let (numbers, rest) = bytes.as_chunks::<4>();
    let numbers: Vec<_> = numbers.iter().map(|number| f32::from_le_bytes(*number)).collect();
    let (points, numbers) = numbers.as_chunks::<N>();
    (rest.is_empty() && numbers.is_empty()).then(|| points.to_vec())
}

/// Returns the text of lists of indices.
pub(super) fn print_lists<'l>(lists: impl Iterator<Item = &'l [u32]>) -> String {
    let mut bytes = Vec::new();
    for list in lists {
        for number in [list.len() as u64].into_iter().chain(list.iter().map(|one| u64::from(*one)))
        {
            let mut rest = number;
            while rest > 0x7f {
                bytes.push(rest.to_le_bytes()[0] | 0x80);
                rest >>= 7;
            }
            bytes.push(rest.to_le_bytes()[0]);
        }
    }
    encode(&bytes)
}

/// Parses the text of lists of indices. `None`: it is something else.
pub(super) fn parse_lists(text: &str) -> Option<Vec<Vec<u32>>> {
    let bytes = decode(text)?;
    let mut bytes = bytes.iter().copied();
    let mut lists = Vec::new();
    while bytes.len() > 0 {
        let count = varint(&mut bytes)? as usize;
        // Each index takes a byte.
        if count > bytes.len() {
            return None;
        }
        let list: Option<Vec<_>> = (0..count).map(|_| varint(&mut bytes)).collect();
        lists.push(list?);
    }
    Some(lists)
}

fn varint(bytes: &mut impl Iterator<Item = u8>) -> Option<u32> {
    let mut number = 0;
    for shift in (0..35).step_by(7) {
        let byte = bytes.next()?;
        number |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return u32::try_from(number).ok();
        }
    }
    None
}

fn encode(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let byte = |index: usize| u32::from(group.get(index).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for place in 0..4 {
            let digit = ALPHABET[(bits >> (18 - 6 * place)) as usize & 63];
            text.push(if place > group.len() { '=' } else { digit.into() });
        }
    }
    text
}

fn decode(text: &str) -> Option<Vec<u8>> {
    let digits = text.trim_end_matches('=').as_bytes();
    let mut bytes = Vec::with_capacity(digits.len() / 4 * 3 + 2);
    let mut bits = 0_u32;
    for (place, digit) in digits.iter().enumerate() {
        let value = match digit {
            b'A'..=b'Z' => digit - b'A',
            b'a'..=b'z' => digit - b'a' + 26,
            b'0'..=b'9' => digit - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        // The first digit of a group completes no byte.
        if place % 4 > 0 {
            bytes.push((bits >> (6 - 2 * (place % 4))).to_le_bytes()[0]);
        }
    }
    (text.len().is_multiple_of(4) && text.len() - digits.len() < 3).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_those_of_the_standard() {
        for (bytes, text) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(encode(bytes.as_bytes()), text);
            assert_eq!(decode(text).unwrap(), bytes.as_bytes());
        }
        for wrong in ["Z", "Zg", "Zg=", "Z===", "Zm9v====", "Zm 9", "Zm9-", "====", "Zg==Zg=="] {
            assert_eq!(decode(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn points_and_lists_survive_the_round_trip() {
        let points = [[0.1, -0.0, f32::MAX], [f32::MIN_POSITIVE, 1e7, -3.5]];
        let again: Vec<[f32; 3]> = parse_points(&print_points(&points)).unwrap();
        assert_eq!(again.as_flattened().len(), 6);
        for (one, other) in again.as_flattened().iter().zip(points.as_flattened()) {
            assert_eq!(one.to_bits(), other.to_bits());
        }
        let lists = vec![vec![], vec![0, 127, 128, 16_383, 16_384], vec![u32::MAX]];
        assert_eq!(parse_lists(&print_lists(lists.iter().map(Vec::as_slice))), Some(lists));
    }

    #[test]
    fn what_is_no_whole_number_of_elements_is_refused() {
        assert_eq!(parse_points::<3>(&print_points(&[[1.0; 4]])), None);
        assert_eq!(parse_points::<1>("Zm8="), None);
        // A list of 5 indices with one, and a number without an end.
        for bytes in [[5, 1].as_slice(), &[1, 0xff], &[1, 0xff, 0xff, 0xff, 0xff, 0x7f]] {
            assert_eq!(parse_lists(&encode(bytes)), None, "{bytes:?}");
        }
    }
}
