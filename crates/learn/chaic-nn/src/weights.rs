//! Network parameters as a safetensors file, which holds data only: loading one executes no code.

use std::collections::HashMap;

use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};

use crate::network::Network;

/// Key of the metadata entry that names the kind of network.
const KIND: &str = "kind";

/// Reason why a file holds no parameters for a network.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WeightsError {
    /// The file is not a complete safetensors file.
    #[error("not a weights file: {0}")]
    Format(String),
    /// The file belongs to another kind of network.
    #[error("weights of `{found}`, expected `{expected}`")]
    Kind {
        /// Kind in the file.
        found: String,
        /// Expected kind.
        expected: String,
    },
    /// A tensor is missing.
    #[error("the weights lack `{0}`")]
    Missing(String),
    /// The file has a tensor that the network lacks.
    #[error("the weights have `{0}`, which this network lacks")]
    Unknown(String),
    /// A tensor has another shape or type.
    #[error("`{name}` is {found}, expected {expected}")]
    Shape {
        /// Name of the tensor.
        name: String,
        /// Type and shape in the file.
        found: String,
        /// Type and shape in the network.
        expected: String,
    },
    /// A value is not finite.
    #[error("`{0}` has a value that is not finite")]
    NotFinite(String),
    /// The parameters do not fit the configuration of a training.
    #[error("{0}")]
    Configuration(String),
}

/// Encodes parameters as a weights file; `kind` names the kind of network and its version.
///
/// # Errors
/// [`WeightsError::NotFinite`] if a value is not finite.
pub fn to_bytes(
    network: &Network,
    parameters: &[f32],
    kind: &str,
) -> Result<Vec<u8>, WeightsError> {
    let is_finite =
        |p: &&crate::Parameter| parameters[p.range.clone()].iter().all(|x| x.is_finite());
    if let Some(parameter) = network.parameters().iter().find(|p| !is_finite(p)) {
        return Err(WeightsError::NotFinite(parameter.name.clone()));
    }
    Ok(encode(network, parameters, kind))
}

/// Converts a weights file to half the size: each value is rounded to the nearest bfloat16.
/// [`from_bytes`] reads both.
///
/// # Errors
/// [`WeightsError`] as [`from_bytes`].
pub fn to_bf16(network: &Network, bytes: &[u8], kind: &str) -> Result<Vec<u8>, WeightsError> {
    let parameters = from_bytes(network, bytes, kind)?;
    let bf16 = |x: f32| {
        // Adds half of the last kept bit before truncation; ties round to even.
        let bits = x.to_bits();
        ((bits + 0x7fff + (bits >> 16 & 1)) >> 16) as u16
    };
    let bytes = parameters.iter().flat_map(|x| bf16(*x).to_le_bytes()).collect();
    Ok(encode_as(network, bytes, Dtype::BF16, kind))
}

/// Encodes parameters without checking that they are finite.
fn encode(network: &Network, parameters: &[f32], kind: &str) -> Vec<u8> {
    let bytes = parameters.iter().flat_map(|x| x.to_le_bytes()).collect();
    encode_as(network, bytes, Dtype::F32, kind)
}

/// Encodes the bytes of all parameters in order.
fn encode_as(network: &Network, bytes: Vec<u8>, dtype: Dtype, kind: &str) -> Vec<u8> {
    let size = if dtype == Dtype::BF16 { 2 } else { 4 };
    let view = |p: &crate::Parameter| {
        let data = &bytes[size * p.range.start..size * p.range.end];
        let view = TensorView::new(dtype, p.shape.clone(), data);
        (p.name.clone(), view.expect("the length matches the shape"))
    };
    // The metadata has a single entry, because a hash map with several entries has no fixed order.
    let metadata = HashMap::from([(KIND.to_owned(), kind.to_owned())]);
    let views = network.parameters().iter().map(view);
    serialize(views, Some(metadata)).expect("names and shapes can be encoded")
}

/// Returns a digest of a file's content, twelve hexadecimal digits.
pub fn digest(bytes: &[u8]) -> String {
    format!("{:012x}", xxhash_rust::xxh3::xxh3_64(bytes) >> 16)
}

/// Returns the digest of the weights file of these parameters, which may be non-finite.
pub fn digest_of(network: &Network, parameters: &[f32], kind: &str) -> String {
    digest(&encode(network, parameters, kind))
}

/// Returns the kind of network of a weights file; empty if the file names none.
///
/// # Errors
/// [`WeightsError::Format`] if the file has no valid header.
pub fn kind(bytes: &[u8]) -> Result<String, WeightsError> {
    let (_, metadata) =
        SafeTensors::read_metadata(bytes).map_err(|e| WeightsError::Format(e.to_string()))?;
    Ok(metadata.metadata().as_ref().and_then(|m| m.get(KIND)).cloned().unwrap_or_default())
}

