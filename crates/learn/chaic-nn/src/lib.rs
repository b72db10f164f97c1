//! Small neural networks on the CPU: training and inference.
//!
//! **What it is**: [`network::Network`] lists layers (dense and depthwise convolutions, layer
//! normalization, sums, nearest upsampling); [`pass::Pass`] runs one forward and backward;
//! [`adam::Adam`] takes steps; [`inference::Inference`] runs one forward in less time and memory. Feature maps are [`tensor::Tensor`]s, shape [n, height, width, channels].
//!
//! **What it is not**: it knows no worlds, tasks, losses or data.
//!
//! **Invariants**
//! - The same numbers in give the same bits out on any machine, with vectors of any width: every sum
//!   has one order, multiplications and additions are fused where a product says so and nowhere else.
//! - No threads: whoever has several cores runs several passes, and adds gradients in a fixed order.

pub mod simd;
pub mod tensor;

pub mod conv;
pub mod depthwise;
mod elementwise;
pub mod gemm;
mod norm;

pub mod network;

pub mod inference;
pub mod pass;

pub mod adam;
pub mod weights;

#[cfg(test)]
mod tests;

pub use adam::{Adam, AdamRules};
pub use conv::Kernel;
pub use inference::Inference;
pub use network::{Network, Node, Parameter};
pub use pass::Pass;
pub use tensor::{Shape, Tensor};
