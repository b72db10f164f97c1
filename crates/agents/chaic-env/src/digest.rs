//! Digests of states and setups.

use std::fmt;

use chaic_world::Setup;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// A 64-bit digest, written as 16 hexadecimal digits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Digest(pub u64);

impl Digest {
    /// Returns the digest of a setup.
    pub fn of_setup(setup: &Setup) -> Digest {
        let bytes = serde_json::to_vec(setup).expect("a setup serializes to JSON");
        Digest::of_bytes(&bytes)
    }

    /// Returns the XXH3 64 digest of bytes.
    pub fn of_bytes(bytes: &[u8]) -> Digest {
        Digest(xxhash_rust::xxh3::xxh3_64(bytes))
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

impl fmt::Debug for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl Serialize for Digest {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Digest {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Digest, D::Error> {
        let text = <std::borrow::Cow<'de, str>>::deserialize(deserializer)?;
        let value = (text.len() == 16).then(|| u64::from_str_radix(&text, 16).ok()).flatten();
        let invalid = || de::Error::custom(format!("`{text}` is not a digest of 16 hex digits"));
        value.map(Digest).ok_or_else(invalid)
    }
}
