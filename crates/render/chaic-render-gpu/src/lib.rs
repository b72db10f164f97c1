//! GPU renderer: many views of many worlds in one batch.
//!
//! **What it is**: a second implementation of [`chaic_render`] for workloads that need thousands of
//! images per second, mainly training. [`Gpu::add`] uploads a world once and [`Gpu::update`] keeps
//! it current. [`Gpu::render`] renders views of any of them. The images stay on the device for
//! further processing, or [`Batch::read`] copies them back.
//!
//! **What it is not**: exact. Its images depend on the GPU and its driver; the images of
//! [`chaic_render`] are the reference. No score, trace or digest may use this crate, so neither
//! `chaic-eval` nor the default build of `chaic` depends on it. Its callers are training, data collection
//! and visualization. It renders no plan views, applies no limits of sight and reads no files.
//!
//! **Invariants**
//! - Geometry, levels of detail, cameras and the rule for which triangle a pixel belongs to are
//!   those of [`chaic_render`]; `tests/it/agreement.rs` compares the two.
//! - On one device, the same batch gives the same images. The nearest triangle wins a pixel, and of
//!   two equally near ones the lower visibility id, independent of thread order.
//! - No camera, posture or number of views causes a panic.
//!
//! The stages of a batch, all of them compute shaders (GPUs in data centers have weak
//! fixed-function rasterizers):
//! 1. `cull.wgsl`, one workgroup per view: frustum and portal culling of instances, and selection
//!    of their levels of detail. The host computes the visible regions and builds the meshes of
//!    visible bodies. It then reads back an upper bound on the triangles of each view, and splits
//!    the views into rounds that fit the triangle buffers.
//! 2. `setup.wgsl`: projects triangles to the image, drops back faces and triangles that cover no
//!    pixel center, and clips triangles at the near plane.
//! 3. `tiles.wgsl`, one workgroup per tile of 32 by 32 pixels: loops over the triangles of its view
//!    and keeps inverse depth and visibility id of its pixels in registers. No pixel needs an
//!    atomic operation, a triangle over the whole image is shared by all workgroups, and ties are
//!    resolved in a fixed order.
//! 4. `shade.wgsl`: computes color, if a view requests it.
//!
//! Reason for `wgpu` and WGSL instead of CubeCL, in which kernels are Rust: a kernel that draws
//! 20,000 random boxes by `atomicMax` was written in both (CubeCL 0.11.3, its runtime for `wgpu`).
//! Both gave the right image on a software Vulkan device, in about the same time. But CubeCL needs
//! 197 packages where this crate needs 135, and 260 CPU seconds to build unoptimized. Its CPU
//! runtime does not build without downloading an LLVM, and it is an alpha whose language still
//! changes. It would save 900 lines of WGSL.

#![allow(
    rustdoc::private_intra_doc_links,
    reason = "the code map above is for readers of the source"
)]

mod device;
mod error;

mod pool;
mod records;
mod world_id;

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
pub use gpu::Gpu;
pub use render::MAX_VIEWS;
/// The library that owns the buffers of a batch.
pub use wgpu;
pub use world_id::WorldId;
