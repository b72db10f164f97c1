//! Positions of objects: in hands and baskets, on free spots, and at the start of a fall.

use chaic_core::action::Hand;
use chaic_core::catalogue::Role;
use chaic_core::geom::{
    forward, horizontal_distance, math, right, rotate_yaw, to_xz, yaw_rotation,
};
use chaic_core::{AgentId, EntityId, Vec3};

use crate::collide::Body;
use crate::fall::{self, Falling, Obstacle};
use crate::setup::Setup;
use crate::shape::{Block, surfaces_at};
use crate::state::ObjectLocation;
use crate::world::World;

/// Spacing of candidate spots, meters.
const SPOT_SPACING_M: f32 = 0.12;
/// Clearance around an object on a surface, meters.
const CLEARANCE_M: f32 = 0.02;
/// Maximum height of flat objects that carry other objects, such as rugs, meters.
const MAX_RUG_HEIGHT_M: f32 = 0.03;
/// Center of a bicycle's basket in the frame of the bicycle, as a fraction of its size. The front
/// faces -z.
const BASKET_IN_VEHICLE: [f32; 3] = [0.0, 0.78, -0.36];
/// Position of a vehicle in the frame of its rider, meters: at the left hand.
const VEHICLE_IN_RIDER: Vec3 = Vec3::new(-0.45, 0.0, -0.1);

impl World {
    /// Moves all held and contained objects to the current positions of hands and containers.
    pub(crate) fn update_carried_objects(&mut self) {
        if let Some(joint) = self.state.joint.filter(|j| j.under_way) {
            let leader = self.person(joint.leader).pose;
            // The bounds clamp the follower, because rules without collision do not check turns.
            let (at, bounds) = (leader.to_world(joint.follower_in_leader), self.setup.bounds);
            let inside = to_xz(at).clamp(bounds.min, bounds.max);
            self.person_mut(joint.follower).pose.position = Vec3::new(inside.x, at.y, inside.y);
            self.face(joint.follower, leader.position);
        }
        for agent in self.setup.agents() {
            for hand in Hand::BOTH {
                let Some(object) = self.person(agent).hands[hand.index()] else { continue };
                self.carry_in_hand(agent, hand, object);
            }
        }
        for i in 0..self.state.objects.len() {
            if let ObjectLocation::Inside { container, slot } = self.state.objects[i].location {
                let at = self.slot_in_world(container, slot);
                let rotation = self.object(container).1.rotation;
                self.state.objects[i].position = at;
                self.state.objects[i].rotation = rotation;
            }
        }
    }

    fn carry_in_hand(&mut self, agent: AgentId, hand: Hand, object: EntityId) {
        let pose = self.person(agent).pose;
        let (spec, _) = self.object(object);
        let size = spec.size_m();
        let position = match spec.class.info().role {
            Role::Vehicle => pose.to_world(VEHICLE_IN_RIDER),
            Role::HeavyTarget => self.furniture_in_world(agent, object),
            _ => self.hand_in_world(agent, hand) - Vec3::Y * 0.5 * size.y,
        };
        let state = self.object_mut(object);
        state.position = position;
        state.rotation = yaw_rotation(pose.yaw_rad);
    }

    /// Returns the position of carried furniture: in front of the agent, or between the two agents.
    fn furniture_in_world(&self, agent: AgentId, object: EntityId) -> Vec3 {
        /// Height of its bottom, meters: hands hang at 0.75 (facts S16.1).
        const CARRY_HEIGHT_M: f32 = 0.45;
        let pose = self.person(agent).pose;
        let depth = self.object(object).0.size_m().z;
        let ahead = match self.state.joint.filter(|j| j.object == object && j.under_way) {
            Some(joint) => 0.5 * joint.follower_in_leader,
            None => Vec3::new(0.0, 0.0, -(0.3 + 0.5 * depth)),
        };
        pose.to_world(Vec3::new(ahead.x, CARRY_HEIGHT_M, ahead.z))
    }

