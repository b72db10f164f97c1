//! What can go wrong, each with what to do about it.

use crate::WorldId;

/// Why something couldn't be done on the graphics card.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No adapter of the kinds asked for.
    #[error(
        "no Vulkan adapter of the kinds {wanted} (found: {found}); install the card's driver, or \
         a software one (Debian: mesa-vulkan-drivers) and ask for Adapters::AnyKind"
    )]
    NoAdapter {
        /// Kinds of adapter that were looked for.
        wanted: &'static str,
        /// Names and kinds of those there are.
        found: String,
    },
    /// The adapter is too weak.
    #[error("adapter {name} has {limit} of {has}, {needed} are needed; use another adapter")]
    WeakAdapter {
        /// The adapter's name.
        name: String,
        /// Which limit, by its name in wgpu.
        limit: &'static str,
        /// Its value.
        has: u64,
        /// The value needed.
        needed: u64,
    },
    /// The adapter didn't open.
    #[error("adapter {name} can't be opened: {source}")]
    Device {
        /// The adapter's name.
        name: String,
        /// What it said.
        source: wgpu::RequestDeviceError,
    },
    /// No world of this id was added here, or it was removed.
    #[error("{0:?} isn't on this device; add it first")]
    UnknownWorld(WorldId),
    /// More instances than ids of pixels can tell apart.
    #[error("a world of {n} instances; at most {most} can be drawn")]
    TooManyInstances {
        /// How many there are.
        n: usize,
        /// How many there may be.
        most: usize,
    },
    /// Views of one batch must be of one size.
    #[error(
        "view {index} is {width}x{height} pixels, the first one {first_width}x{first_height}; \
         render each size as a batch of its own"
    )]
    MixedSizes {
        /// Which view differs.
        index: usize,
        /// Its width, pixels.
        width: u32,
        /// Its height, pixels.
        height: u32,
        /// The first view's width, pixels.
        first_width: u32,
        /// The first view's height, pixels.
        first_height: u32,
    },
    /// The images of a batch don't fit into a buffer of the device.
    #[error(
        "{views} views of {width}x{height} pixels are too large a batch for this adapter; render \
         at most {most} at a time"
    )]
    TooLargeBatch {
        /// How many views there are.
        views: usize,
        /// Width of each, pixels.
        width: u32,
        /// Height of each, pixels.
        height: u32,
        /// How many there may be.
        most: u64,
    },
    /// The triangles of one view don't fit into a buffer of the device.
    #[error("view {index} may show {n} triangles, this adapter holds {most}; use another adapter")]
    TooManyTriangles {
        /// Which view.
        index: usize,
        /// How many triangles it may show.
        n: u32,
        /// How many there may be.
        most: u32,
    },
    /// The device's memory is full.
    #[error("the device has no {bytes} bytes left for {what}; use smaller batches or fewer worlds")]
    OutOfMemory {
        /// What it was wanted for.
        what: &'static str,
        /// How much was wanted.
        bytes: u64,
    },
    /// The device is gone or hangs.
    #[error("the device doesn't answer any more ({0}); make a new Gpu")]
    Lost(String),
}
