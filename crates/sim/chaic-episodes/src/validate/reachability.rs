//! Checks that the objects which the task needs are reachable.

use chaic_core::capability::Persona;
use chaic_core::geom::to_xz;
use chaic_core::task::Arrangement;
use chaic_core::{AgentId, Role, Vec2};
use chaic_world::{AgentSpec, ObjectSpec, Rules, Setup};

use super::{Problem, Strictness, object_field};
use crate::free_space::{CELL_M, FreeSpace};
use crate::upright_box::UprightBox;

/// Parameters of the search of [`unreachable_objects`] and [`path_lengths_from`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReachabilityParams {
    /// Radius of the body, meters.
    pub radius_m: f32,
    /// Reach beside the body, meters in plan, if no wall is in between.
    pub reach_m: f32,
    /// Side of the grid cells, meters; more than 0.
    pub cell_m: f32,
}

/// Returns the indices in [`Setup::things`] of required objects that an agent cannot reach after
/// removal of everything that one hand can move. Returns all of them if the agent cannot move.
/// Targets, containers, goal places and obstacles are required.
pub fn unreachable_objects(
    setup: &Setup,
    agent: AgentId,
    params: ReachabilityParams,
) -> Vec<usize> {
    let Some(person) = setup.people.get(agent.index()) else { return Vec::new() };
    let walls = UprightBox::from_walls(setup);
    let blocking_walls: Vec<UprightBox> = walls.iter().filter(|w| w.low_m < 1.0).copied().collect();
    let (grid, reached) = reachable_cells(setup, person, &walls, params, Obstacles::Removed);
    let mut unreachable = required_objects(setup);
    unreachable.retain(|k| {
        !is_reachable(&grid, &reached, params.reach_m, &setup.things[*k], &blocking_walls)
    });
    unreachable
}

/// Returns the path length of an adult from beside one object to beside every other, meters, in the
/// order of [`Setup::things`]. Everything that one hand can move is removed first. The length is
/// infinite where there is no path.
pub fn path_lengths_from(setup: &Setup, object: usize, params: ReachabilityParams) -> Vec<f32> {
    let walls = UprightBox::from_walls(setup);
    let blocking_walls: Vec<UprightBox> = walls.iter().filter(|w| w.low_m < 1.0).copied().collect();
    let height_m = Persona::Adult.capability().height_m;
    let grid = walkable(setup, height_m, &walls, params, Obstacles::Removed);
    let cells_beside =
        |k: usize| cells_beside(&grid, params.reach_m, &setup.things[k], &blocking_walls);
    let length_m = grid.path_lengths(cells_beside(object).into_iter());
    (0..setup.things.len())
        .map(|k| cells_beside(k).into_iter().map(|i| length_m[i]).fold(f32::INFINITY, f32::min))
        .collect()
}

pub(super) fn problems(setup: &Setup, strictness: Strictness) -> Vec<Problem> {
    let walls = UprightBox::from_walls(setup);
    let required = required_objects(setup);
    let mut found = Vec::new();
    let agents: &[AgentId] = match strictness {
        Strictness::Generated => &[AgentId::PARTNER, AgentId::HELPER],
        // A wheelchair may be too wide for a house; then the helper does all the work.
        Strictness::Playable => &[AgentId::HELPER],
    };
    for agent in agents.iter().copied() {
        let person = &setup.people[agent.index()];
        let reach_m = Rules::paper().arm_reach_m;
        let params =
            ReachabilityParams { radius_m: person.capability().radius_m, reach_m, cell_m: CELL_M };
        let (grid, reached) = reachable_cells(setup, person, &walls, params, Obstacles::Removed);
        if !reached.contains(&true) {
            let field = format!("people[{}].pose.position", agent.index());
            found.push(Problem::new(field, format!("leaves no room for the {agent} to move")));
            continue;
        }
        let blocking_walls: Vec<UprightBox> =
            walls.iter().filter(|w| w.low_m < 1.0).copied().collect();
        // At least one target and one goal place must be reachable to play.
        let mut has_required = [false; 2];
        let mut unreachable = Vec::new();
        for k in &required {
            if is_reachable(&grid, &reached, reach_m, &setup.things[*k], &blocking_walls) {
                let is_goal = setup.goal_places.contains(&Setup::entity(*k));
                let is_target = setup.goal.count(setup.things[*k].class) > 0;
                has_required = [has_required[0] || is_target, has_required[1] || is_goal];
            } else {
                let problem =
                    format!("is out of reach: the {agent} cannot get within {reach_m} m of it");
                unreachable.push(Problem::new(object_field(setup, *k, "position"), problem));
            }
        }
        if strictness == Strictness::Generated || has_required != [true; 2] {
            found.extend(unreachable);
        }
    }
    if strictness == Strictness::Generated && found.is_empty() {
        found.extend(obstacle_problem(setup, &walls));
    }
    found
}

