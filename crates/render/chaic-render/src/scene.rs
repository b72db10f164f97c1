//! What of an episode never changes, made ready for drawing.

use std::sync::{Arc, Mutex};

use chaic_core::observation::Images;
use chaic_core::{ClassId, EntityId, Vec2, Vec3};
use chaic_world::{Place, Posture, Setup, State, ThingState, World};
use glam::Mat3;
use rayon::prelude::*;

use crate::appearance::{Appearance, Painted};
use crate::frame::{ClassMesh, Frame, Instance, Shape};
use crate::ground::{Foot, Ground};
use crate::light::{Light, Shadows};
use crate::light_rig::LightRig;
use crate::mesh::Mesh;
use crate::models::{style_of, tint_of};
use crate::people::Body;
use crate::portals::{PortalGraph, RegionSet};
use crate::structure;
use crate::view::{ImagesMut, View, draw_view, draw_view_into};

/// Everything of an episode that is drawn and never changes: floors, walls, ceilings, and the
/// shapes of things. Cheap to make; cameras share it.
#[derive(Debug)]
pub struct Scene {
    structure: Vec<(EntityId, Mesh, RegionSet)>,
    things: Vec<(Arc<ClassMesh>, Option<[f32; 3]>)>,
    ground: Ground,
    regions: Arc<PortalGraph>,
    appearance: Appearance,
    rig: LightRig,
    static_shadows: Mutex<StaticShadows>,
}

/// Cameras in a world.
#[derive(Clone, Copy, Debug)]
pub struct WorldViews<'a> {
    /// Of the world's episode.
    pub scene: &'a Scene,
    /// The world as it is now.
    pub world: &'a World,
    /// The cameras.
    pub views: &'a [View],
}

/// What many cameras in many worlds see, in their order, into images whose memory is used again. The
/// work goes to all threads of the pool, which take it from each other. The images don't depend on
/// their number.
pub fn render_batch(batch: &[WorldViews], images: &mut Vec<Vec<Images>>) {
    images.resize_with(batch.len(), Vec::new);
    let pairs = batch.par_iter().zip(images.par_iter_mut());
    pairs.for_each(|(job, images)| job.scene.render_into(job.world, job.views, images));
}

fn postures(world: &World) -> Vec<Posture> {
    world.setup().agents().map(|agent| world.posture(agent)).collect()
}

fn bodies(postures: &[Posture], state: &State) -> Vec<Body> {
    postures.iter().map(|p| Body::new(p, state.frame)).collect()
}

impl Scene {
    /// Makes the shapes of an episode ready, in the benchmark's colors.
    pub fn new(setup: &Setup) -> Scene {
        Scene::with_appearance(setup, Appearance::Canonical)
    }

    /// Makes the shapes of an episode ready.
    pub fn with_appearance(setup: &Setup, appearance: Appearance) -> Scene {
        let regions = PortalGraph::new(setup);
        let structure = structure::of(setup).into_iter().map(|(entity, mesh)| {
            let reached = regions.of_box(mesh.min, mesh.max);
            (entity, mesh, reached)
        });
        let things = setup
            .things
            .iter()
            .enumerate()
            .map(|(k, thing)| (ClassMesh::of(thing, style_of(setup, k)), tint_of(setup, k)));
        Scene {
            structure: structure.collect(),
            things: things.collect(),
            ground: Ground::new(setup),
            regions: Arc::new(regions),
            appearance,
            rig: appearance.light_rig(),
            static_shadows: Mutex::default(),
        }
    }

    /// What many cameras see of a world, in their order. The images don't depend on the number of
    /// threads. See [`View`] for cameras that can't see.
    pub fn render(&self, world: &World, views: &[View]) -> Vec<Images> {
        let mut images = Vec::new();
        self.render_into(world, views, &mut images);
        images
    }

    /// The same into images that are there already: their memory is used again.
    pub fn render_into(&self, world: &World, views: &[View], images: &mut Vec<Images>) {
        self.render_state_into(world.state(), &postures(world), views, images);
    }

