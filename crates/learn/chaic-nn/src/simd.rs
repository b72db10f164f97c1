//! SIMD vector widths for which inner loops are compiled.

use pulp::Arch;

/// Returns the widest vectors of this machine.
pub fn widest() -> Arch {
    Arch::new()
}

/// Returns every vector width of this machine by name, for tests that results do not depend on it.
pub fn widths() -> Vec<(&'static str, Arch)> {
    let mut widths = vec![("scalar", Arch::Scalar)];
    #[cfg(target_arch = "x86_64")]
    {
        widths.extend(pulp::x86::V3::try_new().map(|v3| ("x86-64-v3", Arch::V3(v3))));
        widths.extend(pulp::x86::V4::try_new().map(|v4| ("x86-64-v4", Arch::V4(v4))));
    }
    #[cfg(not(target_arch = "x86_64"))]
    widths.push(("widest", Arch::new()));
    widths
}
