//! Visual models of classes: more detailed shapes than the catalogue's solids, in several styles.
//!
//! The catalogue defines collision, support surfaces and basic solids. The models define only the
//! visual shape. A model is built in meters at catalogue size and then scaled like its object. It
//! stays inside the box of the catalogue's parts, and support surfaces keep their place, so that
//! depth agrees with the world state.

use chaic_core::Vec3;
use chaic_core::catalogue::{ClassInfo, Part};
use chaic_world::{ObjectSpec, Setup};

use crate::mesh::{Mesh, unit};
use crate::mesh_builder::{MeshBuilder, hash_u32};
use crate::texture::linear_from_display;

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

/// Number of styles of each class: variations of color and of parts that do not collide.
pub(crate) const N_STYLES: u8 = 4;

/// Builds a class at the finer levels of detail.
type Model = fn(&mut MeshBuilder);

fn model(class: &ClassInfo) -> Option<Model> {
    [food::model, goods::model, containers::model, moving::model, street::model, house::model]
        .into_iter()
        .chain([furniture::model, kitchen::model, decor::model, desk::model])
        .find_map(|models| models(class.name))
}

/// Mesh of an object in a style at a level of detail, in the object frame, meters.
pub(crate) fn object_mesh(object: &ObjectSpec, style: u8, level: usize) -> Mesh {
    let mut builder = MeshBuilder::new(object.class.info(), style, level);
    match model(builder.class) {
        // The coarsest level uses the catalogue's solids.
        Some(model) if level > 0 => model(&mut builder),
        _ => builder.add_all_parts(),
    }
    let mut mesh = builder.into_mesh();
    let deformation = Deformation::new(object);
    for (p, n) in mesh.positions.iter_mut().zip(&mut mesh.normals) {
        *n = unit(*n / deformation.scale_at(*p));
        *p = deformation.map(*p);
    }
    mesh.finish()
}

/// Deformation from the catalogue shape to an object's shape.
struct Deformation {
    scale: Vec3,
    /// Height of the seat and of the top: [catalogue height, object height] each.
    seat: Option<[[f32; 2]; 2]>,
}

