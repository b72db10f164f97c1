//! Whether everything that the task needs can be got at.

use chaic_core::capability::Persona;
use chaic_core::geom::xz;
use chaic_core::task::Arrangement;
use chaic_core::{AgentId, Role, Vec2};
use chaic_world::{Person, Rules, Setup, Thing};

use super::{Demand, Problem, thing_field};
use crate::free_space::{CELL_M, FreeSpace};
use crate::upright_box::UprightBox;

/// How [`out_of_reach`] and [`ways_from`] look for ways.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walker {
    /// Radius of the body, metres.
    pub radius_m: f32,
    /// How far it reaches beside itself, metres in plan, if no wall is between.
    pub reach_m: f32,
    /// Side of the cells over which it walks, metres; more than 0.
    pub cell_m: f32,
}

/// The things (by their places in [`Setup::things`]) that the task needs and that an agent finds no
/// way to, once everything that one hand can take out of the way is gone; all of them if it can't
/// move. Targets, containers, goal places and obstacles are needed.
pub fn out_of_reach(setup: &Setup, agent: AgentId, walker: Walker) -> Vec<usize> {
    let Some(person) = setup.people.get(agent.index()) else { return Vec::new() };
    let walls = UprightBox::of_walls(setup);
    let see_through: Vec<UprightBox> = walls.iter().filter(|w| w.low_m < 1.0).copied().collect();
    let (grid, seen) = ground(setup, person, &walls, walker, Obstacles::Gone);
    let mut missed = needed_things(setup);
    missed.retain(|k| !gets_at(&grid, &seen, walker.reach_m, &setup.things[*k], &see_through));
    missed
}

/// How far a grown-up walks from beside one thing to beside every other, metres, in the order of
/// [`Setup::things`], once everything that one hand can take out of the way is gone; infinite where
/// there is no way.
pub fn ways_from(setup: &Setup, thing: usize, walker: Walker) -> Vec<f32> {
    let walls = UprightBox::of_walls(setup);
    let see_through: Vec<UprightBox> = walls.iter().filter(|w| w.low_m < 1.0).copied().collect();
    let height_m = Persona::Adult.capability().height_m;
    let grid = walkable(setup, height_m, &walls, walker, Obstacles::Gone);
    let beside = |k: usize| beside(&grid, walker.reach_m, &setup.things[k], &see_through);
    let way_m = grid.ways(beside(thing).into_iter());
    (0..setup.things.len())
        .map(|k| beside(k).into_iter().map(|i| way_m[i]).fold(f32::INFINITY, f32::min))
        .collect()
}

pub(super) fn problems(setup: &Setup, demand: Demand) -> Vec<Problem> {
    let walls = UprightBox::of_walls(setup);
    let needed = needed_things(setup);
    let mut found = Vec::new();
    let agents: &[AgentId] = match demand {
        Demand::Fair => &[AgentId::PARTNER, AgentId::HELPER],
        // A wheelchair may be too wide for a house; then the helper does what there is to do.
        Demand::Playable => &[AgentId::HELPER],
    };
    for agent in agents.iter().copied() {
        let person = &setup.people[agent.index()];
        let reach_m = Rules::paper().arm_reach_m;
        let walker = Walker { radius_m: person.capability().radius_m, reach_m, cell_m: CELL_M };
        let (grid, seen) = ground(setup, person, &walls, walker, Obstacles::Gone);
        if !seen.contains(&true) {
            let field = format!("people[{}].pose.position", agent.index());
            found.push(Problem::new(field, format!("leaves the {agent} no room to move")));
            continue;
        }
        let see_through: Vec<UprightBox> =
            walls.iter().filter(|w| w.low_m < 1.0).copied().collect();
        // Something to bring and somewhere to bring it; which of it is enough to play.
        let mut got_at = [false; 2];
        let mut missed = Vec::new();
        for k in &needed {
            if gets_at(&grid, &seen, reach_m, &setup.things[*k], &see_through) {
                let is_goal = setup.goal_places.contains(&Setup::entity(*k));
                let is_target = setup.goal.wanted(setup.things[*k].class) > 0;
                got_at = [got_at[0] || is_target, got_at[1] || is_goal];
            } else {
                let problem = format!(
                    "is out of reach: the {agent} finds no way to within {reach_m} m of it"
                );
                missed.push(Problem::new(thing_field(setup, *k, "position"), problem));
            }
        }
        if demand == Demand::Fair || got_at != [true; 2] {
            found.extend(missed);
        }
    }
    if demand == Demand::Fair && found.is_empty() {
        found.extend(obstacle_problem(setup, &walls));
    }
    found
}

