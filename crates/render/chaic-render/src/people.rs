//! Meshes of people, generated from postures.

mod body_mesh;
mod outfit;
mod proportions;
mod skeleton;
mod wheelchair;

use std::sync::OnceLock;

use chaic_core::Vec3;
use chaic_core::capability::{Gait, Persona};
use chaic_core::geom::Pose;
use chaic_world::Posture;

use crate::mesh::Mesh;
use crate::solids::{Detail, N_LEVELS};
use outfit::Outfit;
use proportions::BodyProportions;
use skeleton::Skeleton;

/// Body of a person in one frame; its meshes are built on first use.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub pose: Pose,
    /// Bounding box in the body frame, meters.
    pub min: Vec3,
    pub max: Vec3,
    /// Radius of its shadow on the ground, meters.
    pub foot_radius_m: f32,
    pub height_m: f32,
    in_wheelchair: bool,
    walked_m: f32,
    proportions: BodyProportions,
    outfit: Outfit,
    skeleton: Skeleton,
    levels: [OnceLock<Mesh>; N_LEVELS],
}

impl Body {
    /// Body in this posture; `frame` drives tremor.
    pub fn new(posture: &Posture, frame: u32) -> Body {
        let posture = &sanitize(posture);
        let proportions = BodyProportions::new(posture);
        let in_wheelchair = posture.gait == Gait::Roll || posture.persona == Persona::Wheelchair;
        let skeleton = Skeleton::new(posture, &proportions, in_wheelchair, frame);
        let (mut min, mut max) = skeleton.bounds(&proportions);
        if in_wheelchair {
            (min, max) = (min.min(wheelchair::MIN), max.max(wheelchair::MAX));
        }
        Body {
            pose: posture.pose,
            min,
            max,
            foot_radius_m: if in_wheelchair { 0.38 } else { 0.17 * posture.height_m },
            height_m: posture.height_m,
            in_wheelchair,
            walked_m: posture.walked_m,
            outfit: Outfit::new(posture),
            skeleton,
            proportions,
            levels: [const { OnceLock::new() }; N_LEVELS],
        }
    }

    /// Returns the mesh at a level of detail.
    pub fn level(&self, level: usize) -> &Mesh {
        self.levels[level].get_or_init(|| self.build_mesh(level))
    }

    fn build_mesh(&self, level: usize) -> Mesh {
        let detail = Detail::of_level(level, 0.5 * self.height_m);
        let mut mesh = Mesh::default();
        body_mesh::add(&mut mesh, &self.skeleton, &self.proportions, &self.outfit, detail);
        if self.in_wheelchair {
            wheelchair::add(&mut mesh, self.walked_m, detail);
        }
        mesh.finish()
    }
}

/// Clamps a posture to valid values, for example from an untrusted recording.
fn sanitize(posture: &Posture) -> Posture {
    let mut p = *posture;
    let within = |x: f32, low: f32, high: f32, otherwise: f32| {
        if x.is_finite() { x.clamp(low, high) } else { otherwise }
    };
    p.height_m = within(p.height_m, 0.3, 3.0, 1.75);
    p.walked_m = within(p.walked_m, 0.0, 1e6, 0.0);
    p.bend = within(p.bend, 0.0, 1.0, 0.0);
    p.stretch = within(p.stretch, 0.0, 1.0, 0.0);
    p.fatigue = within(p.fatigue, 0.0, 1.0, 0.0);
    if !p.pose.yaw_rad.is_finite() {
        p.pose.yaw_rad = 0.0;
    }
    for arm in &mut p.arms {
        if !arm.hand_in_body.is_finite() {
            arm.hand_in_body = Vec3::new(0.0, 1.0, -0.2);
        }
        arm.hand_in_body = arm.hand_in_body.clamp(Vec3::splat(-3.0), Vec3::splat(3.0));
    }
    p
}

#[cfg(test)]
mod tests {
    use chaic_core::AgentId;
    use chaic_core::capability::{IMPAIRMENTS, ImpairmentInfo};

    use super::*;
    use crate::geometry::FINEST_LEVEL;
    use chaic_test_kit::scenes;

    #[test]
    fn a_body_fills_its_bounding_box() {
        let base = scenes::world(scenes::house()).posture(AgentId(0));
        let mut rng = chaic_core::rng::RngStream::new(1, "bodies", 0);
        for persona in Persona::ALL {
            for _ in 0..40 {
                let mut posture = Posture { persona, ..base };
                posture.walked_m = rng.range(0.0, 5.0);
                posture.bend = rng.range(0.0, 1.0);
                posture.stretch = rng.range(0.0, 1.0);
                posture.fatigue = rng.range(0.0, 1.0);
                let has = |_: &&ImpairmentInfo| rng.chance(0.5);
                posture.impairments = IMPAIRMENTS.iter().filter(has).map(|i| i.id).collect();
                posture.height_m = rng.range(1.0, 1.9);
                let body = Body::new(&posture, rng.below(100) as u32);
                let (mesh, max_margin) = (body.level(FINEST_LEVEL), 0.35);
                assert!(body.min.cmple(mesh.min).all(), "{posture:?}: {} {}", body.min, mesh.min);
                assert!(body.max.cmpge(mesh.max).all(), "{posture:?}: {} {}", body.max, mesh.max);
                let slack = (mesh.min - body.min).max(body.max - mesh.max).max_element();
                assert!(slack < max_margin, "{posture:?}: {slack} m");
            }
        }
    }
}
