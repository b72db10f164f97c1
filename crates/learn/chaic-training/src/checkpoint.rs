//! Checkpoint format of all trainings.
//!
//! | bytes | content |
//! |---|---|
//! | 0 to 15 | the magic string [`MAGIC`] |
//! | 16 to 19 | format version, u32, little-endian |
//! | 20 to 35 | xxh3-128 digest of all other bytes, little-endian |
//! | 36 to the end | postcard: kind of the training, fingerprint of the network, named sections |
//!
//! The digest is verified before anything is decoded, so flipped bits, truncation and appended
//! bytes are detected. It detects damage, not forgery. Later versions keep the layout of the first
//! 36 bytes.

use std::collections::BTreeMap;

use chaic_nn::Network;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

/// First bytes of a checkpoint file.
pub const MAGIC: &[u8; 16] = b"chaic checkpoint";
/// Version of the format. Version 1 had neither magic string nor digest.
pub const VERSION: u32 = 2;

const VERSION_AT: usize = MAGIC.len();
const DIGEST_AT: usize = VERSION_AT + 4;
const BODY_AT: usize = DIGEST_AT + 16;

/// Reason why a checkpoint cannot be written or read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    /// The content differs from what was written.
    #[error(
        "is damaged: {0}; start a new training, --weights takes the weights of the last validation"
    )]
    Damaged(String),
    /// The format version is not supported.
    #[error(
        "has format version {found}, expected {VERSION}; start a new training, --weights takes its weights"
    )]
    Version {
        /// Version in the file.
        found: u32,
    },
    /// The checkpoint belongs to another kind of training.
    #[error("is of `chaic train {found}`, expected `chaic train {expected}`")]
    Kind {
        /// Kind in the file.
        found: String,
        /// Kind of this training.
        expected: String,
    },
    /// The checkpoint belongs to another network.
    #[error("belongs to another network than that of this configuration and version of chaic")]
    Network,
    /// Data of the training cannot be read, or has changed since the training began.
    #[error("cannot be continued: {0}")]
    Data(String),
    /// A section does not fit the training.
    #[error("does not fit this training: section `{section}` {problem}")]
    Section {
        /// Name of the section.
        section: String,
        /// Description of the problem, as a predicate.
        problem: String,
    },
}

impl CheckpointError {
    /// Creates an error about one section; `problem` is a predicate, such as "has 3 values,
    /// expected 4".
    pub fn section(section: &str, problem: impl Into<String>) -> CheckpointError {
        CheckpointError::Section { section: section.to_owned(), problem: problem.into() }
    }
}

/// Identity of the training that a checkpoint belongs to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Name of the training, as in `chaic train NAME`.
    pub kind: String,
    /// Digest of names and shapes of the network's parameters.
    pub network: u128,
}

impl Identity {
    /// Creates the identity of a training of this kind and network.
    pub fn new(kind: &str, network: &Network) -> Identity {
        let layout: Vec<(&str, &[usize])> =
            network.parameters().iter().map(|p| (p.name.as_str(), &p.shape[..])).collect();
        let layout = postcard::to_stdvec(&layout).expect("names and shapes can be encoded");
        Identity { kind: kind.to_owned(), network: xxh3_128(&layout) }
    }
}

/// Values of one section.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Section {
    Integers(Vec<u64>),
    Floats(Vec<f32>),
    Doubles(Vec<f64>),
    Bytes(Vec<u8>),
}

impl Section {
    fn is_finite(&self) -> bool {
        match self {
            Section::Floats(values) => values.iter().all(|x| x.is_finite()),
            Section::Doubles(values) => values.iter().all(|x| x.is_finite()),
            Section::Integers(_) | Section::Bytes(_) => true,
        }
    }
}

/// State of a training as named sections.
///
/// ```
/// use chaic_nn::Network;
/// use chaic_training::checkpoint::{Checkpoint, Identity};
///
/// let identity = Identity::new("detector", &Network::default());
/// let mut checkpoint = Checkpoint::default();
/// checkpoint.insert_integers("steps", vec![12]);
/// let bytes = checkpoint.to_bytes(&identity).unwrap();
/// assert_eq!(Checkpoint::from_bytes(&bytes, &identity), Ok(checkpoint));
/// assert!(Checkpoint::from_bytes(&bytes[1..], &identity).is_err());
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    pub(crate) sections: BTreeMap<String, Section>,
}

