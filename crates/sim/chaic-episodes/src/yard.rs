//! The yard of a house that somebody moves out of: five pieces of furniture and a truck (facts
//! S9.2 and S12.4, mirrored in z).

use std::f32::consts::{FRAC_PI_2, PI};

use chaic_core::briefing::Goal;
use chaic_core::capability::Persona;
use chaic_core::catalogue::TargetSet;
use chaic_core::geom::{Pose, Rect, xz};
use chaic_core::rng::Stream;
use chaic_core::{ClassId, TaskId, Vec2, Vec3};
use chaic_world::{Person, Setup, Thing};

use crate::Settings;
use crate::generate::{FIRST_BUNDLED_SEED, GenerateError, Seeds, first_valid};
use crate::outdoors::{self, OutdoorParts, Scenery, ground, heading, is_clear};
use crate::upright_box::{mm, plan_bounds};

/// Version of this generator; goes up with every change of what it makes.
pub const VERSION: u32 = 1;

const ATTEMPTS: u64 = 400;
/// Attempts in one place before another is tried.
const PLACE_ATTEMPTS: u64 = 100;
/// The part of the street that the original's maps cover.
const BOUNDS: Rect = Rect { min: Vec2::new(-5.0, -7.5), max: Vec2::new(19.0, 6.0) };
const ROAD_Z: [f32; 2] = [-3.2, 2.2];
const PAVEMENT_Z: [f32; 2] = [-4.6, 3.4];
/// Where furniture and people are at the start.
const PLACES: Rect = Rect { min: Vec2::new(-1.5, -2.75), max: Vec2::new(5.5, 1.25) };
const TRUCK: [f32; 2] = [14.0, 0.0];
/// How far the truck may stand from the paper's place along and across the road, metres: still about
/// 10 m from the furniture (paper), and on the road.
const TRUCK_SHIFT_M: [f32; 2] = [1.5, 0.9];
const N_PIECES: usize = 5;
/// From a piece's middle to the others, metres (facts S9.2).
const PIECE_CLEAR_M: f32 = 1.25;
/// From a piece's outline to the others', metres: two pass with a third between them.
const OUTLINE_CLEAR_M: f32 = 0.5;
/// From people to furniture, metres: a cell of 0.25 and the body.
const PERSON_CLEAR_M: f32 = 0.45;
const PEOPLE_APART_M: f32 = 0.9;
const TRIES: usize = 200;

/// The line-ups of the original's twelve episodes, the same in train and test (facts S12.4).
const LINE_UPS: [[&str; N_PIECES]; 12] = [
    ["microwave", "sofa", "table", "navy_chair", "navy_chair"],
    ["wood_shelving", "piano", "backpack", "backpack", "drawer"],
    ["dishwasher", "printer", "kettle", "kettle", "television"],
    ["sofa", "navy_chair", "wood_shelving", "microwave", "dishwasher"],
    ["navy_chair", "navy_chair", "backpack", "backpack", "drawer"],
    ["printer", "table", "television", "piano", "microwave"],
    ["sofa", "dishwasher", "wood_shelving", "wood_shelving", "drawer"],
    ["sofa", "piano", "kettle", "television", "navy_chair"],
    ["microwave", "navy_chair", "television", "table", "backpack"],
    ["backpack", "printer", "wood_shelving", "microwave", "drawer"],
    ["printer", "kettle", "kettle", "wood_shelving", "dishwasher"],
    ["sofa", "navy_chair", "backpack", "table", "drawer"],
];

/// A moving-house episode of these seeds.
///
/// # Errors
/// [`GenerateError`] if no attempt led to a valid setup.
pub fn generate(task: TaskId, seeds: Seeds, settings: Settings) -> Result<Setup, GenerateError> {
    let line_up = line_up(seeds.episode, settings);
    first_valid(task, seeds, ATTEMPTS, |attempt| setup(task, seeds, settings, &line_up, attempt))
}

/// The original's line-up for a bundled episode, a random one for any other.
fn line_up(seed: u64, settings: Settings) -> Vec<ClassId> {
    if seed >= FIRST_BUNDLED_SEED && !settings.varied_layout {
        return LINE_UPS[(seed % 12) as usize].map(ClassId::named).to_vec();
    }
    let is_furniture = |c: &ClassId| c.info().sets.contains(&TargetSet::Furniture);
    let all: Vec<ClassId> = ClassId::all().filter(is_furniture).collect();
    let mut rng = Stream::new(seed, "moving_house/line-up", 0);
    (0..N_PIECES).map(|_| all[rng.below(all.len())]).collect()
}

