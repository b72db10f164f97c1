//! Static geometry of an episode, prepared for rendering.

use std::sync::{Arc, Mutex};

use chaic_core::observation::Images;
use chaic_core::{ClassId, EntityId, Vec2, Vec3};
use chaic_world::{ObjectLocation, ObjectState, Posture, Setup, State, World};
use glam::Mat3;
use rayon::prelude::*;

use crate::appearance::{Appearance, ColoredPart};
use crate::ground::{Footprint, Ground};
use crate::light::{Light, Shadows};
use crate::light_rig::LightRig;
use crate::mesh::Mesh;
use crate::models::{object_style, object_tint};
use crate::people::Body;
use crate::portals::{PortalGraph, RegionSet};
use crate::scene_frame::{ClassMesh, Instance, SceneFrame, Shape};
use crate::structure;
use crate::view::{ImagesMut, View, draw_view, draw_view_into};

/// Static geometry of an episode: floors, walls, ceilings, and the shapes of objects. It is cheap
/// to create, and cameras share it.
#[derive(Debug)]
pub struct Scene {
    structure: Vec<(EntityId, Mesh, RegionSet)>,
    objects: Vec<(Arc<ClassMesh>, Option<[f32; 3]>)>,
    ground: Ground,
    portals: Arc<PortalGraph>,
    appearance: Appearance,
    light_rig: LightRig,
    static_shadows: Mutex<StaticShadows>,
}

/// Views of one world.
#[derive(Clone, Copy, Debug)]
pub struct WorldViews<'a> {
    /// The scene of the world's episode.
    pub scene: &'a Scene,
    /// The current world.
    pub world: &'a World,
    /// Views to render.
    pub views: &'a [View],
}

/// Renders the views of many worlds in order, into images whose memory is reused. All threads of
/// the pool share the work by work stealing. The images do not depend on the number of threads.
pub fn render_batch(batch: &[WorldViews], images: &mut Vec<Vec<Images>>) {
    images.resize_with(batch.len(), Vec::new);
    let pairs = batch.par_iter().zip(images.par_iter_mut());
    pairs.for_each(|(world_views, images)| {
        world_views.scene.render_into(world_views.world, world_views.views, images)
    });
}

fn postures(world: &World) -> Vec<Posture> {
    world.setup().agents().map(|agent| world.posture(agent)).collect()
}

fn bodies(postures: &[Posture], state: &State) -> Vec<Body> {
    postures.iter().map(|p| Body::new(p, state.frame)).collect()
}

impl Scene {
    /// Prepares the geometry of an episode with the canonical appearance.
    pub fn new(setup: &Setup) -> Scene {
        Scene::with_appearance(setup, Appearance::Canonical)
    }

    /// Prepares the geometry of an episode with a given appearance.
    pub fn with_appearance(setup: &Setup, appearance: Appearance) -> Scene {
        let portals = PortalGraph::new(setup);
        let structure = structure::meshes(setup).into_iter().map(|(entity, mesh)| {
            let regions = portals.regions_in_box(mesh.min, mesh.max);
            (entity, mesh, regions)
        });
        let objects = setup.things.iter().enumerate().map(|(k, object)| {
            (ClassMesh::shared(object, object_style(setup, k)), object_tint(setup, k))
        });
        Scene {
            structure: structure.collect(),
            objects: objects.collect(),
            ground: Ground::new(setup),
            portals: Arc::new(portals),
            appearance,
            light_rig: appearance.light_rig(),
            static_shadows: Mutex::default(),
        }
    }

    /// Renders views of a world in order. The images do not depend on the number of threads. See
    /// [`View`] for invalid cameras.
    pub fn render(&self, world: &World, views: &[View]) -> Vec<Images> {
        let mut images = Vec::new();
        self.render_into(world, views, &mut images);
        images
    }

    /// Renders views into existing images whose memory is reused.
    pub fn render_into(&self, world: &World, views: &[View], images: &mut Vec<Images>) {
        self.render_state_into(world.state(), &postures(world), views, images);
    }

    /// Renders one view of a world into caller-owned buffers. Which images are rendered depends on
    /// which buffers are present, not on the channels of the view.
    ///
    /// # Panics
    /// If the length of a buffer differs from the length of the camera's image.
    pub fn render_view_into(&self, world: &World, view: &View, images: ImagesMut<'_>) {
        let bodies = bodies(&postures(world), world.state());
        let frame = self.frame(world.state(), &bodies, images.rgb.is_some());
        draw_view_into(&frame, view, images);
        self.recycle_shadows(frame.light);
    }

    /// Renders views of a given state, for example from a recording. `postures` lists the postures
    /// of the agents in order.
    pub fn render_state(&self, state: &State, postures: &[Posture], views: &[View]) -> Vec<Images> {
        let mut images = Vec::new();
        self.render_state_into(state, postures, views, &mut images);
        images
    }

