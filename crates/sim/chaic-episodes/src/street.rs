//! Shopping street: six shops along a road, with the house at its end (facts S8.1, mirrored in z).

use std::f32::consts::{FRAC_PI_2, PI};

use chaic_core::briefing::Goal;
use chaic_core::capability::{PersonKind, Persona};
use chaic_core::geom::{Pose, Rect, to_xz};
use chaic_core::rng::RngStream;
use chaic_core::{ClassId, TaskId, Vec2, Vec3};
use chaic_world::{AgentSpec, ObjectSpec, Setup, top_surfaces};

use crate::Settings;
use crate::attempts::{GenerateError, first_valid};
use crate::outdoors::{self, OutdoorParts, Scenery, ground};
use crate::seeds::GeneratorSeeds;
use crate::upright_box::{mm, mm3};

/// Version of this generator; incremented with every change of its output.
pub const VERSION: u32 = 1;

const ATTEMPTS: u64 = 400;
/// Attempts per place.
const PLACE_ATTEMPTS: u64 = 100;
/// Area that the original's maps cover, meters.
const BOUNDS: Rect = Rect { min: Vec2::new(-3.0, -7.5), max: Vec2::new(25.0, 6.0) };
const ROAD_Z: [f32; 2] = [-2.7, 1.2];
const PAVEMENT_Z: [f32; 2] = [-6.1, 3.9];
/// Position (x, z) of the goal place, meters: the hydrant in front of the rider's house.
const HYDRANT: [f32; 2] = [2.0, -5.5];
/// Offset of shelves from the tent's center, along the road and towards it.
const SHELF_OFFSET_M: [f32; 2] = [0.7, 0.5];
/// Size of outdoor shelves relative to the catalogue's (facts S8.1 against S9.1).
const SHELF_SCALE: [f32; 3] = [1.25, 1.0, 1.5];
/// Positions of goods along a shelf, meters from its center.
const SLOTS_M: [f32; 3] = [0.0, -0.4, 0.4];
/// Minimum distance between partner and helper at the start, meters.
const PEOPLE_APART_M: f32 = 5.0;
/// Maximum offset of all shops of one side along the road from the paper's positions, meters. The
/// next two: of each shop along the road, and away from it. The values are ours: tents of 2.4 m
/// every 5 m stay apart, and people start between them.
const SIDE_SHIFT_M: f32 = 1.0;
const SHOP_SHIFT_M: f32 = 0.7;
const SHOP_BACK_M: f32 = 0.3;
/// Maximum offset of the hydrant from the paper's position, meters. It stays inside the bounds and
/// in front of the rider's house, which moves with it.
const HYDRANT_SHIFT_M: f32 = 1.5;
/// Number of shops with a basket.
const BASKETS: usize = 3;
const BASKET_CLASSES: [&str; 4] =
    ["bamboo_basket", "plastic_basket", "wicker_basket", "wood_basket"];

/// A shop: the center of its tent, and its goods.
#[derive(Clone, Copy)]
struct Shop {
    at: [f32; 2],
    stock: &'static [(&'static str, usize)],
}

/// The six shops with their stock, the same in every episode; two for each category.
const SHOPS: [Shop; 6] = [
    Shop { at: [10.0, 2.5], stock: &[("apple", 2), ("orange", 3), ("shop_banana", 1)] },
    Shop { at: [10.0, -4.0], stock: &[("apple", 1), ("grape", 3), ("shop_banana", 2)] },
    Shop { at: [15.0, 2.5], stock: &[("loaf_bread", 2), ("croissant", 2), ("burger", 2)] },
    Shop { at: [15.0, -4.0], stock: &[("loaf_bread", 1), ("croissant", 1), ("pink_donut", 2)] },
    Shop { at: [20.0, 2.5], stock: &[("pepsi_can", 2), ("sprite_can", 1), ("fanta_can", 2)] },
    Shop { at: [20.0, -4.0], stock: &[("cocacola_can", 3), ("sprite_can", 2), ("fanta_can", 1)] },
];