fn setup(
    task: TaskId,
    seeds: Seeds,
    settings: Settings,
    line_up: &[ClassId],
    attempt: u64,
) -> Result<Setup, &'static str> {
    let stream = |purpose: &str| Stream::new(seeds.episode, purpose, attempt);
    let mut pieces = pieces(line_up, &mut stream("moving_house/pieces"))?;
    let mut people = people(task, &pieces, &mut stream("moving_house/people"))?;
    // The place stays the same for many attempts, so that episodes share it.
    let scenery_rng = &mut Stream::new(seeds.place, "yard/scenery", attempt / PLACE_ATTEMPTS);
    let floors = ground(BOUNDS, ROAD_Z, PAVEMENT_Z, scenery_rng);
    let keep_clear = Rect::new([-4.0, ROAD_Z[0]], [18.0, ROAD_Z[1]]);
    let mut scenery = Scenery::new(vec![keep_clear]);
    // The cab looks along +x, the open rear towards the furniture.
    let layout_rng = &mut Stream::new(seeds.place, "yard/layout", attempt / PLACE_ATTEMPTS);
    let (mut shift, mut is_mirrored) = ([0.0; 2], false);
    if settings.varied_layout {
        shift = TRUCK_SHIFT_M.map(|m| layout_rng.range(-m, m));
        is_mirrored = layout_rng.chance(0.5);
    }
    let at = [TRUCK[0] + shift[0], TRUCK[1] + shift[1]];
    let truck = scenery.put("truck", at, -FRAC_PI_2, 0);
    surroundings(&mut scenery, scenery_rng);

    let mut things = scenery.things;
    if is_mirrored {
        outdoors::mirror(&mut things, &mut [], BOUNDS.center().x);
        outdoors::mirror(&mut pieces, &mut people, BOUNDS.center().x);
    }
    things.extend(pieces);
    let mut targets: Vec<(ClassId, u32)> = Vec::new();
    for class in line_up {
        match targets.iter_mut().find(|(c, _)| c == class) {
            Some((_, n)) => *n += 1,
            None => targets.push((*class, 1)),
        }
    }
    targets.sort();
    let goal = Goal { targets };
    let parts = OutdoorParts { floors, things, people, goal, goal_place: truck };
    Ok(outdoors::setup(task, seeds.episode, BOUNDS, parts))
}

/// The house, its neighbors and what grows around them.
fn surroundings(scenery: &mut Scenery, rng: &mut Stream) {
    scenery.put("house_front", [mm(rng.range(0.0, 4.0)), -7.9], PI, rng.below(8));
    scenery.houses(rng, [8.5, 30.0], -8.4, PI);
    scenery.houses(rng, [-25.0, -4.5], -8.4, PI);
    scenery.houses(rng, [-20.0, 30.0], 7.6, 0.0);
    let fence = rng.below(8);
    scenery.fence([-5.0, 19.0], -7.3, PI, fence);
    scenery.fence([-5.0, 19.0], 6.12, 0.0, fence);
    for x in [-3.5, 7.5, 17.5] {
        scenery.put_if_free("street_lamp", [x + rng.range(-0.5, 0.5), 3.0], 0.0, 0, 0.3);
    }
    scenery.put_if_free("mailbox", [rng.range(6.0, 9.0), -3.9], PI, rng.below(8), 0.4);
    scenery.put_if_free("bench", [rng.range(7.0, 13.0), -4.9], PI, rng.below(8), 0.5);
    scenery.trees(rng, Rect::new([-4.5, 4.0], [18.5, 5.2]), 5);
    scenery.trees(rng, Rect::new([-4.5, -6.4], [18.5, -5.6]), 4);
    scenery.trees(rng, Rect::new([-16.0, -16.0], [32.0, -11.5]), 8);
    scenery.trees(rng, Rect::new([-16.0, 10.5], [32.0, 16.0]), 8);
    scenery.trees(rng, Rect::new([-14.0, 3.5], [-6.5, 9.0]), 3);
    scenery.trees(rng, Rect::new([21.0, -10.0], [30.0, -5.0]), 3);
}

/// The pieces, each with room around it.
fn pieces(line_up: &[ClassId], rng: &mut Stream) -> Result<Vec<Thing>, &'static str> {
    // Large ones first, while there is room.
    let mut order = line_up.to_vec();
    let area = |c: &ClassId| c.info().size_m[0] * c.info().size_m[2];
    order.sort_by(|a, b| area(b).total_cmp(&area(a)));
    let mut put: Vec<Thing> = Vec::new();
    for class in order {
        let thing = (0..TRIES).find_map(|_| {
            let x = mm(rng.range(PLACES.min.x, PLACES.max.x));
            let z = mm(rng.range(PLACES.min.y, PLACES.max.y));
            let mut thing = Thing::new(class, Vec3::new(x, 0.0, z), heading(rng));
            thing.variant = rng.below(class.info().palette.len().max(1)) as u8;
            let bounds = plan_bounds(&thing);
            let is_apart = put.iter().map(plan_bounds).all(|other| {
                is_clear(Vec2::new(x, z), &[other], PIECE_CLEAR_M)
                    && !other.overlaps(&bounds.grown(OUTLINE_CLEAR_M))
            });
            is_apart.then_some(thing)
        });
        put.push(thing.ok_or("no room for the furniture")?);
    }
    rng.shuffle(&mut put);
    Ok(put)
}

/// The two who carry, among the furniture.
fn people(task: TaskId, pieces: &[Thing], rng: &mut Stream) -> Result<Vec<Person>, &'static str> {
    let taken: Vec<Rect> = pieces.iter().map(plan_bounds).collect();
    let mut people: Vec<Person> = Vec::new();
    for kind in [task.info().partner, Persona::Helper.into()] {
        let position = (0..TRIES).find_map(|_| {
            let x = mm(rng.range(PLACES.min.x, PLACES.max.x));
            let z = mm(rng.range(PLACES.min.y, PLACES.max.y));
            let p = Vec2::new(x, z);
            let is_apart = people.iter().all(|o| xz(o.pose.position).distance(p) >= PEOPLE_APART_M);
            (is_apart && is_clear(p, &taken, PERSON_CLEAR_M)).then_some(Vec3::new(x, 0.0, z))
        });
        let position = position.ok_or("no room for the people")?;
        let pose = Pose { position, yaw_rad: heading(rng) };
        people.push(Person::new(kind, pose, rng.below(16) as u8));
    }
    Ok(people)
}
