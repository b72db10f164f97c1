//! Promise: visual models do not change facts. The renderer's additions to the catalogue's solids
//! must not change collision, support surfaces, or the importer's test for hidden objects.

use chaic_core::catalogue::{CLASSES, Part, Solid};

/// Checksum of the catalogue on which worlds are built. Change it only together with the worlds
/// themselves.
const CATALOGUE_CHECKSUM: u64 = 0xd023_db83_eb27_f539;

#[test]
fn the_catalogue_matches_its_recorded_checksum() {
    let mut checksum = Checksum(0xcbf2_9ce4_8422_2325);
    for class in &CLASSES {
        class.name.bytes().for_each(|b| checksum.add(u32::from(b)));
        class.size_m.iter().for_each(|x| checksum.add(x.to_bits()));
        checksum.add(class.mass_kg.to_bits());
        checksum.add(class.palette.len() as u32);
        class.parts.iter().for_each(|p| checksum.add_part(p));
    }
    assert_eq!(checksum.0, CATALOGUE_CHECKSUM, "worlds would change: {:#x}", checksum.0);
}

struct Checksum(u64);

impl Checksum {
    fn add(&mut self, x: u32) {
        for byte in x.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn add_part(&mut self, p: &Part) {
        let shape = match p.solid {
            Solid::Cuboid => [0.0; 3],
            Solid::Ellipsoid => [1.0, 0.0, 0.0],
            Solid::Frustum { top } => [2.0, top, 0.0],
            Solid::Torus { tube } => [3.0, tube, 0.0],
            Solid::Arc { tube, degrees } => [4.0, tube, degrees],
            Solid::Tub { wall, bottom } => [5.0, wall, bottom],
            Solid::RoundTub { wall, bottom } => [6.0, wall, bottom],
        };
        let values = [shape, p.center, p.extent, p.turn_deg];
        values.iter().flatten().for_each(|x| self.add(x.to_bits()));
        self.add(u32::from(p.collides) + 2 * u32::from(p.supports));
    }
}
