//! Errors of the GPU renderer, each with a remedy.

use crate::world_id::WorldId;

/// Error of the GPU renderer.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No adapter of the requested kinds.
    #[error(
        "no Vulkan adapter of the kinds {requested} (found: {found}); install the GPU driver, \
         or a software driver (Debian: mesa-vulkan-drivers) with Adapters::Any"
    )]
    NoAdapter {
        /// Requested kinds of adapter.
        requested: &'static str,
        /// Names and kinds of the available adapters.
        found: String,
    },
    /// The adapter does not meet the requirements.
    #[error(
        "adapter {name} has {limit} = {value}, at least {required} is required; use another adapter"
    )]
    WeakAdapter {
        /// Name of the adapter.
        name: String,
        /// Name of the limit in wgpu.
        limit: &'static str,
        /// Value of the limit.
        value: u64,
        /// Required value.
        required: u64,
    },
    /// The device could not be opened.
    #[error("cannot open adapter {name}: {source}")]
    Device {
        /// Name of the adapter.
        name: String,
        /// Error of wgpu.
        source: wgpu::RequestDeviceError,
    },
    /// The world was never added, or was removed.
    #[error("{0:?} is not on this device; add it first")]
    UnknownWorld(WorldId),
    /// More instances than visibility ids can distinguish.
    #[error("a world has {n} instances, at most {max} are supported; split it")]
    TooManyInstances {
        /// Number of instances.
        n: usize,
        /// Maximum number of instances.
        max: usize,
    },
    /// A view has limits of sight, which this renderer cannot apply.
    #[error(
        "view {index} has limits of sight, which the GPU renderer cannot apply; \
         render it with chaic_render::Scene"
    )]
    LimitedEyesight {
        /// Index of the view.
        index: usize,
    },
    /// The views of a batch differ in size.
    #[error(
        "view {index} is {width}x{height} pixels, the first view is {first_width}x{first_height}; \
         render each size in its own batch"
    )]
    MixedSizes {
        /// Index of the view that differs.
        index: usize,
        /// Its width, pixels.
        width: u32,
        /// Its height, pixels.
        height: u32,
        /// Width of the first view, pixels.
        first_width: u32,
        /// Height of the first view, pixels.
        first_height: u32,
    },
    /// The images of a batch do not fit into a device buffer, or a side is over
    /// [`MAX_SIDE_PX`](chaic_render::MAX_SIDE_PX).
    #[error(
        "a batch of {views} views of {width}x{height} pixels is too large; render at most {max} \
         at a time, with sides of at most {} pixels",
        chaic_render::MAX_SIDE_PX
    )]
    TooLargeBatch {
        /// Number of views.
        views: usize,
        /// Width of each view, pixels.
        width: u32,
        /// Height of each view, pixels.
        height: u32,
        /// Maximum number of views.
        max: u64,
    },
    /// The triangles of one view do not fit into a device buffer.
    #[error(
        "view {index} may need {n} triangles, this adapter supports {max}; use another adapter"
    )]
    TooManyTriangles {
        /// Index of the view.
        index: usize,
        /// Upper bound on the triangles of the view.
        n: u32,
        /// Maximum number of triangles.
        max: u32,
    },
    /// The device memory is full.
    #[error(
        "cannot allocate {bytes} bytes on the device for {purpose}; use smaller batches \
         or fewer worlds"
    )]
    OutOfMemory {
        /// Purpose of the allocation.
        purpose: &'static str,
        /// Size of the allocation, bytes.
        bytes: u64,
    },
    /// The device is lost or does not respond.
    #[error("the device does not respond ({0}); create a new Gpu")]
    Lost(String),
}