    /// What one camera sees of a world, into buffers of the caller's. Which images are made depends
    /// on which buffers are there, not on the view's channels.
    ///
    /// # Panics
    /// If a buffer has another length than the camera's images.
    pub fn render_view_into(&self, world: &World, view: &View, images: ImagesMut<'_>) {
        let bodies = bodies(&postures(world), world.state());
        let frame = self.frame(world.state(), &bodies, images.rgb.is_some());
        draw_view_into(&frame, view, images);
        self.recycle(frame.light);
    }

    /// What cameras see of a state and postures that come from elsewhere: a recording, a test.
    /// `postures` are those of the agents in order.
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
            let pairs = views.par_iter().zip(images.par_iter_mut());
            pairs.for_each(|(view, images)| draw_view(&frame, view, images));
        }
        self.recycle(frame.light);
    }

    /// The class of a thing.
    pub fn class_of(&self, entity: EntityId) -> Option<ClassId> {
        let index = entity.0.checked_sub(EntityId::FIRST_OBJECT.0)?;
        self.things.get(usize::from(index)).map(|(mesh, _)| mesh.class())
    }

    /// Which parts of the house are seen from where.
    pub fn regions(&self) -> &Arc<PortalGraph> {
        &self.regions
    }

    /// The same, but that everything may be seen from everywhere.
    #[cfg(test)]
    pub(crate) fn without_regions(mut self) -> Scene {
        self.regions = Arc::default();
        self.structure.iter_mut().for_each(|(.., regions)| *regions = RegionSet::ALL);
        self
    }

    /// What is underfoot, and the lamps.
    pub(crate) fn ground(&self) -> &Ground {
        &self.ground
    }

    pub(crate) fn frame<'a>(
        &'a self,
        state: &State,
        bodies: &'a [Body],
        wants_color: bool,
    ) -> Frame<'a> {
        let mut light = self.static_light(state, wants_color);
        self.cast_moving(state, &mut light);
        let mut instances =
            Vec::with_capacity(self.structure.len() + self.things.len() + bodies.len());
        for (k, (entity, mesh, regions)) in self.structure.iter().enumerate() {
            // Walls and ceilings are made of pieces, which must not differ in color.
            let painted = match *entity {
                EntityId::FLOOR => Painted::Floor(k),
                other => Painted::Shell(other),
            };
            instances.push(Instance {
                entity: *entity,
                shape: Shape::Fixed(mesh),
                rotation: Mat3::IDENTITY,
                origin: Vec3::ZERO,
                min: mesh.min,
                max: mesh.max,
                tint: None,
                factor: self.appearance.factor(painted),
                room: None,
                regions: Some(*regions),
            });
        }
        for (k, body) in bodies.iter().enumerate().filter(|(_, b)| b.pose.position.is_finite()) {
            let pose = &body.pose;
            let center = Vec2::new(pose.position.x, pose.position.z);
            let half = Vec2::splat(body.foot_radius_m);
            light.cast(&Foot { center, axis: Vec2::X, half, depth: 0.5, round: true });
            light.cast_by_sun(center, Vec2::splat(0.6 * body.foot_radius_m), body.height_m);
            let rotation = Mat3::from_quat(chaic_core::geom::yaw_rotation(pose.yaw_rad));
            instances.push(Instance {
                entity: EntityId(EntityId::FIRST_PERSON.0 + k.min(7) as u16),
                shape: Shape::Body(body),
                rotation,
                origin: pose.position,
                min: body.min,
                max: body.max,
                tint: None,
                factor: self.appearance.factor(Painted::Person(k)),
                room: Some(self.ground.room_at(pose.position)),
                regions: None,
            });
        }
        for (k, (class, tint)) in self.things.iter().enumerate().take(N_IDS) {
            let Some(thing) = state.things.get(k) else { break };
            let Some(rotation) = shown_rotation(thing) else { continue };
            instances.push(Instance {
                entity: Setup::entity(k),
                shape: Shape::Class(class),
                rotation,
                origin: thing.position,
                min: class.min,
                max: class.max,
                tint: *tint,
                factor: self.appearance.factor(Painted::Thing(k)),
                room: Some(self.ground.room_at(thing.position)),
                regions: None,
            });
        }
        light.finish();
        Frame { instances, regions: &self.regions, light }
    }

    /// The light with the shadows of walls and of all things that lie still: those of the last
    /// moment are kept.
    fn static_light(&self, state: &State, wants_color: bool) -> Light<'_> {
        if !wants_color {
            return Light::new(&self.ground, &self.rig, None);
        }
        let places = state.things.iter().map(|thing| {
            let is_still = matches!(thing.place, Place::Resting { .. });
            shown_rotation(thing).filter(|_| is_still).map(|r| (thing.position, r))
        });
        let mut still =
            self.static_shadows.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if still.version == 0 || !still.places.iter().copied().eq(places.clone()) {
            still.version += 1;
            still.places = places.collect();
            still.spare.clear();
            let shadows = Shadows::of_walls(&self.ground);
            let mut light = Light::new(&self.ground, &self.rig, Some(shadows));
            for ((class, _), place) in self.things.iter().zip(&still.places) {
                if let Some((position, rotation)) = place {
                    cast_foot(&mut light, class, rotation, *position);
                }
            }
            light.finish();
            still.shadows = light.shadows.unwrap_or_default();
        }
        let shadows = still.spare.pop().unwrap_or_else(|| still.shadows.clone());
        Light { version: still.version, ..Light::new(&self.ground, &self.rig, Some(shadows)) }
    }

    /// Adds the shadows of things that don't lie still.
    fn cast_moving(&self, state: &State, light: &mut Light) {
        for ((class, _), thing) in self.things.iter().zip(&state.things) {
            let moves = !matches!(thing.place, Place::Resting { .. });
            if let (Some(rotation), true) = (shown_rotation(thing), moves) {
                cast_foot(light, class, &rotation, thing.position);
            }
        }
    }

    /// Takes the memory of shadows back, to be used again.
    pub(crate) fn recycle(&self, light: Light) {
        let Light { shadows: Some(mut shadows), version, .. } = light else { return };
        let mut still =
            self.static_shadows.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if still.version == version {
            shadows.restore(&still.shadows, &self.ground);
            still.spare.push(shadows);
        }
    }
}

