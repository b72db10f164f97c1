//! The promise of this file: looks are not facts. What the renderer adds to the catalogue's solids
//! must change neither what bodies collide with, nor what carries things, nor what the importer
//! takes for hidden from view.

use chaic_core::catalogue::{CLASSES, Part, Solid};

/// The sum over the catalogue that worlds are built on; to be changed only together with a
/// change of the worlds themselves.
const FACTS: u64 = 0xd023_db83_eb27_f539;

#[test]
fn the_catalogues_facts_are_as_recorded() {
    let mut sum = Sum(0xcbf2_9ce4_8422_2325);
    for class in &CLASSES {
        class.name.bytes().for_each(|b| sum.add(u32::from(b)));
        class.size_m.iter().for_each(|x| sum.add(x.to_bits()));
        sum.add(class.mass_kg.to_bits());
        sum.add(class.palette.len() as u32);
        class.parts.iter().for_each(|p| sum.part(p));
    }
    assert_eq!(sum.0, FACTS, "worlds would change: {:#x}", sum.0);
}

struct Sum(u64);

impl Sum {
    fn add(&mut self, x: u32) {
        for byte in x.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    fn part(&mut self, p: &Part) {
        let shape = match p.solid {
            Solid::Cuboid => [0.0; 3],
            Solid::Ellipsoid => [1.0, 0.0, 0.0],
            Solid::Frustum { top } => [2.0, top, 0.0],
            Solid::Torus { tube } => [3.0, tube, 0.0],
            Solid::Arc { tube, degrees } => [4.0, tube, degrees],
            Solid::Tub { wall, bottom } => [5.0, wall, bottom],
            Solid::RoundTub { wall, bottom } => [6.0, wall, bottom],
        };
        let numbers = [shape, p.center, p.extent, p.turn_deg];
        numbers.iter().flatten().for_each(|x| self.add(x.to_bits()));
        self.add(u32::from(p.collides) + 2 * u32::from(p.supports));
    }
}
