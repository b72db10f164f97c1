//! Continuous quantities that the reference takes as given, and plain geometry on them.

use chaic_core::geom::Pose;
use chaic_core::{AgentId, EntityId, Quat, Vec3};
use chaic_world::{ObjectLocation, Phase, Setup, World};

use crate::verdict::{TOLERANCE, Verdict};

/// Poses of people and objects at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Scene {
    /// Pose of each person.
    pub(crate) people: Vec<Pose>,
    /// Position of the bottom and rotation of each object.
    pub(crate) objects: Vec<(Vec3, Quat)>,
}

/// Quantities of one frame that the reference takes as given.
#[derive(Clone, Debug, Default)]
pub(crate) struct GivenQuantities {
    /// Poses after the frame.
    pub(crate) after: Scene,
    /// Support of each object that is at rest after the frame; the outer option is `None` for
    /// objects that are not at rest.
    pub(crate) rests_on: Vec<Option<Option<EntityId>>>,
    /// True for a person whose step or approach ended in this frame. The reference reads it under
    /// the rules of the original only, where the contact of a probe ends steps.
    pub(crate) stopped: Vec<bool>,
}

impl Scene {
    /// Reads the poses of a world.
    pub(crate) fn of(world: &World) -> Scene {
        let state = world.state();
        Scene {
            people: state.agents.iter().map(|a| a.pose).collect(),
            objects: state.objects.iter().map(|o| (o.position, o.rotation)).collect(),
        }
    }
}

/// Returns, for each person, whether it walks or approaches an object.
pub(crate) fn walkers(world: &World) -> Vec<bool> {
    let walks = |p: Phase| matches!(p, Phase::Walk { .. } | Phase::Approach { .. });
    world.state().agents.iter().map(|a| a.phase().is_some_and(|s| walks(s.phase))).collect()
}

impl GivenQuantities {
    /// Reads what happened in a frame; `walked` names the people who walked before it.
    pub(crate) fn of(world: &World, walked: &[bool]) -> GivenQuantities {
        let support = |location: &ObjectLocation| match location {
            ObjectLocation::Resting { on } => Some(*on),
            _ => None,
        };
        let walks = walkers(world);
        GivenQuantities {
            after: Scene::of(world),
            rests_on: world.state().objects.iter().map(|o| support(&o.location)).collect(),
            stopped: walked.iter().zip(walks).map(|(before, after)| *before && !after).collect(),
        }
    }
}

/// Point in plan: x and z, meters.
type Point = [f64; 2];

fn plan(v: Vec3) -> Point {
    [f64::from(v.x), f64::from(v.z)]
}

fn length(v: Point) -> f64 {
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

/// Returns the distance of two points in plan, meters.
pub(crate) fn distance_m(a: Vec3, b: Vec3) -> f64 {
    length(minus(plan(a), plan(b)))
}

/// A rectangle in plan.
struct Outline {
    center: Point,
    /// Direction of its first axis, of length 1. The second axis is a quarter turn further.
    axis: Point,
    /// Half of its extents along both axes.
    half: Point,
}

impl Outline {
    /// Creates a rectangle whose first axis has this direction.
    fn new(center: Point, axis: Point, half: Point) -> Outline {
        let norm = length(axis);
        let axis = if norm > 0.0 { [axis[0] / norm, axis[1] / norm] } else { [1.0, 0.0] };
        Outline { center, axis, half }
    }

    /// Returns the coordinates of a point along both axes.
    fn local(&self, p: Point) -> Point {
        let [x, z] = minus(p, self.center);
        let [ax, az] = self.axis;
        [x * ax + z * az, z * ax - x * az]
    }

    fn nearest(&self, p: Point) -> Point {
        let [u, v] = self.local(p);
        let (u, v) = (u.clamp(-self.half[0], self.half[0]), v.clamp(-self.half[1], self.half[1]));
        let [ax, az] = self.axis;
        [self.center[0] + u * ax - v * az, self.center[1] + u * az + v * ax]
    }

    /// Returns the length of the part of a line that is inside the rectangle, meters.
    fn covered_m(&self, a: Point, b: Point) -> f64 {
        let (a, b) = (self.local(a), self.local(b));
        let (mut start, mut end) = (0.0_f64, 1.0_f64);
        for k in 0..2 {
            let step = b[k] - a[k];
            if step.abs() < 1e-12 {
                if a[k].abs() > self.half[k] {
                    return 0.0;
                }
                continue;
            }
            let (t0, t1) = ((-self.half[k] - a[k]) / step, (self.half[k] - a[k]) / step);
            start = start.max(t0.min(t1));
            end = end.min(t0.max(t1));
        }
        (end - start).max(0.0) * length(minus(b, a))
    }
}

/// Fixed shapes of an episode.
#[derive(Clone, Debug)]
pub(crate) struct Geometry<'a> {
    pub(crate) setup: &'a Setup,
    /// Height up to which people step over things, meters.
    pub(crate) step_over_m: f32,
}