impl Shop {
    /// Returns the yaw of objects that face the road.
    fn yaw_rad(&self) -> f32 {
        if self.at[1] > 0.0 { 0.0 } else { PI }
    }
}

/// Positions of the shops and of the goal place.
struct Layout {
    shops: [Shop; 6],
    /// Side of the shelf that is listed first and may hold a basket, per shop: -1 for lower x, or
    /// 1.
    first_shelf: [f32; 6],
    hydrant: [f32; 2],
    /// True if the rider's house is at the other end of the road.
    is_mirrored: bool,
}

impl Layout {
    /// The original's layout.
    const PAPER: Layout =
        Layout { shops: SHOPS, first_shelf: [-1.0; 6], hydrant: HYDRANT, is_mirrored: false };

    /// Draws a layout: the shop of each stock, and the positions of shops and house along the road.
    fn varied(rng: &mut RngStream) -> Layout {
        let mut stocks = SHOPS.map(|shop| shop.stock);
        rng.shuffle(&mut stocks);
        let mut side = || rng.range(-SIDE_SHIFT_M, SIDE_SHIFT_M);
        let shift_m = [side(), side()];
        let mut shops = SHOPS;
        for (shop, stock) in shops.iter_mut().zip(stocks) {
            shop.stock = stock;
            let row_m = shift_m[usize::from(shop.at[1] > 0.0)];
            shop.at[0] += row_m + rng.range(-SHOP_SHIFT_M, SHOP_SHIFT_M);
            // Away from the road only, which keeps its width.
            shop.at[1] += shop.at[1].signum() * rng.range(0.0, SHOP_BACK_M);
        }
        let first_shelf = shops.map(|_| if rng.chance(0.5) { -1.0 } else { 1.0 });
        let hydrant = [HYDRANT[0] + rng.range(-HYDRANT_SHIFT_M, HYDRANT_SHIFT_M), HYDRANT[1]];
        Layout { shops, first_shelf, hydrant, is_mirrored: rng.chance(0.5) }
    }
}

/// Generates a shopping episode.
///
/// # Errors
/// [`GenerateError`] if no attempt led to a valid setup.
pub fn generate(
    task: TaskId,
    seeds: GeneratorSeeds,
    settings: Settings,
) -> Result<Setup, GenerateError> {
    first_valid(task, seeds, ATTEMPTS, |attempt| setup(task, seeds, settings, attempt))
}

fn setup(
    task: TaskId,
    seeds: GeneratorSeeds,
    settings: Settings,
    attempt: u64,
) -> Result<Setup, &'static str> {
    let stream = |purpose: &str| RngStream::new(seeds.episode, purpose, attempt);
    let mut people = draw_people(task, &mut stream("shopping/people"))?;
    let layout = if settings.varied_layout {
        Layout::varied(&mut RngStream::new(seeds.place, "street/layout", attempt / PLACE_ATTEMPTS))
    } else {
        Layout::PAPER
    };
    // The place stays the same for many attempts, so that episodes share it.
    let scenery_rng = &mut RngStream::new(seeds.place, "street/scenery", attempt / PLACE_ATTEMPTS);
    let floors = ground(BOUNDS, ROAD_Z, PAVEMENT_Z, scenery_rng);
    let mut scenery = Scenery::new(vec![Rect::new([8.0, ROAD_Z[0]], [22.0, ROAD_Z[1]])]);
    let hydrant = scenery.add("fire_hydrant", layout.hydrant, PI, 0);
    let shelves = shops(&mut scenery, &layout, scenery_rng);
    surroundings(&mut scenery, layout.hydrant, scenery_rng);

    let mut things = scenery.things;
    if layout.is_mirrored {
        outdoors::mirror(&mut things, &mut people, BOUNDS.center().x);
    }
    things.push(bicycle(&people[0]));
    stock(&mut things, &layout.shops, &shelves, &mut stream("shopping/stock"));
    let goal = draw_goal(seeds.episode, &mut stream("shopping/goal"));
    let parts = OutdoorParts { floors, things, people, goal, goal_place: hydrant };
    Ok(outdoors::setup(task, seeds.episode, BOUNDS, parts))
}