    fn render_state_into(
        &self,
        state: &State,
        postures: &[Posture],
        views: &[View],
        images: &mut Vec<Images>,
    ) {
        images.resize_with(views.len(), Images::default);
        let wants_color = views.iter().any(|v| v.channels.rgb);
        let bodies = bodies(postures, state);
        let frame = self.frame(state, &bodies, wants_color);
        if let ([view], [images]) = (views, &mut images[..]) {
            draw_view(&frame, view, images);
        } else {
            // The module of the pages has one thread.
            #[cfg(target_arch = "wasm32")]
            let pairs = views.iter().zip(images.iter_mut());
            #[cfg(not(target_arch = "wasm32"))]
            let pairs = views.par_iter().zip(images.par_iter_mut());
            pairs.for_each(|(view, images)| draw_view(&frame, view, images));
        }
        self.recycle_shadows(frame.light);
    }

    /// Returns the class of an object.
    pub fn class_of(&self, entity: EntityId) -> Option<ClassId> {
        let index = entity.0.checked_sub(EntityId::FIRST_OBJECT.0)?;
        self.objects.get(usize::from(index)).map(|(mesh, _)| mesh.class())
    }

    /// Returns the portal graph of the house.
    pub fn portal_graph(&self) -> &Arc<PortalGraph> {
        &self.portals
    }

    /// Disables portal culling.
    #[cfg(test)]
    pub(crate) fn without_portals(mut self) -> Scene {
        self.portals = Arc::default();
        self.structure.iter_mut().for_each(|(.., regions)| *regions = RegionSet::ALL);
        self
    }

    /// Returns the ground: floors, room lookup and lamps.
    pub(crate) fn ground(&self) -> &Ground {
        &self.ground
    }

    pub(crate) fn frame<'a>(
        &'a self,
        state: &State,
        bodies: &'a [Body],
        wants_color: bool,
    ) -> SceneFrame<'a> {
        let mut light = self.static_light(state, wants_color);
        self.cast_moving_shadows(state, &mut light);
        let mut instances =
            Vec::with_capacity(self.structure.len() + self.objects.len() + bodies.len());
        for (k, (entity, mesh, regions)) in self.structure.iter().enumerate() {
            // Walls and ceilings consist of pieces, which must have the same color.
            let part = match *entity {
                EntityId::FLOOR => ColoredPart::Floor(k),
                other => ColoredPart::Shell(other),
            };
            instances.push(Instance {
                entity: *entity,
                shape: Shape::Fixed(mesh),
                rotation: Mat3::IDENTITY,
                origin: Vec3::ZERO,
                min: mesh.min,
                max: mesh.max,
                tint: None,
                factor: self.appearance.factor(part),
                room: None,
                regions: Some(*regions),
            });
        }
        for (k, body) in bodies.iter().enumerate().filter(|(_, b)| b.pose.position.is_finite()) {
            let pose = &body.pose;
            let center = Vec2::new(pose.position.x, pose.position.z);
            let half_extent = Vec2::splat(body.foot_radius_m);
            light.splat_contact_shadow(&Footprint {
                center,
                axis: Vec2::X,
                half_extent,
                strength: 0.5,
                is_round: true,
            });
            light.cast_sun_shadow(center, Vec2::splat(0.6 * body.foot_radius_m), body.height_m);
            let rotation = Mat3::from_quat(chaic_core::geom::yaw_rotation(pose.yaw_rad));
            instances.push(Instance {
                entity: EntityId(EntityId::FIRST_PERSON.0 + k.min(7) as u16),
                shape: Shape::Body(body),
                rotation,
                origin: pose.position,
                min: body.min,
                max: body.max,
                tint: None,
                factor: self.appearance.factor(ColoredPart::Person(k)),
                room: Some(self.ground.room_at(pose.position)),
                regions: None,
            });
        }
        for (k, (class, tint)) in self.objects.iter().enumerate().take(N_IDS) {
            let Some(object) = state.objects.get(k) else { break };
            let Some(rotation) = valid_rotation(object) else { continue };
            instances.push(Instance {
                entity: Setup::entity(k),
                shape: Shape::Class(class),
                rotation,
                origin: object.position,
                min: class.min,
                max: class.max,
                tint: *tint,
                factor: self.appearance.factor(ColoredPart::Object(k)),
                room: Some(self.ground.room_at(object.position)),
                regions: None,
            });
        }
        light.finish();
        SceneFrame { instances, portals: &self.portals, light }
    }

    /// Lighting with the shadows of walls and of all resting objects. The shadows of the last frame
    /// are cached.
    fn static_light(&self, state: &State, wants_color: bool) -> Light<'_> {
        if !wants_color {
            return Light::new(&self.ground, &self.light_rig, None);
        }
        let object_poses = state.objects.iter().map(|object| {
            let is_at_rest = matches!(object.location, ObjectLocation::Resting { .. });
            valid_rotation(object).filter(|_| is_at_rest).map(|r| (object.position, r))
        });
        let mut cache =
            self.static_shadows.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if cache.version == 0 || !cache.object_poses.iter().copied().eq(object_poses.clone()) {
            cache.version += 1;
            cache.object_poses = object_poses.collect();
            cache.free_copies.clear();
            let shadows = Shadows::from_walls(&self.ground);
            let mut light = Light::new(&self.ground, &self.light_rig, Some(shadows));
            for ((class, _), pose) in self.objects.iter().zip(&cache.object_poses) {
                if let Some((position, rotation)) = pose {
                    cast_object_shadow(&mut light, class, rotation, *position);
                }
            }
            light.finish();
            cache.shadows = light.shadows.unwrap_or_default();
        }
        let shadows = cache.free_copies.pop().unwrap_or_else(|| cache.shadows.clone());
        Light { version: cache.version, ..Light::new(&self.ground, &self.light_rig, Some(shadows)) }
    }

    /// Adds the shadows of objects that are not at rest.
    fn cast_moving_shadows(&self, state: &State, light: &mut Light) {
        for ((class, _), object) in self.objects.iter().zip(&state.objects) {
            let is_moving = !matches!(object.location, ObjectLocation::Resting { .. });
            if let (Some(rotation), true) = (valid_rotation(object), is_moving) {
                cast_object_shadow(light, class, &rotation, object.position);
            }
        }
    }

    /// Returns the memory of shadows to the cache.
    pub(crate) fn recycle_shadows(&self, light: Light) {
        let Light { shadows: Some(mut shadows), version, .. } = light else { return };
        let mut cache =
            self.static_shadows.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if cache.version == version {
            shadows.restore(&cache.shadows, &self.ground);
            cache.free_copies.push(shadows);
        }
    }
}

