//! Generation of a furnished house, and the check that it suits all tasks.

use chaic_core::geom::Rect;
use chaic_core::rng::RngStream;
use chaic_world::{Floor, FloorMaterial, Room, RoomKind};

use super::layout::{Plan, WALL_M, draw_plan};
use super::room::{BODY_M, RoomPlan};
use super::{House, decoys, recipes, slots};
use crate::Settings;
use crate::free_space::FreeSpace;
use crate::upright_box::UprightBox;

/// Minimum number of slots for small objects on low furniture: 32 objects, 6 containers and 8
/// spare ones.
const MIN_LOW_SLOTS: usize = 46;

const WALL_COLORS: [[u8; 3]; 8] = [
    [236, 231, 220],
    [222, 228, 222],
    [230, 222, 212],
    [216, 224, 232],
    [240, 232, 206],
    [226, 218, 226],
    [232, 236, 236],
    [218, 210, 198],
];
const WOODS: [[u8; 3]; 5] =
    [[176, 132, 88], [148, 104, 68], [196, 158, 112], [132, 98, 72], [186, 146, 106]];
const TILES: [[u8; 3]; 4] = [[212, 208, 200], [188, 196, 200], [222, 214, 196], [176, 168, 158]];
const CARPETS: [[u8; 3]; 5] =
    [[152, 142, 134], [128, 140, 156], [164, 146, 130], [140, 152, 136], [168, 156, 160]];

/// Generates the house of a place seed at this attempt; fails with the reason if it does not suit
/// all tasks.
pub(super) fn house(
    place_seed: u64,
    settings: Settings,
    attempt: u64,
) -> Result<House, &'static str> {
    // Drawn once for all attempts; otherwise sizes that succeed more often would be
    // overrepresented.
    let n_rooms = 6 + RngStream::new(place_seed, "house/size", 0).below(3);
    let mut rng = RngStream::new(place_seed, "house/plan", attempt);
    let plan = draw_plan(&mut rng, n_rooms).ok_or("no floor plan")?;
    let mut rooms = furnish_rooms(&plan, place_seed, settings, attempt)?;
    let mut colors = RngStream::new(place_seed, "house/colors", attempt);
    let mut color = |of: &[[u8; 3]]| of[colors.below(of.len())];
    let walls = plan.walls(color(&WALL_COLORS), color(&WALL_COLORS));
    let (wood, tiles) = (color(&WOODS), color(&TILES));
    let floors = plan.rooms.iter().map(|(kind, rect)| {
        let (material, color) = match kind {
            RoomKind::Kitchen | RoomKind::Bathroom => (FloorMaterial::Tiles, tiles),
            RoomKind::Bedroom | RoomKind::Office => (FloorMaterial::Carpet, color(&CARPETS)),
            _ => (FloorMaterial::Wood, wood),
        };
        Floor { rect: *rect, material, color }
    });
    let floors = floors.collect();
    let furniture = rooms.iter_mut().flat_map(|r| std::mem::take(&mut r.things)).collect();
    let mut house = House {
        bounds: plan.outer.expanded(0.5 * WALL_M),
        rooms: plan.rooms.iter().map(|(kind, rect)| Room { kind: *kind, rect: *rect }).collect(),
        walls,
        openings: plan.doors.iter().map(|d| d.opening()).collect(),
        is_spanning: plan.doors.iter().map(|d| d.is_spanning).collect(),
        floors,
        furniture,
        ground: FreeSpace::new(Rect::new([0.0; 2], [0.1; 2])),
        walkable: Vec::new(),
    };
    find_walkable(&mut house);
    check_requirements(&house, settings)?;
    Ok(house)
}

