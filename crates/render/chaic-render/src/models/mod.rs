//! How each class looks: finer forms than the catalogue's solids, in several styles.
//!
//! The catalogue says what stops bodies, what carries things, and of what simple solids a class is
//! made; here is only what eyes see of it. A model is built in metres at the catalogue's size and
//! then stretched as the thing is. Nothing here leaves the box that the catalogue's parts fill, and
//! tops that carry things stay where they are, so that depth agrees with what the world says.

use chaic_core::Vec3;
use chaic_core::catalogue::{ClassInfo, Part};
use chaic_world::{Setup, Thing};

use crate::mesh::{Mesh, unit};
use crate::mesh_builder::{MeshBuilder, scramble};
use crate::texture::linear_from_shown;

mod colors;
mod containers;
mod decor;
mod desk;
mod food;
mod furniture;
mod goods;
mod house;
mod kitchen;
mod moving;
mod street;
mod style_seeds;

use style_seeds::style_seed;

/// Styles of each class: other forms of what doesn't collide, other colors.
pub(crate) const N_STYLES: u8 = 4;

/// How a class is built at the finer levels.
type Model = fn(&mut MeshBuilder);

fn model(class: &ClassInfo) -> Option<Model> {
    [food::model, goods::model, containers::model, moving::model, street::model, house::model]
        .into_iter()
        .chain([furniture::model, kitchen::model, decor::model, desk::model])
        .find_map(|models| models(class.name))
}

/// The mesh of a thing in a style at a level of detail, in its own frame, metres.
pub(crate) fn thing_mesh(thing: &Thing, style: u8, level: usize) -> Mesh {
    let mut s = MeshBuilder::new(thing.class.info(), style, level);
    match model(s.class) {
        // The smallest pictures need no more than the catalogue's solids.
        Some(model) if level > 0 => model(&mut s),
        _ => s.all(),
    }
    let mut mesh = s.mesh();
    let stretch = Stretch::of(thing);
    for (p, n) in mesh.positions.iter_mut().zip(&mut mesh.normals) {
        *n = unit(*n / stretch.scale_at(*p));
        *p = stretch.map(*p);
    }
    mesh.finish()
}

/// How a thing's shape differs from the catalogue's.
struct Stretch {
    scale: Vec3,
    /// A height at the catalogue's size and what becomes of it, and the same for the top.
    seat: Option<[[f32; 2]; 2]>,
}

impl Stretch {
    fn of(thing: &Thing) -> Stretch {
        let class = thing.class.info();
        let top = |p: &Part| p.center[1] + 0.5 * p.extent[1];
        let tops = class.parts.iter().filter(|p| p.supports).map(top);
        let seat = thing.seat_m.zip(tops.min_by(f32::total_cmp)).filter(|(_, from)| *from < 1.0);
        let high = class.size_m[1];
        Stretch {
            scale: Vec3::from(thing.scale),
            seat: seat.map(|(to, from)| [[from * high, to], [high, high * thing.scale[1]]]),
        }
    }

    fn scale_at(&self, p: Vec3) -> Vec3 {
        let y = match self.seat {
            None => self.scale.y,
            Some([[from, to], _]) if p.y <= from => to / from,
            Some([[from, to], [high, top]]) => (top - to) / (high - from),
        };
        Vec3::new(self.scale.x, y, self.scale.z).max(Vec3::splat(1e-4))
    }

    fn map(&self, p: Vec3) -> Vec3 {
        let s = self.scale_at(p);
        let y = match self.seat {
            Some([[from, to], _]) if p.y > from => to + (p.y - from) * s.y,
            _ => p.y * s.y,
        };
        Vec3::new(p.x * s.x, y, p.z * s.z)
    }
}

/// Classes of which several stand together as a set and look alike.
const SETS: [&str; 8] = [
    "side_chair",
    "navy_chair",
    "stool",
    "nightstand",
    "street_lamp",
    "bench",
    "fence",
    "wineglass",
];

/// The style of a setup's thing: things differ one by one, but those of a set only by size and
/// variant.
pub(crate) fn style_of(setup: &Setup, index: usize) -> u8 {
    let variant = u32::from(setup.things[index].variant);
    ((seed_of(setup, index) + variant) % u32::from(N_STYLES)) as u8
}

fn seed_of(setup: &Setup, index: usize) -> u32 {
    let thing = &setup.things[index];
    let mut h = scramble(setup.seed as u32 ^ 0x51ed_270b);
    let mut mix = |x: u32| h = scramble(h ^ x).wrapping_add(0x9e37_79b9);
    mix(style_seed(thing.class));
    if SETS.contains(&thing.class.name()) {
        for scale in thing.scale {
            mix(scale.to_bits());
        }
    } else {
        mix(index as u32);
    }
    h >> 1
}