/// Adds tents with two shelves each; returns the indices of the shelves per shop.
fn shops(scenery: &mut Scenery, layout: &Layout, rng: &mut RngStream) -> Vec<[usize; 2]> {
    let mut shelves = Vec::new();
    for (k, shop) in layout.shops.iter().enumerate() {
        let variant = rng.below(8) + k;
        scenery.add("tent", shop.at, shop.yaw_rad(), variant);
        let towards_road = if shop.at[1] > 0.0 { -SHELF_OFFSET_M[1] } else { SHELF_OFFSET_M[1] };
        let first = layout.first_shelf[k];
        shelves.push([first, -first].map(|side| {
            let at = [shop.at[0] + side * SHELF_OFFSET_M[0], shop.at[1] + towards_road];
            // The shelf's long side is its z.
            let i = scenery.add("wood_shelving", at, FRAC_PI_2, 0);
            scenery.things[i].scale = SHELF_SCALE;
            i
        }));
    }
    shelves
}

/// Adds the rider's house, its neighbors, and objects along the road.
fn surroundings(scenery: &mut Scenery, hydrant: [f32; 2], rng: &mut RngStream) {
    scenery.add("house_front", [hydrant[0], -8.05], PI, rng.below(8));
    scenery.houses(rng, [7.0, 30.0], -8.8, PI);
    scenery.houses(rng, [-8.0, 30.0], 7.4, 0.0);
    let fence = rng.below(8);
    scenery.fence([6.5, 24.5], -7.62, PI, fence);
    scenery.fence([-3.0, 25.0], 6.12, 0.0, fence);
    for x in [5.0, 12.5, 17.5, 23.5] {
        let x = x + rng.range(-0.3, 0.3);
        scenery.add_if_free("street_lamp", [x, ROAD_Z[1] + 0.75], 0.0, 0, 0.3);
        let x = x + rng.range(-0.3, 0.3);
        scenery.add_if_free("street_lamp", [x, ROAD_Z[0] - 0.75], PI, 0, 0.3);
    }
    for _ in 0..3 {
        let (near, far) = (rng.range(-2.0, 7.5), rng.range(4.5, 24.0));
        scenery.add_if_free("bench", [near, 3.4], 0.0, rng.below(8), 0.6);
        scenery.add_if_free("bench", [far, -5.7], PI, rng.below(8), 0.6);
    }
    scenery.add_if_free("mailbox", [rng.range(4.5, 7.5), -3.7], PI, rng.below(8), 0.5);
    scenery.trees(rng, Rect::new([-2.5, 4.9], [24.5, 5.4]), 6);
    scenery.trees(rng, Rect::new([7.0, -6.9], [24.5, -6.4]), 5);
    scenery.trees(rng, Rect::new([-14.0, -16.0], [36.0, -11.5]), 8);
    scenery.trees(rng, Rect::new([-14.0, 10.5], [36.0, 16.0]), 8);
    scenery.trees(rng, Rect::new([-14.0, -10.0], [-5.0, -4.0]), 3);
    scenery.trees(rng, Rect::new([27.0, 3.0], [36.0, 9.0]), 3);
}

/// Places the goods of all shops, and baskets on the first shelves of three.
fn stock(
    things: &mut Vec<ObjectSpec>,
    shops: &[Shop],
    shelves: &[[usize; 2]],
    rng: &mut RngStream,
) {
    let mut with_basket: Vec<usize> = (0..shops.len()).collect();
    rng.shuffle(&mut with_basket);
    let mut baskets = BASKET_CLASSES;
    rng.shuffle(&mut baskets);
    for (k, shop) in shops.iter().enumerate() {
        let basket = with_basket.iter().position(|s| *s == k).filter(|n| *n < BASKETS);
        let mut slots: Vec<(usize, usize, f32)> = Vec::new();
        for shelf in 0..2 {
            for level in 0..3 {
                let is_occupied = basket.is_some() && shelf == 0 && level == 2;
                let free = SLOTS_M.iter().filter(|_| !is_occupied);
                slots.extend(free.map(|m| (shelf, level, *m)));
            }
        }
        rng.shuffle(&mut slots);
        if let Some(n) = basket {
            let object = on_shelf(&things[shelves[k][0]], baskets[n], 2, 0.0, rng);
            things.push(object);
        }
        let goods = shop.stock.iter().flat_map(|(name, n)| std::iter::repeat_n(*name, *n));
        for (name, (shelf, level, along_m)) in goods.zip(slots) {
            let object = on_shelf(&things[shelves[k][shelf]], name, level, along_m, rng);
            things.push(object);
        }
    }
}