impl Deformation {
    fn new(object: &ObjectSpec) -> Deformation {
        let class = object.class.info();
        let top = |p: &Part| p.center[1] + 0.5 * p.extent[1];
        let tops = class.parts.iter().filter(|p| p.supports).map(top);
        let seat = object.seat_m.zip(tops.min_by(f32::total_cmp)).filter(|(_, from)| *from < 1.0);
        let high = class.size_m[1];
        Deformation {
            scale: Vec3::from(object.scale),
            seat: seat.map(|(to, from)| [[from * high, to], [high, high * object.scale[1]]]),
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
        let scale = self.scale_at(p);
        let y = match self.seat {
            Some([[from, to], _]) if p.y > from => to + (p.y - from) * scale.y,
            _ => p.y * scale.y,
        };
        Vec3::new(p.x * scale.x, y, p.z * scale.z)
    }
}

/// Classes whose objects form sets of equal style.
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

/// Style of an object of a setup. Styles vary by object; in a set, they vary only by size and
/// variant.
pub(crate) fn object_style(setup: &Setup, index: usize) -> u8 {
    let variant = u32::from(setup.things[index].variant);
    ((object_seed(setup, index) + variant) % u32::from(N_STYLES)) as u8
}

fn object_seed(setup: &Setup, index: usize) -> u32 {
    let object = &setup.things[index];
    let mut h = hash_u32(setup.seed as u32 ^ 0x51ed_270b);
    let mut mix = |x: u32| h = hash_u32(h ^ x).wrapping_add(0x9e37_79b9);
    mix(style_seed(object.class));
    if SETS.contains(&object.class.name()) {
        for scale in object.scale {
            mix(scale.to_bits());
        }
    } else {
        mix(index as u32);
    }
    h >> 1
}

/// Linear tint of an object's main part: its palette color with random brightness and warmth.
/// `None` if the class has no palette.
pub(crate) fn object_tint(setup: &Setup, index: usize) -> Option<[f32; 3]> {
    let object = &setup.things[index];
    let palette = object.class.info().palette;
    let color = palette.get(usize::from(object.variant) % palette.len().max(1))?;
    let seed = hash_u32(object_seed(setup, index) + u32::from(object.variant));
    let variation = |shift: u32| (seed >> shift & 0xff) as f32 / 255.0 - 0.5;
    let (brightness, warmth) = (1.0 + 0.3 * variation(8), 0.1 * variation(16));
    let [r, g, b] = linear_from_display(*color);
    Some(
        [r * (brightness + warmth), g * brightness, b * (brightness - warmth)]
            .map(|x: f32| x.clamp(0.0, 0.95)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::FINEST_LEVEL;
    use crate::scene_frame::ClassMesh;
    use crate::solids::N_LEVELS;
    use chaic_core::{ClassId, Role};

    fn objects() -> impl Iterator<Item = ObjectSpec> {
        ClassId::all()
            .filter(|c| c.info().role != Role::Person)
            .map(|c| ObjectSpec::new(c, Vec3::ZERO, 0.0))
    }

    /// Every model consists of closed solids that face outward and stays inside the catalogue's
    /// box.
    #[test]
    fn models_are_closed_and_stay_in_their_boxes() {
        let mut problems = Vec::new();
        for object in objects() {
            let bounds = ClassMesh::shared(&object, 0);
            let tolerance = 0.003 + 0.01 * object.size_m().max_element();
            for (style, level) in (0..N_STYLES).flat_map(|s| (0..N_LEVELS).map(move |l| (s, l))) {
                let name = format!("{} {style} {level}", object.class.name());
                let mesh = object_mesh(&object, style, level);
                if mesh.triangles.is_empty() {
                    problems.push(format!("{name} is empty"));
                }
                if mesh.materials.len() >= 255 || mesh.positions.len() >= 60_000 {
                    problems.push(format!("{name} has too many materials or vertices"));
                }
                let out = (bounds.min - mesh.min).max(mesh.max - bounds.max);
                if out.max_element() > tolerance {
                    problems.push(format!("{name} exceeds its box by {out}"));
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
                    problems.push(format!("{name} is not closed"));
                }
                if volume <= 0.0 {
                    problems.push(format!("{name} is inside out"));
                }
            }
        }
        assert!(problems.is_empty(), "{}", problems.join("\n"));
    }

    #[test]
    fn coarse_levels_have_few_triangles() {
        for object in objects() {
            let [n, far] = [0, 1].map(|level| object_mesh(&object, 0, level).triangles.len());
            assert!(n <= 250 && far <= 800, "{}: {n}, {far}", object.class.name());
        }
    }

    #[test]
    fn support_surfaces_match_the_world() {
        for object in objects() {
            let tops = chaic_world::top_surfaces(&object);
            let mesh = object_mesh(&object, 1, FINEST_LEVEL);
            for top in tops.iter().filter(|t| t.half[0].min(t.half[1]) > 0.02) {
                let near = mesh.positions.iter().filter(|p| {
                    (p.y - top.center.y).abs() < 0.012
                        && (p.x - top.center.x).abs() < top.half[0] + 0.05
                        && (p.z - top.center.z).abs() < top.half[1] + 0.05
                });
                assert!(near.count() >= 3, "{} has no top at {}", object.class.name(), top.center);
            }
        }
    }

    /// An object on a support surface must stay visible: nothing is above the surface except parts
    /// of the catalogue.
    #[test]
    fn models_leave_support_surfaces_free() {
        for object in objects() {
            let catalogue_boxes: Vec<_> = chaic_world::blocks_of(&object)
                .into_iter()
                .chain(chaic_world::non_colliding_blocks(&object))
                .collect();
            for (top, style) in chaic_world::top_surfaces(&object)
                .into_iter()
                .flat_map(|top| (0..N_STYLES).map(move |style| (top, style)))
            {
                let mesh = object_mesh(&object, style, FINEST_LEVEL);
                for p in &mesh.positions {
                    let d = *p - top.center;
                    let is_above = d.x.abs() < top.half[0] - 0.02
                        && d.z.abs() < top.half[1] - 0.02
                        && (0.015..0.3).contains(&d.y);
                    let is_in_catalogue = catalogue_boxes
                        .iter()
                        .any(|b| (*p - b.center).abs().cmple(b.half + 0.025).all());
                    let name = object.class.name();
                    assert!(
                        !is_above || is_in_catalogue,
                        "{name} {style} would hide objects at {p}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_scaled_object_has_a_scaled_model() {
        let mut object = ObjectSpec::new(ClassId::named("armchair"), Vec3::ZERO, 0.0);
        object.scale = [1.2, 0.9, 1.1];
        object.seat_m = Some(0.5);
        let mesh = object_mesh(&object, 0, FINEST_LEVEL);
        let size = object.size_m();
        assert!((mesh.max.y - size.y).abs() < 0.02 && (mesh.max.x - 0.5 * size.x).abs() < 0.02);
        let near_seat = mesh.positions.iter().filter(|p| (p.y - 0.5).abs() < 0.01);
        assert!(near_seat.count() > 4);
    }
}