/// Obstacles keep the partner from something where the task is about them, and nowhere else.
fn obstacle_problem(setup: &Setup, walls: &[UprightBox]) -> Option<Problem> {
    let is_obstacle = |k: &usize| setup.things[*k].class.info().role == Role::Obstacle;
    (0..setup.things.len()).find(is_obstacle)?;
    let person = setup.people.first()?;
    let reach_m = Rules::paper().arm_reach_m;
    let walker = Walker { radius_m: person.capability().radius_m, reach_m, cell_m: CELL_M };
    let (grid, seen) = ground(setup, person, walls, walker, Obstacles::There);
    let see_through: Vec<UprightBox> = walls.iter().filter(|w| w.low_m < 1.0).copied().collect();
    let needed = needed_things(setup).into_iter().filter(|k| !is_obstacle(k));
    let mut missed =
        needed.filter(|k| !gets_at(&grid, &seen, reach_m, &setup.things[*k], &see_through));
    match (setup.task.info().arrangement == Arrangement::Obstacles, missed.next()) {
        (true, None) => {
            let problem = "hold no obstacle that keeps the partner from anything";
            Some(Problem::new("things", problem))
        }
        (false, Some(k)) => {
            let problem = "is cut off from the partner by obstacles, which aren't the task's";
            Some(Problem::new(thing_field(setup, k, "position"), problem))
        }
        _ => None,
    }
}

/// Whether obstacles stand where the setup puts them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Obstacles {
    There,
    Gone,
}

/// Targets, containers, goal places and obstacles.
fn needed_things(setup: &Setup) -> Vec<usize> {
    let is_needed = |k: &usize| {
        let thing = &setup.things[*k];
        let role = thing.class.info().role;
        let is_target = setup.goal.wanted(thing.class) > 0;
        let is_goal = setup.goal_places.contains(&Setup::entity(*k));
        let is_tool = matches!(role, Role::Container | Role::Obstacle);
        is_goal || (!thing.fixed && (is_target || is_tool))
    };
    (0..setup.things.len()).filter(is_needed).collect()
}

/// Where a person gets to once everything that one hand can take out of the way is gone, but maybe
/// for obstacles.
fn ground(
    setup: &Setup,
    person: &Person,
    walls: &[UprightBox],
    walker: Walker,
    obstacles: Obstacles,
) -> (FreeSpace, Vec<bool>) {
    let grid = walkable(setup, person.capability().height_m, walls, walker, obstacles);
    let seen = grid.flood(xz(person.pose.position));
    (grid, seen)
}

/// Where there is room for somebody of this height, in the same sense.
fn walkable(
    setup: &Setup,
    height_m: f32,
    walls: &[UprightBox],
    walker: Walker,
    obstacles: Obstacles,
) -> FreeSpace {
    let stands = [Rules::paper().step_over_m, height_m];
    let stays = setup.things.iter().filter(|t| {
        let info = t.class.info();
        let is_gone = info.role == Role::Obstacle && obstacles == Obstacles::Gone;
        t.fixed || !(info.is_carriable() || is_gone)
    });
    let stays =
        stays.filter(|t| t.class.info().role != Role::Vehicle).flat_map(UprightBox::of_thing);
    let solids: Vec<UprightBox> =
        stays.chain(walls.iter().copied()).filter(|s| s.spans(stands)).collect();
    FreeSpace::fine(setup.bounds, walker.cell_m, walker.radius_m, &solids)
}

fn gets_at(
    grid: &FreeSpace,
    seen: &[bool],
    reach_m: f32,
    thing: &Thing,
    walls: &[UprightBox],
) -> bool {
    beside(grid, reach_m, thing, walls).into_iter().any(|i| seen[i])
}

/// The free cells from which a thing is within reach, and no wall between.
fn beside(grid: &FreeSpace, reach_m: f32, thing: &Thing, walls: &[UprightBox]) -> Vec<usize> {
    let parts = UprightBox::of_thing(thing);
    let is_beside = |part: &UprightBox, i: &usize| {
        let from = grid.middle(*i);
        part.distance(from) <= reach_m && sees(from, part.nearest(from), walls)
    };
    let near =
        |part: &UprightBox| grid.cells_in(part.bounds().grown(reach_m)).filter(|i| grid.free[*i]);
    parts.iter().flat_map(|part| near(part).filter(|i| is_beside(part, i))).collect()
}

fn sees(from: Vec2, to: Vec2, walls: &[UprightBox]) -> bool {
    !walls.iter().any(|w| w.cuts(from, to))
}
