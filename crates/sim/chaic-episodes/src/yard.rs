//! Yard of a house during a move: five pieces of furniture and a truck (facts S9.2 and S12.4,
//! mirrored in z).

use std::f32::consts::{FRAC_PI_2, PI};

use chaic_core::briefing::Goal;
use chaic_core::capability::Persona;
use chaic_core::catalogue::TargetSet;
use chaic_core::geom::{Pose, Rect, to_xz};
use chaic_core::rng::RngStream;
use chaic_core::{ClassId, TaskId, Vec2, Vec3};
use chaic_world::{AgentSpec, ObjectSpec, Setup};

use crate::Settings;
use crate::attempts::{GenerateError, first_valid};
use crate::outdoors::{self, OutdoorParts, Scenery, ground, heading, is_clear};
use crate::seeds::{FIRST_BUNDLED_SEED, GeneratorSeeds};
use crate::upright_box::{mm, plan_bounds};

/// Version of this generator; incremented with every change of its output.
pub const VERSION: u32 = 1;

const ATTEMPTS: u64 = 400;
/// Attempts per place.
const PLACE_ATTEMPTS: u64 = 100;
/// Part of the street that the original's maps cover, meters.
const BOUNDS: Rect = Rect { min: Vec2::new(-5.0, -7.5), max: Vec2::new(19.0, 6.0) };
const ROAD_Z: [f32; 2] = [-3.2, 2.2];
const PAVEMENT_Z: [f32; 2] = [-4.6, 3.4];
/// Area in which furniture and people start, meters.
const PLACES: Rect = Rect { min: Vec2::new(-1.5, -2.75), max: Vec2::new(5.5, 1.25) };
const TRUCK: [f32; 2] = [14.0, 0.0];
/// Maximum offset of the truck from the paper's position along and across the road, meters. It
/// stays about 10 m from the furniture (paper), and on the road.
const TRUCK_SHIFT_M: [f32; 2] = [1.5, 0.9];
const N_PIECES: usize = 5;
/// Minimum distance from a piece's center to the outlines of others, meters (facts S9.2).
const PIECE_CLEAR_M: f32 = 1.25;
/// Minimum distance between outlines of pieces, meters.
const OUTLINE_CLEAR_M: f32 = 0.5;
/// Minimum distance from people to furniture, meters: a cell of 0.25 and the body.
const PERSON_CLEAR_M: f32 = 0.45;
const PEOPLE_APART_M: f32 = 0.9;
const MAX_ATTEMPTS: usize = 200;