/// Returns an object on a board of a shelf; board 0 is the lowest.
fn on_shelf(
    shelf: &ObjectSpec,
    class: &str,
    level: usize,
    along_m: f32,
    rng: &mut RngStream,
) -> ObjectSpec {
    let mut boards = top_surfaces(shelf);
    boards.sort_by(|a, b| a.center.y.total_cmp(&b.center.y));
    let board = boards[level];
    let class = ClassId::named(class);
    let is_container = class.info().role == chaic_core::Role::Container;
    let along_m = along_m + if is_container { 0.0 } else { rng.range(-0.03, 0.03) };
    let position = mm3(board.center + Vec3::new(along_m, 0.0, 0.0));
    let yaw_rad = if is_container { 0.0 } else { mm(rng.range(-0.6, 0.6)) };
    let mut object = ObjectSpec::new(class, position, yaw_rad);
    object.variant = rng.below(class.info().palette.len().max(1)) as u8;
    object
}

/// Returns the goal: all goods of the episode's category, and one of another (facts S8.1).
fn draw_goal(seed: u64, rng: &mut RngStream) -> Goal {
    let category = (seed % 3) as usize;
    let stock = |c: usize| SHOPS[2 * c..2 * c + 2].iter().flat_map(|s| s.stock.iter());
    let mut targets: Vec<(ClassId, u32)> = Vec::new();
    for (name, n) in stock(category) {
        let class = ClassId::named(name);
        match targets.iter_mut().find(|(c, _)| *c == class) {
            Some((_, count)) => *count += *n as u32,
            None => targets.push((class, *n as u32)),
        }
    }
    let mut other_classes: Vec<ClassId> = (0..3)
        .filter(|c| *c != category)
        .flat_map(stock)
        .map(|(name, _)| ClassId::named(name))
        .collect();
    other_classes.sort();
    other_classes.dedup();
    targets.extend(rng.choose(&other_classes).map(|c| (*c, 1)));
    targets.sort();
    Goal { targets }
}

/// Draws the poses of people: the rider faces the house, the helper is at a distance, and the child
/// is beside the rider.
fn draw_people(task: TaskId, rng: &mut RngStream) -> Result<Vec<AgentSpec>, &'static str> {
    let mut random_position = || {
        let (x, z) = (rng.range(10.0, 20.0), rng.range(-1.8, 0.8));
        Vec3::new(mm(x), 0.0, mm(z))
    };
    let (partner, helper) = (random_position(), random_position());
    if to_xz(partner).distance(to_xz(helper)) <= PEOPLE_APART_M {
        return Err("partner and helper are too near to each other");
    }
    let child = mm3(partner + Vec3::new(1.0, 0.0, -1.0));
    let mut person = |kind: PersonKind, position: Vec3, yaw_rad: f32| {
        AgentSpec::new(kind, Pose { position, yaw_rad: mm(yaw_rad) }, rng.below(16) as u8)
    };
    Ok(vec![
        person(task.info().partner, partner, FRAC_PI_2),
        person(Persona::Helper.into(), helper, 0.0),
        person(Persona::Child.into(), child, 0.75 * PI),
    ])
}

/// Returns the bicycle at the rider's left hand.
fn bicycle(rider: &AgentSpec) -> ObjectSpec {
    let position = mm3(rider.pose.to_world(Vec3::new(-0.45, 0.0, -0.1)));
    ObjectSpec::new(ClassId::named("bike"), position, rider.pose.yaw_rad)
}