    /// Returns the center of a vehicle's basket in the world, meters.
    pub(crate) fn basket_in_world(&self, vehicle: EntityId) -> Vec3 {
        let (spec, state) = self.object(vehicle);
        state.position + state.rotation * (Vec3::from(BASKET_IN_VEHICLE) * spec.size_m())
    }

    pub(crate) fn own_basket_in_world(&self, agent: AgentId) -> Vec3 {
        self.vehicle(agent).map_or(self.front_in_world(agent), |v| self.basket_in_world(v))
    }

    /// Returns the position of the bottom of an object in a container slot, in the world, meters.
    fn slot_in_world(&self, container: EntityId, slot: u8) -> Vec3 {
        let (spec, state) = self.object(container);
        let size = spec.size_m();
        // Three slots in a triangle that leaves the center free.
        let angle = std::f32::consts::TAU * f32::from(slot) / 3.0;
        let aside = forward(angle) * 0.22;
        if spec.class.info().role == Role::Vehicle {
            return self.basket_in_world(container) + state.rotation * (aside * 0.4);
        }
        let local = Vec3::new(aside.x * size.x, (0.12 * size.y).max(0.01), aside.z * size.z);
        state.position + state.rotation * local
    }

    /// Returns the nearest free spot for the bottom of an object on the highest top of a place. If
    /// the top is too small, the spot is on the ground beside it. Spots in `taken`, with their
    /// radii, are reserved.
    pub(crate) fn free_spot_on(
        &self,
        place: EntityId,
        object: EntityId,
        from: Vec3,
        taken: &[(Vec3, f32)],
    ) -> Vec3 {
        /// A top supports a wider object if it covers this fraction of the object's radius.
        const MIN_COVERED_FRACTION: f32 = 0.6;
        let (spec, state) = self.object(place);
        let yaw = chaic_core::geom::yaw_towards(Vec3::ZERO, state.rotation * Vec3::NEG_Z);
        let radius = self.object(object).0.half_longer_side_m();
        let surfaces = surfaces_at(spec, state.position, yaw);
        let highest = surfaces.iter().map(|s| s.center.y).fold(f32::NEG_INFINITY, f32::max);
        let mut spots = Vec::new();
        for s in surfaces.iter().filter(|s| s.center.y > highest - 0.01) {
            let [hx, hz] = s.half.map(|h| (h - radius).max(0.0));
            for x in steps(hx) {
                for z in steps(hz) {
                    spots.push(s.center + rotate_yaw(Vec3::new(x, 0.0, z), s.yaw_rad));
                }
            }
        }
        let is_too_small =
            surfaces.iter().all(|s| s.half[0].min(s.half[1]) < MIN_COVERED_FRACTION * radius);
        if is_too_small {
            let reach = spec.half_longer_side_m() + radius + 0.1;
            spots = ring(state.position, reach, 4).collect();
        }
        spots.sort_by(|a, b| {
            horizontal_distance(*a, from).total_cmp(&horizontal_distance(*b, from))
        });
        let is_unreserved = |spot: &Vec3| {
            taken.iter().all(|(t, r)| horizontal_distance(*t, *spot) > radius + r + CLEARANCE_M)
        };
        let free = |spot: &&Vec3| is_unreserved(spot) && self.is_free_for(object, **spot, radius);
        spots.iter().find(free).or(spots.first()).copied().unwrap_or(state.position)
    }

    /// Returns whether no other object lies at a spot for an object of this radius.
    pub(crate) fn is_free_for(&self, object: EntityId, spot: Vec3, radius: f32) -> bool {
        self.setup.entities().all(|e| {
            let (spec, state) = self.object(e);
            let is_movable_at_rest = state.is_resting() && !spec.fixed && e != object;
            !is_movable_at_rest
                || (state.position.y - spot.y).abs() > 0.3
                || horizontal_distance(state.position, spot)
                    > radius + spec.half_longer_side_m() + CLEARANCE_M
        })
    }

