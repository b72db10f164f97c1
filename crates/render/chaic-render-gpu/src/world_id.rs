//! Identity of a world on the device.

/// Id of a world on one device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WorldId(pub(crate) u32);