/// As many things as ids can name; what comes after them has none, and can't be drawn.
const N_IDS: usize = (u16::MAX - EntityId::FIRST_OBJECT.0) as usize + 1;

/// The shadows of what lay still when it was last looked at in color.
#[derive(Debug, Default)]
struct StaticShadows {
    /// Counts up when something that lay still has been moved; 0 before the first look.
    version: u64,
    /// Position and rotation of each thing that lies still.
    places: Vec<Option<(Vec3, Mat3)>>,
    shadows: Shadows,
    /// Copies of the shadows, to be added to.
    spare: Vec<Shadows>,
}

/// How a thing is turned, if it is there to be seen.
fn shown_rotation(thing: &ThingState) -> Option<Mat3> {
    let q = thing.rotation;
    let norm2 = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    let is_sane = thing.position.is_finite() && (norm2 - 1.0).abs() < 0.01;
    (thing.place != Place::Broken && is_sane).then(|| Mat3::from_quat(q))
}

/// Things higher than this cast a shadow of the sun, metres.
const CASTS_FROM_M: f32 = 0.25;

fn cast_foot(light: &mut Light, class: &ClassMesh, rotation: &Mat3, position: Vec3) {
    let (low, high) = (position.y + class.min.y, position.y + class.max.y);
    if low < 0.5 && high > CASTS_FROM_M {
        let half = 0.5 * (class.max - class.min);
        light.cast_by_sun(Vec2::new(position.x, position.z), Vec2::new(half.x, half.z), high);
    }
    // Only what is near the ground darkens it, the more the nearer.
    let depth = 0.55 * (1.0 - 3.0 * position.y).clamp(0.0, 1.0);
    let axis = Vec2::new(rotation.x_axis.x, rotation.x_axis.z);
    let length = (axis.x * axis.x + axis.y * axis.y).sqrt();
    if depth <= 0.0 || length < 0.1 {
        return;
    }
    let middle = 0.5 * (class.min + class.max);
    let center = position + *rotation * Vec3::new(middle.x, 0.0, middle.z);
    let half = 0.5 * (class.max - class.min);
    light.cast(&Foot {
        center: Vec2::new(center.x, center.z),
        axis: axis / length,
        half: Vec2::new(half.x, half.z),
        depth,
        round: half.x.max(half.z) < 0.12,
    });
}