impl Checkpoint {
    /// Adds a section of integers.
    pub fn insert_integers(&mut self, name: &str, values: Vec<u64>) {
        self.sections.insert(name.to_owned(), Section::Integers(values));
    }

    /// Adds a section of single-precision numbers, such as weights.
    pub fn insert_floats(&mut self, name: &str, values: Vec<f32>) {
        self.sections.insert(name.to_owned(), Section::Floats(values));
    }

    /// Adds a section of double-precision numbers.
    pub fn insert_doubles(&mut self, name: &str, values: Vec<f64>) {
        self.sections.insert(name.to_owned(), Section::Doubles(values));
    }

    /// Adds a section of bytes.
    pub fn insert_bytes(&mut self, name: &str, values: Vec<u8>) {
        self.sections.insert(name.to_owned(), Section::Bytes(values));
    }

    /// Returns the only integer of a section.
    ///
    /// # Errors
    /// [`CheckpointError::Section`] if there is no such section.
    pub fn integer(&self, name: &str) -> Result<u64, CheckpointError> {
        Ok(self.integers(name, 1)?[0])
    }

    /// Returns a section of exactly `n` integers.
    ///
    /// # Errors
    /// [`CheckpointError::Section`] if there is no such section.
    pub fn integers(&self, name: &str, n: usize) -> Result<&[u64], CheckpointError> {
        match self.all_integers(name)? {
            values if values.len() == n => Ok(values),
            values => Err(wrong_length(name, values.len(), n)),
        }
    }

    /// Returns a section of any number of integers.
    ///
    /// # Errors
    /// [`CheckpointError::Section`] if there is no such section.
    pub fn all_integers(&self, name: &str) -> Result<&[u64], CheckpointError> {
        match self.sections.get(name) {
            Some(Section::Integers(values)) => Ok(values),
            other => Err(not_a_section(name, "integers", other)),
        }
    }

    /// Returns a section of exactly `n` finite single-precision numbers.
    ///
    /// # Errors
    /// [`CheckpointError::Section`] if there is no such section.
    pub fn floats(&self, name: &str, n: usize) -> Result<&[f32], CheckpointError> {
        match self.sections.get(name) {
            Some(Section::Floats(values)) if values.len() == n => Ok(values),
            Some(Section::Floats(values)) => Err(wrong_length(name, values.len(), n)),
            other => Err(not_a_section(name, "single-precision numbers", other)),
        }
    }

    /// Returns a section of any number of finite double-precision numbers.
    ///
    /// # Errors
    /// [`CheckpointError::Section`] if there is no such section.
    pub fn doubles(&self, name: &str) -> Result<&[f64], CheckpointError> {
        match self.sections.get(name) {
            Some(Section::Doubles(values)) => Ok(values),
            other => Err(not_a_section(name, "double-precision numbers", other)),
        }
    }

    /// Returns a section of bytes.
    ///
    /// # Errors
    /// [`CheckpointError::Section`] if there is no such section.
    pub fn bytes(&self, name: &str) -> Result<&[u8], CheckpointError> {
        match self.sections.get(name) {
            Some(Section::Bytes(values)) => Ok(values),
            other => Err(not_a_section(name, "bytes", other)),
        }
    }

    /// Returns the content of a checkpoint file.
    ///
    /// # Errors
    /// [`CheckpointError::Section`] if a number is not finite.
    pub fn to_bytes(&self, identity: &Identity) -> Result<Vec<u8>, CheckpointError> {
        self.check_finite()?;
        Ok(self.encode(identity))
    }

    /// Reads the content of a checkpoint file of this training.
    ///
    /// # Errors
    /// Any [`CheckpointError`]. Memory in use stays within a small multiple of the file's size.
    pub fn from_bytes(bytes: &[u8], identity: &Identity) -> Result<Checkpoint, CheckpointError> {
        let (checkpoint, network) = Checkpoint::of_kind(bytes, &identity.kind)?;
        if network != identity.network {
            return Err(CheckpointError::Network);
        }
        checkpoint.check_finite()?;
        Ok(checkpoint)
    }