/// Parses the parameters of a weights file.
///
/// # Errors
/// [`WeightsError`] if the file is incomplete or belongs to another kind or network.
pub fn from_bytes(network: &Network, bytes: &[u8], kind: &str) -> Result<Vec<f32>, WeightsError> {
    let format_error = |e: &dyn std::fmt::Display| WeightsError::Format(e.to_string());
    let found = self::kind(bytes)?;
    if found != kind {
        return Err(WeightsError::Kind { found, expected: kind.to_owned() });
    }
    let file = SafeTensors::deserialize(bytes).map_err(|e| format_error(&e))?;
    let mut names = file.names();
    names.sort_unstable();
    let is_known = |name: &&&str| network.parameters().iter().any(|p| p.name == **name);
    if let Some(name) = names.iter().find(|name| !is_known(name)) {
        return Err(WeightsError::Unknown((*name).to_owned()));
    }
    let mut parameters = vec![0.0; network.n_parameters()];
    for parameter in network.parameters() {
        let name = || parameter.name.clone();
        let tensor = file.tensor(&parameter.name).map_err(|_| WeightsError::Missing(name()))?;
        let is_bf16 = tensor.dtype() == Dtype::BF16;
        if !(is_bf16 || tensor.dtype() == Dtype::F32) || tensor.shape() != parameter.shape {
            return Err(WeightsError::Shape {
                name: name(),
                found: format!("{:?} {:?}", tensor.dtype(), tensor.shape()),
                expected: format!("{:?} {:?}", Dtype::F32, parameter.shape),
            });
        }
        let values: Vec<f32> = if is_bf16 {
            let values = tensor.data().as_chunks::<2>().0.iter();
            values.map(|[a, b]| f32::from_le_bytes([0, 0, *a, *b])).collect()
        } else {
            tensor.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
        };
        for (to, value) in parameters[parameter.range.clone()].iter_mut().zip(values) {
            if !value.is_finite() {
                return Err(WeightsError::NotFinite(name()));
            }
            *to = value;
        }
    }
    Ok(parameters)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Kernel;

    fn network(channels: usize) -> Network {
        let mut net = Network::default();
        let input = net.input(3);
        let conv = net.conv("conv", input, Kernel { size: 3, stride: 2 }, channels);
        let norm = net.norm_relu("norm", conv);
        net.output_head("head", norm, 4);
        net
    }

    #[test]
    fn parameters_are_read_back_unchanged() {
        let net = network(16);
        let parameters = net.init_parameters(1);
        let bytes = to_bytes(&net, &parameters, "test 1").unwrap();
        assert_eq!(from_bytes(&net, &bytes, "test 1"), Ok(parameters.clone()));
        assert_eq!(Ok(bytes), to_bytes(&net, &parameters, "test 1"), "encoding is deterministic");
    }

    #[test]
    fn bf16_files_have_half_the_size_and_the_nearest_values() {
        let net = network(16);
        let parameters = net.init_parameters(1);
        let bytes = to_bytes(&net, &parameters, "test 1").unwrap();
        let rounded = to_bf16(&net, &bytes, "test 1").unwrap();
        assert!(rounded.len() < bytes.len() / 2 + 600, "{} of {}", rounded.len(), bytes.len());
        let read = from_bytes(&net, &rounded, "test 1").unwrap();
        for (x, rounded) in parameters.iter().zip(&read) {
            assert!((x - rounded).abs() <= x.abs() / 256.0, "{x} {rounded}");
        }
        assert_eq!(to_bf16(&net, &rounded, "test 1"), Ok(rounded), "rounded values stay");
    }

    #[test]
    fn mismatching_files_are_refused_in_one_line() {
        let net = network(16);
        let mut parameters = net.init_parameters(1);
        let bytes = to_bytes(&net, &parameters, "test 1").unwrap();
        for n in (0..bytes.len()).step_by(7) {
            let error = from_bytes(&net, &bytes[..n], "test 1").expect_err("it is truncated");
            assert!(!error.to_string().contains('\n'), "{error}");
        }
        assert!(matches!(from_bytes(&net, &bytes, "test 2"), Err(WeightsError::Kind { .. })));
        let other = from_bytes(&network(32), &bytes, "test 1");
        assert!(matches!(other, Err(WeightsError::Shape { .. })), "{other:?}");
        let mut longer = network(16);
        let input = longer.input(3);
        longer.output_head("more", input, 2);
        let missing = from_bytes(&longer, &bytes, "test 1");
        assert_eq!(missing, Err(WeightsError::Missing("more.weight".to_owned())));
        let more = to_bytes(&longer, &longer.init_parameters(1), "test 1").unwrap();
        assert!(matches!(from_bytes(&net, &more, "test 1"), Err(WeightsError::Unknown(_))));
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            parameters[5] = value;
            let bad = WeightsError::NotFinite("conv.weight".to_owned());
            let read = from_bytes(&net, &encode(&net, &parameters, "test 1"), "test 1");
            assert_eq!(read, Err(bad.clone()));
            assert_eq!(
                to_bytes(&net, &parameters, "test 1"),
                Err(bad),
                "non-finite values are not written"
            );
        }
    }
}
