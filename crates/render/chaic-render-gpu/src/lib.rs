//! What eyes see, drawn on a graphics card: many views of many worlds in one batch.
//!
//! **What it is**: a second renderer of what [`chaic_render`] draws, for those who need many
//! thousand pictures a second, learners above all. Worlds are brought onto the device once
//! ([`Gpu::add`]) and kept up to date ([`Gpu::update`]); [`Gpu::render`] draws views of any of them,
//! and the images stay on the device for whoever goes on there, or come back ([`Batch::read`]).
//!
//! **What it is not**: exact. Its pictures depend on the card and its driver; those of
//! [`chaic_render`] are the ones that count. Nothing that ends in a score, a trace or a digest may
//! come from here, so neither `chaic-eval` nor the command `chaic` depends on it; callers are
//! training, collecting pictures, and looking on. It draws no plan views and reads no files.
//!
//! **Invariants**
//! - Geometry, levels of detail, cameras and the rule for which triangle a pixel belongs to are
//!   those of [`chaic_render`]; `tests/agreement.rs` holds the two against each other.
//! - On one device the same batch gives the same images: who is nearest wins a pixel, and the lower
//!   name where two are equally near, in whatever order threads get there.
//! - No camera, posture or number of views makes it panic.
//!
//! How a batch comes about, all in compute shaders (graphics cards in data centers are weak at
//! drawing triangles the usual way):
//! 1. `cull.wgsl`, one workgroup a view: which instances are in the frustum and in a room that may be
//!    seen, and at which level of detail. The host has found out the rooms, and shaped the bodies that
//!    the views see. The host reads back how many triangles each view may have, and lays the views out in
//!    rounds that fit the room for triangles.
//! 2. `setup.wgsl`: triangles are brought onto the image, those that turn their back or cover no
//!    center of a pixel are dropped, those that reach behind the eye are cut.
//! 3. `tiles.wgsl`, one workgroup for each 32 by 32 pixels: it goes through its view's triangles and
//!    keeps inverse depth and visibility id of its pixels in registers. So no pixel needs an atomic operation, a
//!    wall over the whole image is nobody's burden alone, and ties are settled in a fixed order.
//! 4. `shade.wgsl`: color, if a view asks for it.
//!
//! Why `wgpu` and shaders of our own, and not CubeCL, in which kernels are Rust: a kernel that draws
//! 20,000 random boxes by `atomicMax` was written in both (CubeCL 0.11.3, its runtime for `wgpu`). Both
//! gave the right image on a software Vulkan, in about the same time. But CubeCL needs 197 packages
//! where this crate needs 135, and 260 seconds of a processor to build unoptimized; its runtime for
//! processors doesn't build without fetching an LLVM; and it is an alpha whose language still
//! changes. What it would save is 900 lines of WGSL.

#![allow(
    rustdoc::private_intra_doc_links,
    reason = "the code map above is for readers of the source"
)]

mod device;
mod error;

mod pool;
mod records;

mod meshes;
mod upload;

mod bodies;
mod gpu;
mod lights;
mod passes;

mod batch;
mod render;

pub use batch::Batch;
pub use device::Adapters;
pub use error::GpuError;
pub use gpu::{Gpu, WorldId};
pub use render::MAX_VIEWS;
/// The library whose buffers batches are in.
pub use wgpu;
