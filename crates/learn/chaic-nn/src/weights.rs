//! Numbers of a network as a safetensors file, which is data alone: loading one runs nothing.

use std::collections::HashMap;

use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};

use crate::network::Network;

/// The one entry of a file's metadata: what the numbers are of.
const KIND: &str = "kind";

/// Why a file holds no numbers for a network.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WeightsError {
    /// It is no safetensors file, or cut off.
    #[error("these are no weights: {0}")]
    Format(String),
    /// It is of something else.
    #[error("these are weights of `{found}`; `{expected}` is needed")]
    Kind {
        /// What the file says that it is of.
        found: String,
        /// What was asked for.
        expected: String,
    },
    /// A list of numbers isn't there.
    #[error("these weights have no `{0}`")]
    Missing(String),
    /// A list that the network doesn't have.
    #[error("these weights have `{0}`, which this network doesn't")]
    Unknown(String),
    /// A list of numbers has another shape or type.
    #[error("`{name}` is {found}; {expected} is needed")]
    Shape {
        /// Its name.
        name: String,
        /// Its type and shape.
        found: String,
        /// What the network needs.
        expected: String,
    },
    /// A number is not finite.
    #[error("`{0}` has a number that is not finite")]
    NotFinite(String),
}

/// Returns the numbers as a file. `kind` names what they are of, its version included.
///
/// # Errors
/// [`WeightsError::NotFinite`] if a number is not finite.
pub fn to_bytes(network: &Network, numbers: &[f32], kind: &str) -> Result<Vec<u8>, WeightsError> {
    let is_finite = |p: &&crate::Parameter| numbers[p.range.clone()].iter().all(|x| x.is_finite());
    if let Some(parameter) = network.parameters().iter().find(|p| !is_finite(p)) {
        return Err(WeightsError::NotFinite(parameter.name.clone()));
    }
    Ok(encode(network, numbers, kind))
}

/// Returns the numbers as a file, whether they are finite or not.
fn encode(network: &Network, numbers: &[f32], kind: &str) -> Vec<u8> {
    let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    let view = |p: &crate::Parameter| {
        let data = &bytes[4 * p.range.start..4 * p.range.end];
        let view = TensorView::new(Dtype::F32, p.shape.clone(), data);
        (p.name.clone(), view.expect("as many bytes as its shape says"))
    };
    // One entry: a map of several would be written in any order.
    let metadata = HashMap::from([(KIND.to_owned(), kind.to_owned())]);
    let views = network.parameters().iter().map(view);
    serialize(views, Some(metadata)).expect("names and shapes are small")
}

/// Twelve digits that name the content of a file.
pub fn digest(bytes: &[u8]) -> String {
    format!("{:012x}", xxhash_rust::xxh3::xxh3_64(bytes) >> 16)
}

/// Returns the digest of the file that these numbers make, whether they are finite or not.
pub fn digest_of(network: &Network, numbers: &[f32], kind: &str) -> String {
    digest(&encode(network, numbers, kind))
}

/// The numbers in a file.
///
/// # Errors
/// [`WeightsError`] if it isn't a whole file of this kind for this network.
pub fn from_bytes(network: &Network, bytes: &[u8], kind: &str) -> Result<Vec<f32>, WeightsError> {
    let bad = |e: &dyn std::fmt::Display| WeightsError::Format(e.to_string());
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(|e| bad(&e))?;
    let found = metadata.metadata().as_ref().and_then(|m| m.get(KIND)).cloned();
    let found = found.unwrap_or_default();
    if found != kind {
        return Err(WeightsError::Kind { found, expected: kind.to_owned() });
    }
    let file = SafeTensors::deserialize(bytes).map_err(|e| bad(&e))?;
    let mut names = file.names();
    names.sort_unstable();
    let knows = |name: &&&str| network.parameters().iter().any(|p| p.name == **name);
    if let Some(name) = names.iter().find(|name| !knows(name)) {
        return Err(WeightsError::Unknown((*name).to_owned()));
    }
    let mut numbers = vec![0.0; network.n_numbers()];
    for parameter in network.parameters() {
        let name = || parameter.name.clone();
        let tensor = file.tensor(&parameter.name).map_err(|_| WeightsError::Missing(name()))?;
        if tensor.dtype() != Dtype::F32 || tensor.shape() != parameter.shape {
            return Err(WeightsError::Shape {
                name: name(),
                found: format!("{:?} {:?}", tensor.dtype(), tensor.shape()),
                expected: format!("{:?} {:?}", Dtype::F32, parameter.shape),
            });
        }
        let values = tensor.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b));
        for (number, value) in numbers[parameter.range.clone()].iter_mut().zip(values) {
            if !value.is_finite() {
                return Err(WeightsError::NotFinite(name()));
            }
            *number = value;
        }
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Kernel;

    fn network(channels: usize) -> Network {
        let mut net = Network::default();
        let input = net.input(3);
        let conv = net.conv("conv", input, Kernel { side: 3, stride: 2 }, channels);
        let norm = net.norm_relu("norm", conv);
        net.head("head", norm, 4);
        net
    }

    #[test]
    fn what_is_written_is_read_back() {
        let net = network(16);
        let numbers = net.begin(1);
        let bytes = to_bytes(&net, &numbers, "test 1").unwrap();
        assert_eq!(from_bytes(&net, &bytes, "test 1"), Ok(numbers.clone()));
        assert_eq!(Ok(bytes), to_bytes(&net, &numbers, "test 1"), "the same bytes each time");
    }

    #[test]
    fn files_that_dont_fit_are_refused_in_one_line() {
        let net = network(16);
        let mut numbers = net.begin(1);
        let bytes = to_bytes(&net, &numbers, "test 1").unwrap();
        for n in (0..bytes.len()).step_by(7) {
            let error = from_bytes(&net, &bytes[..n], "test 1").expect_err("it is cut off");
            assert!(!error.to_string().contains('\n'), "{error}");
        }
        assert!(matches!(from_bytes(&net, &bytes, "test 2"), Err(WeightsError::Kind { .. })));
        let other = from_bytes(&network(32), &bytes, "test 1");
        assert!(matches!(other, Err(WeightsError::Shape { .. })), "{other:?}");
        let mut longer = network(16);
        let input = longer.input(3);
        longer.head("more", input, 2);
        let missing = from_bytes(&longer, &bytes, "test 1");
        assert_eq!(missing, Err(WeightsError::Missing("more.weight".to_owned())));
        let more = to_bytes(&longer, &longer.begin(1), "test 1").unwrap();
        assert!(matches!(from_bytes(&net, &more, "test 1"), Err(WeightsError::Unknown(_))));
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            numbers[5] = value;
            let bad = WeightsError::NotFinite("conv.weight".to_owned());
            let read = from_bytes(&net, &encode(&net, &numbers, "test 1"), "test 1");
            assert_eq!(read, Err(bad.clone()));
            assert_eq!(to_bytes(&net, &numbers, "test 1"), Err(bad), "nor are they written");
        }
    }
}
