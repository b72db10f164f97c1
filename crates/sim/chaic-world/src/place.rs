//! Where things go: hands, baskets, free spots, and the start of a fall.

use chaic_core::action::Hand;
use chaic_core::catalogue::Role;
use chaic_core::geom::{forward, horizontal_distance, math, right, rotate_yaw, xz, yaw_rotation};
use chaic_core::{AgentId, EntityId, Vec3};

use crate::collide::Body;
use crate::fall::{self, Falling, Obstacle};
use crate::setup::Setup;
use crate::shape::{Block, surfaces_at};
use crate::state::Place;
use crate::world::World;

/// Spacing of the spots that are tried, metres.
const SPOT_SPACING_M: f32 = 0.12;
/// Clear space around a thing on a surface, metres.
const CLEARANCE_M: f32 = 0.02;
/// What is no higher than this is stood upon, metres: rugs.
const RUG_M: f32 = 0.03;
/// Middle of a bicycle's basket in the bicycle's frame, as a fraction of its size; the front
/// faces -z.
const BASKET_IN_VEHICLE: [f32; 3] = [0.0, 0.78, -0.36];
/// Where a vehicle is in its rider's frame, metres: at the left hand.
const VEHICLE_IN_RIDER: Vec3 = Vec3::new(-0.45, 0.0, -0.1);

impl World {
    /// Puts everything that is held or stowed to where its holder's hands are.
    pub(crate) fn carry_along(&mut self) {
        if let Some(joint) = self.state.joint.filter(|j| j.under_way) {
            let leader = self.person(joint.leader).pose;
            // Where turns aren't checked, the follower would be swung out of the place.
            let (at, bounds) = (leader.to_world(joint.follower_in_leader), self.setup.bounds);
            let inside = xz(at).clamp(bounds.min, bounds.max);
            self.person_mut(joint.follower).pose.position = Vec3::new(inside.x, at.y, inside.y);
            self.face(joint.follower, leader.position);
        }
        for agent in self.setup.agents() {
            for hand in Hand::BOTH {
                let Some(object) = self.person(agent).hands[hand.index()] else { continue };
                self.carry_in_hand(agent, hand, object);
            }
        }
        for i in 0..self.state.things.len() {
            if let Place::Inside { container, slot } = self.state.things[i].place {
                let at = self.slot_in_world(container, slot);
                let rotation = self.thing(container).1.rotation;
                self.state.things[i].position = at;
                self.state.things[i].rotation = rotation;
            }
        }
    }

    fn carry_in_hand(&mut self, agent: AgentId, hand: Hand, object: EntityId) {
        let pose = self.person(agent).pose;
        let (thing, _) = self.thing(object);
        let size = thing.size_m();
        let position = match thing.class.info().role {
            Role::Vehicle => pose.to_world(VEHICLE_IN_RIDER),
            Role::HeavyTarget => self.furniture_in_world(agent, object),
            _ => self.hand_in_world(agent, hand) - Vec3::Y * 0.5 * size.y,
        };
        let thing = self.thing_mut(object);
        thing.position = position;
        thing.rotation = yaw_rotation(pose.yaw_rad);
    }

    /// Where furniture is carried: before the body, or between two.
    fn furniture_in_world(&self, agent: AgentId, object: EntityId) -> Vec3 {
        /// How high its bottom is carried, metres: hands hang at 0.75 (facts S16.1).
        const CARRY_HEIGHT_M: f32 = 0.45;
        let pose = self.person(agent).pose;
        let depth = self.thing(object).0.size_m().z;
        let ahead = match self.state.joint.filter(|j| j.object == object && j.under_way) {
            Some(joint) => 0.5 * joint.follower_in_leader,
            None => Vec3::new(0.0, 0.0, -(0.3 + 0.5 * depth)),
        };
        pose.to_world(Vec3::new(ahead.x, CARRY_HEIGHT_M, ahead.z))
    }

    /// Middle of a vehicle's basket, in the world, metres.
    pub(crate) fn basket_in_world(&self, vehicle: EntityId) -> Vec3 {
        let (thing, state) = self.thing(vehicle);
        state.position + state.rotation * (Vec3::from(BASKET_IN_VEHICLE) * thing.size_m())
    }

    pub(crate) fn basket_of(&self, agent: AgentId) -> Vec3 {
        self.vehicle(agent).map_or(self.front_of(agent), |v| self.basket_in_world(v))
    }

    /// Where the bottom of the thing in this slot of a container is, in the world, metres.
    fn slot_in_world(&self, container: EntityId, slot: u8) -> Vec3 {
        let (thing, state) = self.thing(container);
        let size = thing.size_m();
        // Three in a triangle that leaves the middle free.
        let angle = std::f32::consts::TAU * f32::from(slot) / 3.0;
        let aside = forward(angle) * 0.22;
        if thing.class.info().role == Role::Vehicle {
            return self.basket_in_world(container) + state.rotation * (aside * 0.4);
        }
        let local = Vec3::new(aside.x * size.x, (0.12 * size.y).max(0.01), aside.z * size.z);
        state.position + state.rotation * local
    }