impl Geometry<'_> {
    fn outline(&self, scene: &Scene, entity: EntityId) -> Outline {
        let k = self.setup.object_index(entity).expect("the object exists");
        let (position, rotation) = scene.objects[k];
        let size = self.setup.things[k].size_m();
        let front = rotation * Vec3::NEG_Z;
        // The front is along the second axis, in the opposite direction.
        let axis = [f64::from(-front.z), f64::from(front.x)];
        let half = [0.5 * f64::from(size.x), 0.5 * f64::from(size.z)];
        Outline::new(plan(position), axis, half)
    }

    /// Returns the nearest point of an object's outline at floor level.
    pub(crate) fn nearest(&self, scene: &Scene, from: Vec3, entity: EntityId) -> Vec3 {
        let [x, z] = self.outline(scene, entity).nearest(plan(from));
        Vec3::new(x as f32, 0.0, z as f32)
    }

    /// Returns the distance in plan from a point to the outline of an object, meters.
    pub(crate) fn distance_to_edge_m(&self, scene: &Scene, from: Vec3, entity: EntityId) -> f64 {
        let p = plan(from);
        length(minus(self.outline(scene, entity).nearest(p), p))
    }

    /// Returns half of the longer side of an object in plan, meters.
    pub(crate) fn half_longer_side_m(&self, entity: EntityId) -> f64 {
        let k = self.setup.object_index(entity).expect("the object exists");
        let size = self.setup.things[k].size_m();
        0.5 * f64::from(size.x.max(size.z))
    }

    /// Returns the height of the highest corner of an object's box, meters.
    pub(crate) fn top_m(&self, scene: &Scene, entity: EntityId) -> f64 {
        let k = self.setup.object_index(entity).expect("the object exists");
        let (position, rotation) = scene.objects[k];
        let size = self.setup.things[k].size_m();
        let corner = |x: f32, y: f32, z: f32| {
            let local = Vec3::new(x * size.x, y * size.y, z * size.z);
            f64::from(position.y) + f64::from((rotation * local).y)
        };
        let mut top = f64::NEG_INFINITY;
        for x in [-0.5, 0.5] {
            for y in [0.0, 1.0] {
                for z in [-0.5, 0.5] {
                    top = top.max(corner(x, y, z));
                }
            }
        }
        top
    }

    /// Returns whether no wall stands between two points in plan.
    ///
    /// The world samples the line every [`SAMPLE_M`]. It may miss a wall that covers less of the
    /// line, for example at a corner.
    pub(crate) fn sees(&self, from: Vec3, to: Vec3) -> Verdict {
        /// Distance between two samples of the world, meters.
        const SAMPLE_M: f64 = 0.04;
        let (from, to) = (plan(from), plan(to));
        let mut sight = Verdict::Yes;
        for wall in self.setup.walls.iter().filter(|w| w.bottom_m < self.step_over_m) {
            let (a, b) = (wall.a.as_dvec2(), wall.b.as_dvec2());
            let (middle, along) = (0.5 * (a + b), b - a);
            let thickness = f64::from(wall.thickness_m);
            let outline = |grown: f64| {
                let half = [0.5 * (along.length() + thickness) + grown, 0.5 * thickness + grown];
                Outline::new([middle.x, middle.y], [along.x, along.y], half)
            };
            if outline(-TOLERANCE).covered_m(from, to) > SAMPLE_M + TOLERANCE {
                return Verdict::No;
            }
            if outline(TOLERANCE).covered_m(from, to) > 0.0 {
                sight = Verdict::Open;
            }
        }
        sight
    }

    /// Returns whether a person left its place between two scenes.
    pub(crate) fn has_moved(before: &Scene, after: &Scene, agent: AgentId) -> bool {
        before.people[agent.index()].position != after.people[agent.index()].position
    }
}