    /// Reads the content of a checkpoint file of this kind of training and of any network. Returns the
    /// digest of the network too. Values are not checked.
    pub(crate) fn of_kind(bytes: &[u8], kind: &str) -> Result<(Checkpoint, u128), CheckpointError> {
        let damaged = |problem: &str| CheckpointError::Damaged(problem.to_owned());
        let Some((head, body)) = bytes.split_at_checked(BODY_AT) else {
            return Err(damaged("it is cut off, or of format version 1, which is no longer read"));
        };
        if digest(&head[..DIGEST_AT], body).to_le_bytes() != head[DIGEST_AT..] {
            return Err(damaged(match head.starts_with(MAGIC) {
                true => "its digest does not match its content",
                false => {
                    "it does not start with the magic string; format version 1 is no longer read"
                }
            }));
        }
        let version = u32::from_le_bytes(head[VERSION_AT..DIGEST_AT].try_into().expect("4 bytes"));
        if !head.starts_with(MAGIC) || version != VERSION {
            return Err(CheckpointError::Version { found: version });
        }
        // Every length is checked against the number of remaining bytes before memory is allocated.
        type Body = (Identity, BTreeMap<String, Section>);
        let Ok(((found, sections), [])) = postcard::take_from_bytes::<Body>(body) else {
            return Err(damaged("its sections cannot be read"));
        };
        if found.kind != kind {
            return Err(CheckpointError::Kind { found: found.kind, expected: kind.to_owned() });
        }
        Ok((Checkpoint { sections }, found.network))
    }

    fn check_finite(&self) -> Result<(), CheckpointError> {
        match self.sections.iter().find(|(_, section)| !section.is_finite()) {
            Some((name, _)) => {
                Err(CheckpointError::section(name, "has a value that is not finite"))
            }
            None => Ok(()),
        }
    }

    /// Returns the content of a checkpoint file without checking that values are finite.
    pub(crate) fn encode(&self, identity: &Identity) -> Vec<u8> {
        let body = postcard::to_stdvec(&(identity, &self.sections));
        with_head(&body.expect("sections can be encoded"))
    }
}

/// Returns the content of a file with this body and a matching head.
pub(crate) fn with_head(body: &[u8]) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.extend(VERSION.to_le_bytes());
    let digest = digest(&bytes, body);
    bytes.extend(digest.to_le_bytes());
    bytes.extend(body);
    bytes
}

fn digest(head: &[u8], body: &[u8]) -> u128 {
    let mut hasher = Xxh3::new();
    hasher.update(head);
    hasher.update(body);
    hasher.digest128()
}

fn wrong_length(name: &str, found: usize, expected: usize) -> CheckpointError {
    CheckpointError::section(name, format!("has {found} values, expected {expected}"))
}

