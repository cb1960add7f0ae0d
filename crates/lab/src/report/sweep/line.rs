//! A line of a journal: a checksum in eight hexadecimal digits, a space, and JSON.
//!
//! JSON alone says nothing of a flipped digit. CRC-32 finds every damage of up to 32 bits in a row, so that one digit is always noticed.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Digits of the checksum, and the space behind it.
const PREFIX: usize = 9;

/// Returns a line with a checksum, the value as JSON, and the line's end.
///
/// # Errors
/// When the value has no form in JSON, or none that can be read again, as one with a figure that is not finite.
pub fn sealed<T: Serialize + DeserializeOwned>(value: &T) -> serde_json::Result<Vec<u8>> {
    let json = serde_json::to_vec(value)?;
    serde_json::from_slice::<T>(&json)?;
    let mut line = format!("{:08x} ", crc32fast::hash(&json)).into_bytes();
    line.extend_from_slice(&json);
    line.push(b'\n');
    Ok(line)
}

/// Returns the value of a line that has its end and is whole.
pub fn opened<T: DeserializeOwned>(line: &[u8]) -> Option<T> {
    let line = line.strip_suffix(b"\n")?;
    let (sum, json) = line.split_at_checked(PREFIX)?;
    let told = std::str::from_utf8(sum.strip_suffix(b" ")?).ok()?;
    // Written in one way only: `from_str_radix` would take a sign and capitals as well.
    (told == format!("{:08x}", crc32fast::hash(json))).then(|| serde_json::from_slice(json).ok())?
}

/// Puts a checksum before each line: for journals that are written by hand or by chance.
pub fn with_checksums(text: &[u8]) -> Vec<u8> {
    let line = |json: &[u8]| {
        [format!("{:08x} ", crc32fast::hash(json.strip_suffix(b"\n").unwrap_or(json))).as_bytes(), json].concat()
    };
    text.split_inclusive(|&byte| byte == b'\n').flat_map(line).collect()
}

/// Returns true if a file begins as journals did before their lines had checksums.
pub fn is_without_checksums(text: &[u8]) -> bool {
    text.starts_with(b"{")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_with_any_byte_changed_is_not_read() {
        let value = ("default".to_owned(), 0.125, vec![1, 2, 3]);
        let line = sealed(&value).expect("JSON");
        assert_eq!(opened::<(String, f64, Vec<u32>)>(&line), Some(value));
        for index in 0..line.len() {
            for other in [line[index] ^ 1, line[index] ^ 0x20, b'0', b'9'] {
                let mut damaged = line.clone();
                damaged[index] = other;
                let is_same = damaged == line;
                assert_eq!(opened::<(String, f64, Vec<u32>)>(&damaged).is_some(), is_same, "{index}");
            }
            assert_eq!(opened::<(String, f64, Vec<u32>)>(&line[..index]), None);
        }
    }

    #[test]
    fn lines_that_get_checksums_can_be_read() {
        let lines = with_checksums(b"[1]\n[2]\n[3");
        let read: Vec<_> = lines.split_inclusive(|&byte| byte == b'\n').map(opened::<Vec<u32>>).collect();
        assert_eq!(read, [Some(vec![1]), Some(vec![2]), None]);
    }

    #[test]
    fn a_figure_that_is_not_finite_is_refused() {
        assert!(sealed(&f64::NAN).is_err());
    }
}