/// The color of a thing's main part, linear, where its variant chooses it: the palette's, a little
/// lighter or darker and warmer or colder.
pub(crate) fn tint_of(setup: &Setup, index: usize) -> Option<[f32; 3]> {
    let thing = &setup.things[index];
    let palette = thing.class.info().palette;
    let color = palette.get(usize::from(thing.variant) % palette.len().max(1))?;
    let seed = scramble(seed_of(setup, index) + u32::from(thing.variant));
    let part = |shift: u32| (seed >> shift & 0xff) as f32 / 255.0 - 0.5;
    let (light, warm) = (1.0 + 0.3 * part(8), 0.1 * part(16));
    let [r, g, b] = linear_from_shown(*color);
    Some([r * (light + warm), g * light, b * (light - warm)].map(|x: f32| x.clamp(0.0, 0.95)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::ClassMesh;
    use crate::geometry::FINEST;
    use crate::solids::N_LEVELS;
    use chaic_core::{ClassId, Role};

    fn things() -> impl Iterator<Item = Thing> {
        ClassId::all()
            .filter(|c| c.info().role != Role::Person)
            .map(|c| Thing::new(c, Vec3::ZERO, 0.0))
    }

    /// Every model is made of closed solids that look outwards and stays where the catalogue says.
    #[test]
    fn models_are_closed_and_stay_in_their_boxes() {
        let mut wrong = Vec::new();
        for thing in things() {
            let bounds = ClassMesh::of(&thing, 0);
            let room = 0.003 + 0.01 * thing.size_m().max_element();
            for (style, level) in (0..N_STYLES).flat_map(|s| (0..N_LEVELS).map(move |l| (s, l))) {
                let name = format!("{} {style} {level}", thing.class.name());
                let mesh = thing_mesh(&thing, style, level);
                if mesh.triangles.is_empty() {
                    wrong.push(format!("{name} is empty"));
                }
                if mesh.skins.len() >= 255 || mesh.positions.len() >= 60_000 {
                    wrong.push(format!("{name} has too many skins or vertices"));
                }
                let out = (bounds.min - mesh.min).max(mesh.max - bounds.max);
                if out.max_element() > room {
                    wrong.push(format!("{name} leaves its box by {out}"));
                }
                let (mut edges, mut volume) = (std::collections::BTreeMap::new(), 0.0);
                for t in &mesh.triangles {
                    let [a, b, c] = t.vertices.map(|c| mesh.positions[usize::from(c)]);
                    volume += f64::from(a.dot(b.cross(c)) / 6.0);
                    let key = |v: Vec3| v.to_array().map(f32::to_bits);
                    for (p, q) in [(a, b), (b, c), (c, a)] {
                        *edges.entry((key(p), key(q))).or_insert(0) += 1;
                        *edges.entry((key(q), key(p))).or_insert(0) -= 1;
                    }
                }
                if edges.values().any(|n| *n != 0) {
                    wrong.push(format!("{name} isn't closed"));
                }
                if volume <= 0.0 {
                    wrong.push(format!("{name} is inside out"));
                }
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    #[test]
    fn what_is_small_on_the_image_is_cheap() {
        for thing in things() {
            let [n, far] = [0, 1].map(|level| thing_mesh(&thing, 0, level).triangles.len());
            assert!(n <= 250 && far <= 800, "{}: {n}, {far}", thing.class.name());
        }
    }

    #[test]
    fn tops_that_carry_things_are_where_the_world_says() {
        for thing in things() {
            let tops = chaic_world::top_surfaces(&thing);
            let mesh = thing_mesh(&thing, 1, FINEST);
            for top in tops.iter().filter(|t| t.half[0].min(t.half[1]) > 0.02) {
                let near = mesh.positions.iter().filter(|p| {
                    (p.y - top.center.y).abs() < 0.012
                        && (p.x - top.center.x).abs() < top.half[0] + 0.05
                        && (p.z - top.center.z).abs() < top.half[1] + 0.05
                });
                assert!(near.count() >= 3, "{} has no top at {}", thing.class.name(), top.center);
            }
        }
    }

    /// What lies on a top must stay in sight: above tops there is nothing but what the catalogue
    /// tells of.
    #[test]
    fn nothing_is_added_where_things_are_put() {
        for thing in things() {
            let told: Vec<_> = chaic_world::blocks_of(&thing)
                .into_iter()
                .chain(chaic_world::ghosts_of(&thing))
                .collect();
            for (top, style) in chaic_world::top_surfaces(&thing)
                .into_iter()
                .flat_map(|top| (0..N_STYLES).map(move |style| (top, style)))
            {
                let mesh = thing_mesh(&thing, style, FINEST);
                for p in &mesh.positions {
                    let d = *p - top.center;
                    let is_above = d.x.abs() < top.half[0] - 0.02
                        && d.z.abs() < top.half[1] - 0.02
                        && (0.015..0.3).contains(&d.y);
                    let is_told =
                        told.iter().any(|b| (*p - b.center).abs().cmple(b.half + 0.025).all());
                    let name = thing.class.name();
                    assert!(!is_above || is_told, "{name} {style} would hide things at {p}");
                }
            }
        }
    }

    #[test]
    fn a_stretched_thing_looks_stretched() {
        let mut thing = Thing::new(ClassId::named("armchair"), Vec3::ZERO, 0.0);
        thing.scale = [1.2, 0.9, 1.1];
        thing.seat_m = Some(0.5);
        let mesh = thing_mesh(&thing, 0, FINEST);
        let size = thing.size_m();
        assert!((mesh.max.y - size.y).abs() < 0.02 && (mesh.max.x - 0.5 * size.x).abs() < 0.02);
        let near_seat = mesh.positions.iter().filter(|p| (p.y - 0.5).abs() < 0.01);
        assert!(near_seat.count() > 4);
    }
}