/// Furnishes every room of a plan.
fn furnish_rooms(
    plan: &Plan,
    place_seed: u64,
    settings: Settings,
    attempt: u64,
) -> Result<Vec<RoomPlan>, &'static str> {
    let stream = |purpose: &str, room: usize| {
        RngStream::new(place_seed, purpose, attempt * 64 + room as u64)
    };
    let mut living = 0;
    let mut rooms = Vec::new();
    for (i, (kind, rect)) in plan.rooms.iter().enumerate() {
        let mut room = RoomPlan::new(i, *rect, &plan.doors);
        let rng = &mut stream("house/furniture", i);
        match kind {
            RoomKind::Bedroom => recipes::bedroom(&mut room, rng).ok_or("no room for the bed")?,
            RoomKind::Kitchen => {
                recipes::kitchen(&mut room, rng).ok_or("no room for the kitchen")?
            }
            RoomKind::Office => recipes::office(&mut room, rng).ok_or("no room for the office")?,
            RoomKind::LivingRoom => {
                recipes::living_room(&mut room, rng, living).ok_or("no room to live in")?;
                living += 1;
            }
            _ => recipes::corridor(&mut room, rng),
        }
        rooms.push(room);
    }
    let rng = &mut stream("house/storage", 0);
    let mut order: Vec<usize> =
        (0..rooms.len()).filter(|i| plan.rooms[*i].0 != RoomKind::Corridor).collect();
    rng.shuffle(&mut order);
    let mut cabinets = if settings.decoys { decoys::CABINETS } else { 3 + rng.below(2) };
    for i in &order {
        if cabinets > 0 && recipes::add_piece(&mut rooms[*i], rng, "cabinet") {
            cabinets -= 1;
        }
    }
    let is_dining_room = |k: RoomKind| matches!(k, RoomKind::Kitchen | RoomKind::LivingRoom);
    // The second refrigerator of a house is in a kitchen or living room.
    if rng.chance(0.35) {
        let mut places = order.iter().filter(|i| is_dining_room(plan.rooms[**i].0));
        places.any(|i| recipes::add_piece(&mut rooms[*i], rng, "refrigerator"));
    }
    if settings.decoys {
        let rng = &mut stream("house/low refrigerator", 0);
        rng.shuffle(&mut order);
        order.sort_by_key(|i| !is_dining_room(plan.rooms[*i].0));
        decoys::refrigerators(&mut rooms, &order, rng)?;
    }
    for (i, room) in rooms.iter_mut().enumerate() {
        let fillers: &[&str] = match plan.rooms[i].0 {
            RoomKind::LivingRoom => &recipes::LIVING_FILLERS,
            RoomKind::Kitchen => &recipes::KITCHEN_FILLERS,
            RoomKind::Corridor => continue,
            _ => &recipes::QUIET_FILLERS,
        };
        recipes::fill_room(room, &mut stream("house/fillers", i), fillers);
    }
    if cabinets == 0 { Ok(rooms) } else { Err("no room for the cabinets") }
}

/// Computes the cells in which a wide body can walk.
fn find_walkable(house: &mut House) {
    let mut solids: Vec<UprightBox> = house.walls.iter().map(UprightBox::from_wall).collect();
    solids.extend(house.furniture.iter().flat_map(UprightBox::from_object));
    solids.retain(|s| s.spans([0.12, 1.75]));
    house.ground = FreeSpace::around(house.bounds, BODY_M, &solids);
    let door = 0.5 * (house.openings[0].a + house.openings[0].b);
    house.walkable = house.ground.flood(door);
}

/// Checks the needs of all tasks: all rooms are connected, and there are enough low and high slots.
fn check_requirements(house: &House, settings: Settings) -> Result<(), &'static str> {
    let stands = |p| house.ground.cell(p).is_some_and(|i| house.walkable[i]);
    if !house.openings.iter().all(|o| stands(0.5 * (o.a + o.b))) {
        return Err("a doorway can't be reached");
    }
    if slots::low(house).len() < MIN_LOW_SLOTS {
        return Err("too few places on low furniture");
    }
    let high = slots::high(house);
    let tops = |class: &str| high.iter().filter(|t| t.class.name() == class).count();
    let cabinets = if settings.decoys { decoys::CABINETS..=decoys::CABINETS } else { 3..=4 };
    if !cabinets.contains(&tops("cabinet")) || !(1..=2).contains(&tops("refrigerator")) {
        return Err("a high top can't be reached");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_first_attempts_are_valid() {
        let mut reasons = std::collections::BTreeMap::<&str, u32>::new();
        for settings in [Settings::PAPER, Settings::STANDARD] {
            reasons.clear();
            for seed in 0..60 {
                let result = house(seed, settings, 0).map(|_| ());
                *reasons.entry(result.err().unwrap_or("valid")).or_default() += 1;
            }
            assert!(reasons.get("valid").is_some_and(|n| *n >= 10), "{reasons:?}");
        }
    }
}