/// Number of objects that ids can name. Later objects have no id and are not drawn.
const N_IDS: usize = (u16::MAX - EntityId::FIRST_OBJECT.0) as usize + 1;

/// Cached shadows of the objects at rest in the last frame with color.
#[derive(Debug, Default)]
struct StaticShadows {
    /// Incremented when the set of resting objects changes; 0 before the first frame.
    version: u64,
    /// Position and rotation of each object at rest.
    object_poses: Vec<Option<(Vec3, Mat3)>>,
    shadows: Shadows,
    /// Copies of the shadows, to which moving objects are added.
    free_copies: Vec<Shadows>,
}

/// Rotation of an object; `None` if it is broken or its pose is invalid.
fn valid_rotation(object: &ObjectState) -> Option<Mat3> {
    let q = object.rotation;
    let norm_squared = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    let is_valid = object.position.is_finite() && (norm_squared - 1.0).abs() < 0.01;
    (object.location != ObjectLocation::Broken && is_valid).then(|| Mat3::from_quat(q))
}

/// Objects that reach above this height cast a shadow from the sun, meters.
const MIN_SUN_SHADOW_HEIGHT_M: f32 = 0.25;

fn cast_object_shadow(light: &mut Light, class: &ClassMesh, rotation: &Mat3, position: Vec3) {
    let (low, high) = (position.y + class.min.y, position.y + class.max.y);
    if low < 0.5 && high > MIN_SUN_SHADOW_HEIGHT_M {
        let half_extent = 0.5 * (class.max - class.min);
        light.cast_sun_shadow(
            Vec2::new(position.x, position.z),
            Vec2::new(half_extent.x, half_extent.z),
            high,
        );
    }
    // Only objects near the ground cast a contact shadow, which is darker the nearer they are.
    let strength = 0.55 * (1.0 - 3.0 * position.y).clamp(0.0, 1.0);
    let axis = Vec2::new(rotation.x_axis.x, rotation.x_axis.z);
    let length = (axis.x * axis.x + axis.y * axis.y).sqrt();
    if strength <= 0.0 || length < 0.1 {
        return;
    }
    let center_in_object = 0.5 * (class.min + class.max);
    let center = position + *rotation * Vec3::new(center_in_object.x, 0.0, center_in_object.z);
    let half_extent = 0.5 * (class.max - class.min);
    light.splat_contact_shadow(&Footprint {
        center: Vec2::new(center.x, center.z),
        axis: axis / length,
        half_extent: Vec2::new(half_extent.x, half_extent.z),
        strength,
        is_round: half_extent.x.max(half_extent.z) < 0.12,
    });
}
