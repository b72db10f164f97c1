//! What learners of perception are taught with: classes, normals and depths in millimetres.
//!
//! Not for agents, who get what their senses grant, and not made for speed.

use chaic_core::EntityId;
use chaic_world::World;

use crate::Scene;
use crate::draw::{Scratch, draw};
use crate::frame::Frame;
use crate::lens::{Lens, reciprocal, seen_depth_m};
use crate::mesh::unit;
use crate::paint::Painter;
use crate::people::Body;
use crate::planes::Plane;
use crate::raster::{BACKGROUND, unpack_visibility_id};
use crate::view::{MAX_SIDE_PX, View, with_scratch};

/// Labels of the pixels of a view, row-major, row 0 at the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Labels {
    /// Depth along the camera's axis, millimetres; 65535 for all beyond. Shape [height, width].
    pub depth_mm: Vec<u16>,
    /// Instance ids ([`EntityId`]). Shape [height, width].
    pub ids: Vec<u16>,
    /// Indices of the classes of things ([`ClassId::index`](chaic_core::ClassId::index)),
    /// [`Labels::NO_CLASS`] for all else: people, structure, sky. Shape
    /// [height, width].
    pub classes: Vec<u8>,
    /// Unit normals of surfaces in the world (x, y, z), as they are lit: round where a round thing
    /// is meant; 0 where nothing is seen. Shape [height, width, 3].
    pub normals: Vec<f32>,
}

impl Labels {
    /// The class of what isn't a thing.
    pub const NO_CLASS: u8 = u8::MAX;
}

/// A depth in millimetres, 65535 for all beyond.
pub fn depth_mm(depth_m: f32) -> u16 {
    (1000.0 * depth_m + 0.5) as u16
}

impl Scene {
    /// Labels of what a view shows of a world, whichever channels it asks for. A camera that can't
    /// see ([`View`]) has labels of nothing.
    pub fn label(&self, world: &World, view: &View) -> Labels {
        let (width, height) = (view.camera.width, view.camera.height);
        if width > MAX_SIDE_PX || height > MAX_SIDE_PX {
            return Labels::default();
        }
        let n = width as usize * height as usize;
        let mut labels = Labels {
            depth_mm: vec![u16::MAX; n],
            ids: vec![EntityId::NOTHING.0; n],
            classes: vec![Labels::NO_CLASS; n],
            normals: vec![0.0; 3 * n],
        };
        if let Some(lens) = Lens::of(&view.camera).filter(|_| n > 0) {
            let state = world.state();
            let postures = world.setup().agents().map(|agent| world.posture(agent));
            let bodies: Vec<Body> = postures.map(|p| Body::new(&p, state.frame)).collect();
            let frame = self.frame(state, &bodies, false);
            with_scratch(|scratch| label(&frame, &lens, view, scratch, &mut labels));
            for (class, id) in labels.classes.iter_mut().zip(&labels.ids) {
                *class = self.class_of(EntityId(*id)).map_or(Labels::NO_CLASS, |c| c.index() as u8);
            }
        }
        labels
    }
}

fn label(frame: &Frame, lens: &Lens, view: &View, scratch: &mut Scratch, labels: &mut Labels) {
    let Scratch { target, work, .. } = scratch;
    draw(frame, lens, view.omit(), target, work);
    let painter = Painter::new(frame, lens);
    let mut last = (BACKGROUND, Plane::default());
    for j in 0..lens.height {
        let blocks = target.visibility_ids(j).iter().zip(target.inverse_depth(j).iter());
        let pixels = blocks.flat_map(|(visibility_ids, inverse_depth)| {
            visibility_ids.iter().zip(inverse_depth.iter())
        });
        for (k, (visibility_id, inverse_depth)) in pixels.enumerate().take(lens.width) {
            if *visibility_id == BACKGROUND {
                continue;
            }
            let (index, triangle) = unpack_visibility_id(*visibility_id);
            let instance = &frame.instances[index];
            if last.0 != *visibility_id {
                let mesh = instance.shape.mesh(usize::from(work.levels[index]));
                let sight = painter.sight(instance);
                let triangle = &mesh.triangles[triangle];
                last = (*visibility_id, painter.normals(instance, &sight, mesh, triangle));
            }
            let row = last.1.from(k, j as f32 + 0.5);
            let depth_m = reciprocal(*inverse_depth);
            let normal = unit((row.base + row.at * depth_m).truncate());
            let pixel = j * lens.width + k;
            labels.depth_mm[pixel] = depth_mm(seen_depth_m(depth_m));
            labels.ids[pixel] = instance.entity.0;
            labels.normals[3 * pixel..][..3].copy_from_slice(&normal.to_array());
        }
    }
}
