//! The organizer's secret.

use std::fmt::{self, Write as _};
use std::path::Path;

use chaic_files::{FileError, read_user_file, write_new_private};

/// Size of a secret, bytes: that of a SHA-256 digest.
const BYTES: usize = 32;
/// Maximum size of a secret's file, bytes: the digits and some white space.
const MAX_FILE_BYTES: u64 = 1024;

/// Key from which all seeds of a sealed split follow.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret([u8; BYTES]);

/// Hides the key, so that logs cannot disclose it.
impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret(..)")
    }
}

/// Reason why a secret cannot be made or read.
#[derive(Debug, thiserror::Error)]
pub enum SecretError {
    /// A file operation failed.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file holds no secret.
    #[error("{0}: not a secret; it must hold {n} hexadecimal digits and nothing else", n = 2 * BYTES)]
    Format(String),
    /// The operating system provides no random numbers.
    #[error("can't draw a secret: {0}")]
    Random(getrandom::Error),
}

impl Secret {
    /// Draws a secret from the operating system's random numbers and writes it to a new file, which only
    /// its owner may read.
    ///
    /// # Errors
    /// [`SecretError`] if the file exists or cannot be written.
    pub fn create(path: &Path) -> Result<Secret, SecretError> {
        let mut key = [0; BYTES];
        getrandom::fill(&mut key).map_err(SecretError::Random)?;
        write_new_private(path, (to_hex(&key) + "\n").as_bytes())?;
        Ok(Secret(key))
    }

    /// Reads a file of [`Secret::create`].
    ///
    /// # Errors
    /// [`SecretError`] if it cannot be read or holds something else.
    pub fn read(path: &Path) -> Result<Secret, SecretError> {
        let bytes = read_user_file(path, MAX_FILE_BYTES)?;
        let text = String::from_utf8_lossy(&bytes);
        let key =
            from_hex(text.trim()).ok_or_else(|| SecretError::Format(path.display().to_string()));
        Ok(Secret(key?))
    }

    /// Returns the key.
    pub(crate) fn key(&self) -> &[u8] {
        &self.0
    }
}

/// Writes bytes as lower-case hexadecimal digits.
pub(crate) fn to_hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").expect("writing to a string never fails");
        text
    })
}

fn from_hex(text: &str) -> Option<[u8; BYTES]> {
    let is_hex = text.len() == 2 * BYTES && text.bytes().all(|b| b.is_ascii_hexdigit());
    let byte = |k: usize| u8::from_str_radix(&text[2 * k..2 * k + 2], 16).ok();
    let bytes: Vec<u8> = is_hex.then(|| (0..BYTES).map_while(byte).collect())?;
    bytes.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_created_secret_is_read_again_and_never_replaced() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("secret");
        let secret = Secret::create(&path).expect("a new file");
        assert_eq!(Secret::read(&path).expect("the file"), secret);
        assert!(matches!(Secret::create(&path), Err(SecretError::File(_))));
        assert_eq!(Secret::read(&path).expect("the file"), secret);
        assert_ne!(Secret::create(&folder.path().join("other")).expect("a new file"), secret);
        assert_eq!(format!("{secret:?}"), "Secret(..)");
    }

    #[cfg(unix)]
    #[test]
    fn only_the_owner_may_read_a_secret() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("secret");
        Secret::create(&path).expect("a new file");
        let mode = std::fs::metadata(&path).expect("the file").permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
    }

    #[test]
    fn other_content_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("secret");
        let good = "0f".repeat(BYTES);
        let bad =
            [String::new(), good[1..].to_owned(), format!("{good}0"), good.replace("0f", "é")];
        for text in bad {
            std::fs::write(&path, &text).expect("a file");
            let error = Secret::read(&path).expect_err("no secret").to_string();
            assert!(error.ends_with("64 hexadecimal digits and nothing else"), "{error}");
        }
        std::fs::write(&path, format!("  {}\r\n", good.to_uppercase())).expect("a file");
        assert_eq!(Secret::read(&path).expect("the file").key(), [0x0f; BYTES]);
    }
}
