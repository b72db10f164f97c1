//! Labels for training perception: classes, normals and depths in millimeters.
//!
//! Agents do not receive them. The code is not optimized for speed.

use chaic_core::EntityId;
use chaic_core::geom::Camera;
use chaic_world::World;

use crate::Scene;
use crate::draw::{Scratch, draw};
use crate::mesh::unit;
use crate::people::Body;
use crate::planes::Plane;
use crate::projection::{Projection, clamp_depth_m, reciprocal};
use crate::raster::{BACKGROUND, VisibilityId as _, unpack_visibility_id};
use crate::scene_frame::SceneFrame;
use crate::shader::Shader;
use crate::view::{MAX_SIDE_PX, View, with_scratch};
use crate::vision_limits::limit_vision;

/// Labels of the pixels of a view, row-major, row 0 at the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Labels {
    /// Depth along the camera axis, millimeters; 65535 for everything farther, 0 outside the limits
    /// of sight. Shape [height, width].
    pub depth_mm: Vec<u16>,
    /// Instance ids ([`EntityId`]). Shape [height, width].
    pub ids: Vec<u16>,
    /// Class index of objects ([`ClassId::index`](chaic_core::ClassId::index)),
    /// [`Labels::NO_CLASS`] for people, structure and sky. Shape [height, width].
    pub classes: Vec<u8>,
    /// Unit shading normals in the world (x, y, z): smooth on round objects, 0 for background.
    /// Shape [height, width, 3].
    pub normals: Vec<f32>,
}

impl Labels {
    /// Class of pixels that show no object.
    pub const NO_CLASS: u8 = u8::MAX;
}

/// Converts a depth to millimeters; 65535 for everything farther.
pub fn depth_mm(depth_m: f32) -> u16 {
    (1000.0 * depth_m + 0.5) as u16
}

impl Scene {
    /// Labels a view of a world, independent of the channels of the view. Limits of sight apply as
    /// to images: pixels outside of them have no depth, id, class or normal. An invalid camera
    /// ([`View`]) gets background labels.
    pub fn label(&self, world: &World, view: &View) -> Labels {
        let (width, height) = (view.camera.width, view.camera.height);
        if width > MAX_SIDE_PX || height > MAX_SIDE_PX {
            return Labels::default();
        }
        let n = width as usize * height as usize;
        let mut surfaces = Surfaces {
            depth_m: vec![Camera::FAR_M; n],
            ids: vec![EntityId::NOTHING.0; n],
            normals: vec![0.0; 3 * n],
        };
        if let Some(projection) = Projection::from_camera(&view.camera).filter(|_| n > 0) {
            let state = world.state();
            let postures = world.setup().agents().map(|agent| world.posture(agent));
            let bodies: Vec<Body> = postures.map(|p| Body::new(&p, state.frame)).collect();
            let frame = self.frame(state, &bodies, false);
            with_scratch(|scratch| {
                find_surfaces(&frame, &projection, view, scratch, &mut surfaces);
            });
        }
        let Surfaces { mut depth_m, mut ids, mut normals } = surfaces;
        if let Some(sight) = &view.sight {
            limit_vision(sight, &view.camera, None, &mut depth_m, Some(&mut ids));
            for (normal, id) in normals.as_chunks_mut::<3>().0.iter_mut().zip(&ids) {
                if *id == EntityId::NOTHING.0 {
                    *normal = [0.0; 3];
                }
            }
        }
        let class_index = |id: &u16| {
            self.class_of(EntityId(*id)).map_or(Labels::NO_CLASS, |class| class.index() as u8)
        };
        Labels {
            depth_mm: depth_m.into_iter().map(depth_mm).collect(),
            classes: ids.iter().map(class_index).collect(),
            ids,
            normals,
        }
    }
}

/// Visible surfaces of a view; shapes as in [`Labels`].
struct Surfaces {
    depth_m: Vec<f32>,
    ids: Vec<u16>,
    normals: Vec<f32>,
}

/// Finds the surfaces of a view without limits of sight. Pixels of the background do not change.
fn find_surfaces(
    frame: &SceneFrame,
    projection: &Projection,
    view: &View,
    scratch: &mut Scratch,
    surfaces: &mut Surfaces,
) {
    let Scratch { target, buffers, .. } = scratch;
    draw(frame, projection, view.exclusions(), target, buffers);
    let shader = Shader::new(frame, projection);
    let mut current = (BACKGROUND, Plane::default());
    for j in 0..projection.height {
        let blocks = target.visibility_ids(j).iter().zip(target.inverse_depth(j).iter());
        let pixels = blocks.flat_map(|(visibility_ids, inverse_depth)| {
            u32::unpack(visibility_ids).into_iter().zip(inverse_depth.iter())
        });
        for (k, (visibility_id, inverse_depth)) in pixels.enumerate().take(projection.width) {
            if visibility_id == BACKGROUND {
                continue;
            }
            let (index, triangle) = unpack_visibility_id(visibility_id);
            let instance = &frame.instances[index];
            if current.0 != visibility_id {
                let mesh = instance.shape.mesh(usize::from(buffers.levels[index]));
                let shared = shader.instance_shading(instance);
                let triangle = &mesh.triangles[triangle];
                current = (visibility_id, shader.normals(instance, &shared, mesh, triangle));
            }
            let row = current.1.at_row(k, j as f32 + 0.5);
            let depth_m = reciprocal(*inverse_depth);
            let normal = unit((row.base + row.at * depth_m).truncate());
            let pixel = j * projection.width + k;
            surfaces.depth_m[pixel] = clamp_depth_m(depth_m);
            surfaces.ids[pixel] = instance.entity.0;
            surfaces.normals[3 * pixel..][..3].copy_from_slice(&normal.to_array());
        }
    }
}