    /// Returns a free spot on the floor beside an agent.
    pub(crate) fn floor_spot_beside(&self, agent: AgentId, object: EntityId) -> Vec3 {
        let pose = self.person(agent).pose;
        let spec = self.object(object).0;
        let radius = spec.half_longer_side_m();
        let distance = self.capability(agent).radius_m + radius + 0.2;
        let back = -forward(pose.yaw_rad);
        let sides = [back, right(pose.yaw_rad), -right(pose.yaw_rad), forward(pose.yaw_rad)];
        let spots = sides.map(|side| pose.position + side * distance);
        let free = |spot: &&Vec3| self.is_floor_free(**spot, radius, spec.size_m().y);
        spots.iter().find(free).copied().unwrap_or(pose.position)
    }

    /// Returns whether an object can stand on the floor at a point.
    pub(crate) fn is_free_floor(&self, object: EntityId, at: Vec3) -> bool {
        let size = self.object(object).0.size_m();
        self.is_floor_free(at, 0.5 * math::hypot(size.x, size.z), size.y)
    }

    /// Returns whether an upright cylinder of this size can stand on the floor at `p`, inside the
    /// bounds and without touching obstacles or agents.
    fn is_floor_free(&self, p: Vec3, radius_m: f32, height_m: f32) -> bool {
        let body = Body { radius_m, low_m: MAX_RUG_HEIGHT_M, high_m: height_m };
        self.setup.bounds.expanded(-radius_m).contains(to_xz(p))
            && self.block_index.overlap(body, to_xz(p), &self.movable_blocks(), &self.discs())
                <= 0.0
    }

    /// Starts a joint fall of objects from their current positions.
    pub(crate) fn start_fall(&mut self, objects: &[EntityId]) {
        /// Maximum distance of objects that a fall from here can touch, meters.
        const NEAR_M: f32 = 1.5;
        let falling = objects.iter().map(|object| {
            let (spec, state) = self.object(*object);
            Falling {
                entity: *object,
                position: state.position,
                rotation: state.rotation,
                size: spec.size_m(),
                mass_kg: spec.class.info().mass_kg,
            }
        });
        let falling: Vec<Falling> = falling.collect();
        let is_near =
            |to: Vec3| falling.iter().any(|t| horizontal_distance(to, t.position) < NEAR_M);
        let has_near_point = |b: &&Block| {
            let mut nearest = falling.iter().map(|t| (t.position, b.nearest_in_plan(t.position).0));
            nearest.any(|(from, to)| horizontal_distance(from, to) < NEAR_M)
        };
        let mut around: Vec<Obstacle> =
            self.block_index.blocks().iter().filter(has_near_point).map(Obstacle::from).collect();
        for (i, (other, state)) in self.setup.things.iter().zip(&self.state.objects).enumerate() {
            let entity = Setup::entity(i);
            let near = is_near(state.position);
            let is_obstacle =
                state.is_resting() && !other.fixed && near && !objects.contains(&entity);
            if !is_obstacle {
                continue;
            }
            if other.class.info().is_carriable() {
                let half = 0.5 * other.size_m();
                let center = state.position + state.rotation * (Vec3::Y * half.y);
                around.push(Obstacle { center, half, rotation: state.rotation, entity });
            } else {
                around.extend(self.blocks_now(i).map(|b| Obstacle::from(&b)));
            }
        }
        let falls = fall::fall(&falling, &around, self.rules.fall_step_s);
        for (object, mut fall) in objects.iter().zip(falls) {
            fall.path.reverse();
            self.object_mut(*object).location =
                ObjectLocation::Falling { path: fall.path, on: fall.on };
        }
    }
}

/// Returns offsets from `-half` to `half` with [`SPOT_SPACING_M`] between them, in ascending order.
fn steps(half: f32) -> impl Iterator<Item = f32> {
    let n = (half / SPOT_SPACING_M) as i32;
    (-n..=n).map(|i| i as f32 * SPOT_SPACING_M)
}

/// Returns `n` points on a circle in plan.
fn ring(center: Vec3, radius_m: f32, n: u32) -> impl Iterator<Item = Vec3> {
    let ground = Vec3::new(center.x, 0.0, center.z);
    (0..n).map(move |i| ground + forward(std::f32::consts::TAU * i as f32 / n as f32) * radius_m)
}