/// Checks that obstacles block the partner in the obstacle task, and in no other.
fn obstacle_problem(setup: &Setup, walls: &[UprightBox]) -> Option<Problem> {
    let is_obstacle = |k: &usize| setup.things[*k].class.info().role == Role::Obstacle;
    (0..setup.things.len()).find(is_obstacle)?;
    let person = setup.people.first()?;
    let reach_m = Rules::paper().arm_reach_m;
    let params =
        ReachabilityParams { radius_m: person.capability().radius_m, reach_m, cell_m: CELL_M };
    let (grid, reached) = reachable_cells(setup, person, walls, params, Obstacles::Present);
    let blocking_walls: Vec<UprightBox> = walls.iter().filter(|w| w.low_m < 1.0).copied().collect();
    let required = required_objects(setup).into_iter().filter(|k| !is_obstacle(k));
    let mut unreachable = required
        .filter(|k| !is_reachable(&grid, &reached, reach_m, &setup.things[*k], &blocking_walls));
    match (setup.task.info().arrangement == Arrangement::Obstacles, unreachable.next()) {
        (true, None) => {
            let problem = "hold no obstacle that blocks the partner";
            Some(Problem::new("things", problem))
        }
        (false, Some(k)) => {
            let problem =
                "is cut off from the partner by obstacles, but this is not the obstacle task";
            Some(Problem::new(object_field(setup, k, "position"), problem))
        }
        _ => None,
    }
}

/// Placement of obstacles during the search: as in the setup, or removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Obstacles {
    Present,
    Removed,
}

/// Returns the indices of targets, containers, goal places and obstacles.
fn required_objects(setup: &Setup) -> Vec<usize> {
    let is_needed = |k: &usize| {
        let object = &setup.things[*k];
        let role = object.class.info().role;
        let is_target = setup.goal.count(object.class) > 0;
        let is_goal = setup.goal_places.contains(&Setup::entity(*k));
        let is_tool = matches!(role, Role::Container | Role::Obstacle);
        is_goal || (!object.fixed && (is_target || is_tool))
    };
    (0..setup.things.len()).filter(is_needed).collect()
}

/// Returns the cells that a person reaches after removal of everything that one hand can move;
/// obstacles may stay.
fn reachable_cells(
    setup: &Setup,
    person: &AgentSpec,
    walls: &[UprightBox],
    params: ReachabilityParams,
    obstacles: Obstacles,
) -> (FreeSpace, Vec<bool>) {
    let grid = walkable(setup, person.capability().height_m, walls, params, obstacles);
    let reached = grid.flood(to_xz(person.pose.position));
    (grid, reached)
}

/// Returns the cells with space for a person of this height, under the same conditions.
fn walkable(
    setup: &Setup,
    height_m: f32,
    walls: &[UprightBox],
    params: ReachabilityParams,
    obstacles: Obstacles,
) -> FreeSpace {
    let stands = [Rules::paper().step_over_m, height_m];
    let stays = setup.things.iter().filter(|t| {
        let info = t.class.info();
        let is_out_of_play = info.role == Role::Obstacle && obstacles == Obstacles::Removed;
        t.fixed || !(info.is_carriable() || is_out_of_play)
    });
    let stays =
        stays.filter(|t| t.class.info().role != Role::Vehicle).flat_map(UprightBox::from_object);
    let solids: Vec<UprightBox> =
        stays.chain(walls.iter().copied()).filter(|s| s.spans(stands)).collect();
    FreeSpace::around_with_cell_size(setup.bounds, params.cell_m, params.radius_m, &solids)
}

fn is_reachable(
    grid: &FreeSpace,
    reached: &[bool],
    reach_m: f32,
    object: &ObjectSpec,
    walls: &[UprightBox],
) -> bool {
    let is_beside = |part: &UprightBox| {
        cells_beside_part(grid, reach_m, part, walls, |i| reached[i]).next().is_some()
    };
    UprightBox::from_object(object).iter().any(is_beside)
}

/// Returns the free cells from which an object is within reach without a wall in between.
fn cells_beside(
    grid: &FreeSpace,
    reach_m: f32,
    object: &ObjectSpec,
    walls: &[UprightBox],
) -> Vec<usize> {
    let parts = UprightBox::from_object(object);
    parts
        .iter()
        .flat_map(move |part| cells_beside_part(grid, reach_m, part, walls, move |i| grid.free[i]))
        .collect()
}

/// Returns the cells with `is_candidate` from which a part of an object is within reach without a wall
/// in between.
///
/// Walls are searched last, and only those near the part: files may have thousands of large objects
/// and of walls.
fn cells_beside_part(
    grid: &FreeSpace,
    reach_m: f32,
    part: &UprightBox,
    walls: &[UprightBox],
    is_candidate: impl Fn(usize) -> bool,
) -> impl Iterator<Item = usize> {
    // A line of sight to the part stays in this area, apart from rounding.
    let area = part.bounds().expanded(reach_m);
    let with_margin = area.expanded(CELL_M);
    let near_walls: Vec<UprightBox> =
        walls.iter().filter(|w| w.bounds().overlaps(&with_margin)).copied().collect();
    grid.cells_in(area).filter(move |i| {
        let from = grid.middle(*i);
        is_candidate(*i)
            && part.distance(from) <= reach_m
            && is_visible(from, part.nearest(from), &near_walls)
    })
}

fn is_visible(from: Vec2, to: Vec2, walls: &[UprightBox]) -> bool {
    !walls.iter().any(|w| w.cuts(from, to))
}