/// Furniture sets of the original's twelve episodes, the same in train and test (facts S12.4).
const FURNITURE_SETS: [[&str; N_PIECES]; 12] = [
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

/// Generates a moving-house episode.
///
/// # Errors
/// [`GenerateError`] if no attempt led to a valid setup.
pub fn generate(
    task: TaskId,
    seeds: GeneratorSeeds,
    settings: Settings,
) -> Result<Setup, GenerateError> {
    let furniture_set = furniture_set(seeds.episode, settings);
    first_valid(task, seeds, ATTEMPTS, |attempt| {
        setup(task, seeds, settings, &furniture_set, attempt)
    })
}

/// Returns the original's furniture set for a bundled episode, and a random one for other episodes.
fn furniture_set(seed: u64, settings: Settings) -> Vec<ClassId> {
    if seed >= FIRST_BUNDLED_SEED && !settings.varied_layout {
        return FURNITURE_SETS[(seed % 12) as usize].map(ClassId::named).to_vec();
    }
    let is_furniture = |c: &ClassId| c.info().sets.contains(&TargetSet::Furniture);
    let all: Vec<ClassId> = ClassId::all().filter(is_furniture).collect();
    let mut rng = RngStream::new(seed, "moving_house/line-up", 0);
    (0..N_PIECES).map(|_| all[rng.below(all.len())]).collect()
}

fn setup(
    task: TaskId,
    seeds: GeneratorSeeds,
    settings: Settings,
    furniture_set: &[ClassId],
    attempt: u64,
) -> Result<Setup, &'static str> {
    let stream = |purpose: &str| RngStream::new(seeds.episode, purpose, attempt);
    let mut pieces = pieces(furniture_set, &mut stream("moving_house/pieces"))?;
    let mut people = draw_people(task, &pieces, &mut stream("moving_house/people"))?;
    // The place stays the same for many attempts, so that episodes share it.
    let scenery_rng = &mut RngStream::new(seeds.place, "yard/scenery", attempt / PLACE_ATTEMPTS);
    let floors = ground(BOUNDS, ROAD_Z, PAVEMENT_Z, scenery_rng);
    let keep_clear = Rect::new([-4.0, ROAD_Z[0]], [18.0, ROAD_Z[1]]);
    let mut scenery = Scenery::new(vec![keep_clear]);
    // The cab faces +x, the open rear faces the furniture.
    let layout_rng = &mut RngStream::new(seeds.place, "yard/layout", attempt / PLACE_ATTEMPTS);
    let (mut shift, mut is_mirrored) = ([0.0; 2], false);
    if settings.varied_layout {
        shift = TRUCK_SHIFT_M.map(|m| layout_rng.range(-m, m));
        is_mirrored = layout_rng.chance(0.5);
    }
    let at = [TRUCK[0] + shift[0], TRUCK[1] + shift[1]];
    let truck = scenery.add("truck", at, -FRAC_PI_2, 0);
    surroundings(&mut scenery, scenery_rng);

    let mut things = scenery.things;
    if is_mirrored {
        outdoors::mirror(&mut things, &mut [], BOUNDS.center().x);
        outdoors::mirror(&mut pieces, &mut people, BOUNDS.center().x);
    }
    things.extend(pieces);
    let mut targets: Vec<(ClassId, u32)> = Vec::new();
    for class in furniture_set {
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

/// Adds the house, its neighbors and the scenery around them.
fn surroundings(scenery: &mut Scenery, rng: &mut RngStream) {
    scenery.add("house_front", [mm(rng.range(0.0, 4.0)), -7.9], PI, rng.below(8));
    scenery.houses(rng, [8.5, 30.0], -8.4, PI);
    scenery.houses(rng, [-25.0, -4.5], -8.4, PI);
    scenery.houses(rng, [-20.0, 30.0], 7.6, 0.0);
    let fence = rng.below(8);
    scenery.fence([-5.0, 19.0], -7.3, PI, fence);
    scenery.fence([-5.0, 19.0], 6.12, 0.0, fence);
    for x in [-3.5, 7.5, 17.5] {
        scenery.add_if_free("street_lamp", [x + rng.range(-0.5, 0.5), 3.0], 0.0, 0, 0.3);
    }
    scenery.add_if_free("mailbox", [rng.range(6.0, 9.0), -3.9], PI, rng.below(8), 0.4);
    scenery.add_if_free("bench", [rng.range(7.0, 13.0), -4.9], PI, rng.below(8), 0.5);
    scenery.trees(rng, Rect::new([-4.5, 4.0], [18.5, 5.2]), 5);
    scenery.trees(rng, Rect::new([-4.5, -6.4], [18.5, -5.6]), 4);
    scenery.trees(rng, Rect::new([-16.0, -16.0], [32.0, -11.5]), 8);
    scenery.trees(rng, Rect::new([-16.0, 10.5], [32.0, 16.0]), 8);
    scenery.trees(rng, Rect::new([-14.0, 3.5], [-6.5, 9.0]), 3);
    scenery.trees(rng, Rect::new([21.0, -10.0], [30.0, -5.0]), 3);
}

/// Draws the poses of the pieces, each with clearance around it.
fn pieces(furniture_set: &[ClassId], rng: &mut RngStream) -> Result<Vec<ObjectSpec>, &'static str> {
    // Large pieces first, while there is space.
    let mut order = furniture_set.to_vec();
    let area = |c: &ClassId| c.info().size_m[0] * c.info().size_m[2];
    order.sort_by(|a, b| area(b).total_cmp(&area(a)));
    let mut placed: Vec<ObjectSpec> = Vec::new();
    for class in order {
        let object = (0..MAX_ATTEMPTS).find_map(|_| {
            let x = mm(rng.range(PLACES.min.x, PLACES.max.x));
            let z = mm(rng.range(PLACES.min.y, PLACES.max.y));
            let mut object = ObjectSpec::new(class, Vec3::new(x, 0.0, z), heading(rng));
            object.variant = rng.below(class.info().palette.len().max(1)) as u8;
            let bounds = plan_bounds(&object);
            let is_apart = placed.iter().map(plan_bounds).all(|other| {
                is_clear(Vec2::new(x, z), &[other], PIECE_CLEAR_M)
                    && !other.overlaps(&bounds.expanded(OUTLINE_CLEAR_M))
            });
            is_apart.then_some(object)
        });
        placed.push(object.ok_or("no room for the furniture")?);
    }
    rng.shuffle(&mut placed);
    Ok(placed)
}

/// Draws the poses of the two people, among the furniture.
fn draw_people(
    task: TaskId,
    pieces: &[ObjectSpec],
    rng: &mut RngStream,
) -> Result<Vec<AgentSpec>, &'static str> {
    let taken: Vec<Rect> = pieces.iter().map(plan_bounds).collect();
    let mut people: Vec<AgentSpec> = Vec::new();
    for kind in [task.info().partner, Persona::Helper.into()] {
        let position = (0..MAX_ATTEMPTS).find_map(|_| {
            let x = mm(rng.range(PLACES.min.x, PLACES.max.x));
            let z = mm(rng.range(PLACES.min.y, PLACES.max.y));
            let p = Vec2::new(x, z);
            let is_apart =
                people.iter().all(|o| to_xz(o.pose.position).distance(p) >= PEOPLE_APART_M);
            (is_apart && is_clear(p, &taken, PERSON_CLEAR_M)).then_some(Vec3::new(x, 0.0, z))
        });
        let position = position.ok_or("no room for the people")?;
        let pose = Pose { position, yaw_rad: heading(rng) };
        people.push(AgentSpec::new(kind, pose, rng.below(16) as u8));
    }
    Ok(people)
}