fn not_a_section(name: &str, expected: &str, found: Option<&Section>) -> CheckpointError {
    let problem = if found.is_some() { "does not hold" } else { "is missing; it holds" };
    CheckpointError::section(name, format!("{problem} {expected}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn identity() -> Identity {
        let mut network = Network::default();
        network.extra_parameters("weights", 3);
        Identity::new("test", &network)
    }

    fn small() -> Checkpoint {
        let mut checkpoint = Checkpoint::default();
        checkpoint.insert_integers("steps", vec![7, u64::MAX]);
        checkpoint.insert_floats("parameters", vec![1.0, -2.5, 0.0]);
        checkpoint.insert_doubles("powers", vec![0.5]);
        checkpoint.insert_bytes("choices", vec![1, 2, 3]);
        checkpoint
    }

    #[test]
    fn a_checkpoint_is_read_back_unchanged() {
        let bytes = small().to_bytes(&identity()).unwrap();
        let read = Checkpoint::from_bytes(&bytes, &identity()).unwrap();
        assert_eq!(read, small());
        assert_eq!(read.integers("steps", 2), Ok(&[7, u64::MAX][..]));
        assert_eq!(read.floats("parameters", 3), Ok(&[1.0, -2.5, 0.0][..]));
        assert!(read.floats("parameters", 4).is_err() && read.floats("steps", 2).is_err());
        assert!(read.integer("steps").is_err() && read.bytes("missing").is_err());
        assert_eq!(bytes, small().to_bytes(&identity()).unwrap());
    }

    #[test]
    fn every_flipped_bit_truncation_and_appended_byte_is_reported_as_damage() {
        let bytes = small().to_bytes(&identity()).unwrap();
        let assert_damaged = |bytes: &[u8]| {
            let error = Checkpoint::from_bytes(bytes, &identity()).unwrap_err();
            assert!(matches!(error, CheckpointError::Damaged(_)), "{error}");
            assert!(error.to_string().starts_with("is damaged: "), "{error}");
        };
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert_damaged(&flipped);
        }
        (0..bytes.len()).for_each(|n| assert_damaged(&bytes[..n]));
        for more in [&[0][..], &[255; 40]] {
            assert_damaged(&[&bytes[..], more].concat());
        }
    }

    #[test]
    fn other_trainings_versions_and_non_finite_values_are_refused() {
        let bytes = small().to_bytes(&identity()).unwrap();
        let other = Identity { kind: "other".to_owned(), ..identity() };
        let error = Checkpoint::from_bytes(&bytes, &other).unwrap_err().to_string();
        assert_eq!(error, "is of `chaic train test`, expected `chaic train other`");
        let other = Identity { network: 1, ..identity() };
        assert_eq!(Checkpoint::from_bytes(&bytes, &other), Err(CheckpointError::Network));
        let mut next = bytes.clone();
        next[VERSION_AT] = 3;
        let matching = digest(&next[..DIGEST_AT], &next[BODY_AT..]).to_le_bytes();
        next[DIGEST_AT..BODY_AT].copy_from_slice(&matching);
        let error = Checkpoint::from_bytes(&next, &identity()).unwrap_err();
        assert_eq!(error, CheckpointError::Version { found: 3 });
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut checkpoint = small();
            checkpoint.insert_floats("parameters", vec![1.0, value, 0.0]);
            let refused = checkpoint.to_bytes(&identity()).unwrap_err();
            assert!(refused.to_string().contains("`parameters` has a value that is not finite"));
            let encoded = checkpoint.encode(&identity());
            assert_eq!(Checkpoint::from_bytes(&encoded, &identity()), Err(refused));
        }
    }

    /// Returns 2^63 in the encoding of lengths.
    fn huge() -> Vec<u8> {
        postcard::to_stdvec(&(1u64 << 63)).unwrap()
    }

    #[test]
    fn lengths_beyond_the_file_are_refused_before_memory_is_allocated() {
        // Each body ends with a length of 2^63: of the kind, the map, a name, and each section type.
        let head = postcard::to_stdvec(&identity()).unwrap();
        let section = |variant: u8| [&head[..], &[1, 1, b's', variant], &huge()].concat();
        let mut bodies = vec![huge(), [&head[..], &huge()].concat()];
        bodies.push([&head[..], &[1], &huge()].concat());
        bodies.extend((0..4).map(section));
        // The same followed by a megabyte, so that the first values exist.
        bodies.extend((0..4).map(|variant| [section(variant), vec![0; 1 << 20]].concat()));
        for body in bodies {
            let error = Checkpoint::from_bytes(&with_head(&body), &identity()).unwrap_err();
            assert!(matches!(error, CheckpointError::Damaged(_)), "{error}");
        }
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_are_read_or_refused(bytes: Vec<u8>, tail: Vec<u8>, at: usize) {
            let _ = Checkpoint::from_bytes(&bytes, &identity());
            // As the body of a file with a matching digest, and in place of the end of a valid body.
            let _ = Checkpoint::from_bytes(&with_head(&bytes), &identity());
            let valid = small().encode(&identity());
            let body = &valid[BODY_AT..];
            let altered = [&body[..at % body.len()], &tail].concat();
            let _ = Checkpoint::from_bytes(&with_head(&altered), &identity());
        }
    }
}
