//! Granted state of the world: objects, goal places and static geometry.

use chaic_core::briefing::{Layout, LayoutBlock};
use chaic_core::geom::{Rect, rotate_yaw, to_xz, yaw_towards};
use chaic_core::observation::{ObjectState, WorldState};
use chaic_core::{EntityId, Vec2, Vec3};

use crate::setup::Opening;
use crate::shape::Block;
use crate::state::ObjectLocation;
use crate::world::World;

/// Extent of a doorway's floor around the line between its jambs, meters. It covers walls of twice
/// this thickness.
const DOORWAY_M: f32 = 0.3;

impl World {
    /// Returns the state of all objects that matter for the tasks of this kind of scene.
    pub(crate) fn world_state(&self) -> WorldState {
        let goal_classes = self.setup.task.info().scene.goal_places();
        let is_listed = |e: &EntityId| {
            let spec = self.object(*e).0;
            goal_classes.contains(&spec.class)
                || (!spec.fixed && spec.class.info().is_movable())
                || self.setup.goal_places.contains(e)
        };
        let listed = self.setup.entities().filter(is_listed);
        let mut goal_places = self.setup.goal_places.clone();
        goal_places.sort_unstable();
        WorldState { objects: listed.map(|e| self.object_state(e)).collect(), goal_places }
    }

    fn object_state(&self, entity: EntityId) -> ObjectState {
        let (spec, state) = self.object(entity);
        let half = 0.5 * spec.size_m();
        let center = state.position + state.rotation * (Vec3::Y * half.y);
        let top_m = self.top_height_m(entity);
        let yaw_rad = yaw_towards(Vec3::ZERO, state.rotation * Vec3::NEG_Z);
        let is_carriable = spec.class.info().is_carriable();
        ObjectState {
            entity,
            class: spec.class,
            position_in_world: center,
            bottom_m: 2.0 * center.y - top_m,
            top_m,
            footprint: match is_carriable {
                true => Vec::new(),
                false => outline(to_xz(center), Vec2::new(half.x, half.z), yaw_rad),
            },
            holder: self.object(self.outermost(entity)).1.holder(),
            container: match state.location {
                ObjectLocation::Inside { container, .. } => Some(container),
                _ => None,
            },
            is_gone: state.delivered.is_some() || state.location == ObjectLocation::Broken,
        }
    }

    /// Returns the floors and the fixed boxes that block bodies.
    pub(crate) fn layout(&self) -> Layout {
        let is_house = self.setup.ceiling_m.is_some() && !self.setup.rooms.is_empty();
        let floors = if is_house {
            let rooms = self.setup.rooms.iter().map(|room| room.rect);
            rooms.chain(self.setup.openings.iter().map(doorway)).collect()
        } else {
            vec![self.setup.bounds]
        };
        Layout { floors, blocks: self.block_index.blocks().iter().map(layout_block).collect() }
    }
}

fn layout_block(block: &Block) -> LayoutBlock {
    LayoutBlock {
        center_xz: to_xz(block.center),
        half_xz: to_xz(block.half),
        yaw_rad: block.yaw_rad,
        y_range_m: block.y_range(),
    }
}

/// Returns the floor between two rooms, which do not cover it if the wall has a thickness.
fn doorway(opening: &Opening) -> Rect {
    Rect { min: opening.a.min(opening.b), max: opening.a.max(opening.b) }.expanded(DOORWAY_M)
}

/// Returns the corners of a rectangle and equally spaced points on its edges, in the order along
/// the outline.
fn outline(center: Vec2, half: Vec2, yaw_rad: f32) -> Vec<Vec2> {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(x, z)| center + to_xz(rotate_yaw(Vec3::new(x * half.x, 0.0, z * half.y), yaw_rad)));
    let edges = (0..4).map(|k| (corners[k], corners[(k + 1) % 4]));
    edges
        .flat_map(|(a, b)| {
            let n = (a.distance(b) / ObjectState::OUTLINE_SPACING_M).ceil().max(1.0) as u32;
            (0..n).map(move |k| a.lerp(b, k as f32 / n as f32))
        })
        .collect()
}