    /// The points of a place where something could be put, best first, and the best free one:
    /// on its highest top, else on the ground beside it. Returns where the bottom goes.
    /// `taken` are spots, with radii, that are about to be.
    pub(crate) fn free_spot_on(
        &self,
        place: EntityId,
        object: EntityId,
        from: Vec3,
        taken: &[(Vec3, f32)],
    ) -> Vec3 {
        /// A top carries what is wider than itself, if this part of its radius lies on it.
        const ON_TOP: f32 = 0.6;
        let (thing, state) = self.thing(place);
        let yaw = chaic_core::geom::yaw_towards(Vec3::ZERO, state.rotation * Vec3::NEG_Z);
        let radius = self.thing(object).0.half_longer_side_m();
        let surfaces = surfaces_at(thing, state.position, yaw);
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
        let too_small = surfaces.iter().all(|s| s.half[0].min(s.half[1]) < ON_TOP * radius);
        if too_small {
            let reach = thing.half_longer_side_m() + radius + 0.1;
            spots = ring(state.position, reach, 4).collect();
        }
        spots.sort_by(|a, b| {
            horizontal_distance(*a, from).total_cmp(&horizontal_distance(*b, from))
        });
        let apart = |spot: &Vec3| {
            taken.iter().all(|(t, r)| horizontal_distance(*t, *spot) > radius + r + CLEARANCE_M)
        };
        let free = |spot: &&Vec3| apart(spot) && self.is_free_for(object, **spot, radius);
        spots.iter().find(free).or(spots.first()).copied().unwrap_or(state.position)
    }

    /// Whether nothing else lies where a thing of this radius would be put.
    pub(crate) fn is_free_for(&self, object: EntityId, spot: Vec3, radius: f32) -> bool {
        self.setup.entities().all(|e| {
            let (thing, state) = self.thing(e);
            let lies_there = state.is_resting() && !thing.fixed && e != object;
            !lies_there
                || (state.position.y - spot.y).abs() > 0.3
                || horizontal_distance(state.position, spot)
                    > radius + thing.half_longer_side_m() + CLEARANCE_M
        })
    }

    /// A free spot on the floor beside a person.
    pub(crate) fn floor_spot_beside(&self, agent: AgentId, object: EntityId) -> Vec3 {
        let pose = self.person(agent).pose;
        let thing = self.thing(object).0;
        let radius = thing.half_longer_side_m();
        let distance = self.capability(agent).radius_m + radius + 0.2;
        let back = -forward(pose.yaw_rad);
        let sides = [back, right(pose.yaw_rad), -right(pose.yaw_rad), forward(pose.yaw_rad)];
        let spots = sides.map(|side| pose.position + side * distance);
        let free = |spot: &&Vec3| self.stands_free(**spot, radius, thing.size_m().y);
        spots.iter().find(free).copied().unwrap_or(pose.position)
    }

    /// Whether a thing can stand on the floor at a point.
    pub(crate) fn is_free_floor(&self, object: EntityId, at: Vec3) -> bool {
        let size = self.thing(object).0.size_m();
        self.stands_free(at, 0.5 * math::hypot(size.x, size.z), size.y)
    }

    /// Whether an upright thing of this radius and height can stand on the floor at `p`, within
    /// bounds and clear of everything and everybody.
    fn stands_free(&self, p: Vec3, radius_m: f32, height_m: f32) -> bool {
        let body = Body { radius_m, low_m: RUG_M, high_m: height_m };
        self.setup.bounds.grown(-radius_m).contains(xz(p))
            && self.block_index.overlap(body, xz(p), &self.movable_blocks(), &self.discs()) <= 0.0
    }

    /// Lets things go where they are, at the same time.
    pub(crate) fn start_fall(&mut self, objects: &[EntityId]) {
        /// Things farther away can't be touched by what falls here, metres.
        const NEAR_M: f32 = 1.5;
        let falling = objects.iter().map(|object| {
            let (thing, state) = self.thing(*object);
            Falling {
                entity: *object,
                position: state.position,
                rotation: state.rotation,
                size: thing.size_m(),
                mass_kg: thing.class.info().mass_kg,
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
        for (i, (other, state)) in self.setup.things.iter().zip(&self.state.things).enumerate() {
            let entity = Setup::entity(i);
            let near = is_near(state.position);
            let lies = state.is_resting() && !other.fixed && near && !objects.contains(&entity);
            if !lies {
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
            self.thing_mut(*object).place = Place::Falling { path: fall.path, on: fall.on };
        }
    }
}

/// Symmetric steps of [`SPOT_SPACING_M`] within [-half, half], middle first.
fn steps(half: f32) -> impl Iterator<Item = f32> {
    let n = (half / SPOT_SPACING_M) as i32;
    (-n..=n).map(|i| i as f32 * SPOT_SPACING_M)
}

/// `n` points on a circle in plan.
fn ring(center: Vec3, radius_m: f32, n: u32) -> impl Iterator<Item = Vec3> {
    let ground = Vec3::new(center.x, 0.0, center.z);
    (0..n).map(move |i| ground + forward(std::f32::consts::TAU * i as f32 / n as f32) * radius_m)
}
