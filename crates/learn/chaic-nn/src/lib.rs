//! Small neural networks on the CPU: training and inference.
//!
//! **What it is**: [`network::Network`] lists layers: dense and depthwise convolutions, layer
//! normalization, attention, sums, nearest-neighbor upsampling. [`pass::TrainingPass`] runs a
//! network forward and backward. [`adam::AdamW`] is the optimizer. [`inference::Inference`] runs
//! forward passes in less time and memory. Feature maps are [`tensor::Tensor`]s of shape
//! [n, height, width, channels].
//!
//! **What it is not**: it knows no worlds, tasks, losses or data.
//!
//! **Invariants**
//! - Equal inputs give equal bits on any machine, with SIMD vectors of any width. Every sum has a fixed
//!   order, and multiply-adds are fused in matrix products and convolutions only.
//! - No threads: callers with several cores run several passes and add the gradients in a fixed order.

pub mod simd;
pub mod tensor;

mod attention;
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

pub use adam::{AdamW, AdamWConfig};
pub use conv::Kernel;
pub use inference::Inference;
pub use network::{Network, NodeId, Parameter, normal};
pub use pass::TrainingPass;
pub use tensor::{Shape, Tensor, TensorView};
