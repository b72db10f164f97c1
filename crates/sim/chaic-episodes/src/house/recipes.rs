//! Furniture of each kind of room, and its arrangement in groups.

use chaic_core::ClassId;
use chaic_core::rng::RngStream;

use super::room::{Piece, RoomPlan, Side, Spot};

/// Depth in front of a piece that is needed to open it, meters.
const OPEN_M: f32 = 0.75;
/// Fraction of a room's floor under furniture from which the room no longer looks empty.
const MAX_FILLED_FRACTION: f32 = 0.17;
/// Maximum number of pieces that are added to an empty-looking room.
const MAX_FILLERS: usize = 5;
/// Gap between a sofa and its coffee table, meters: a wheelchair passes.
const LOUNGE_GAP_M: f32 = 0.82;

fn size(class: &str) -> [f32; 3] {
    ClassId::named(class).info().size_m
}

/// Returns a single piece with its back to a wall.
fn single(class: &str, access_m: f32, variant: usize) -> Vec<Piece> {
    vec![at(class, 0.0, 0.5 * size(class)[2], 0, access_m, variant)]
}

fn at(class: &str, x: f32, d: f32, turns: u8, access_m: f32, variant: usize) -> Piece {
    Piece { class: ClassId::named(class), x, d, turns, access_m, variant: variant as u8 }
}

/// Returns pieces side by side along a wall.
fn row(classes: &[&str], variant: usize) -> Vec<Piece> {
    let mut x = 0.0;
    let mut pieces = Vec::new();
    for class in classes {
        let [width, _, depth] = size(class);
        pieces.push(at(class, x + 0.5 * width, 0.5 * depth, 0, OPEN_M, variant));
        x += width + 0.02;
    }
    pieces
}

/// Returns a bed with its head to the wall, with nightstands on the sides selected by `stands`
/// (left, right).
fn bed(stands: [bool; 2], variant: usize) -> Vec<Piece> {
    let ([bed_w, _, bed_d], [stand_w, _, stand_d]) = (size("bed"), size("nightstand"));
    let mut pieces = vec![at("bed", 0.0, 0.5 * bed_d, 0, 0.0, variant)];
    for (sign, has_stand) in [(-1.0, stands[0]), (1.0, stands[1])] {
        if has_stand {
            let x = sign * (0.5 * (bed_w + stand_w) + 0.05);
            pieces.push(at("nightstand", x, 0.5 * stand_d, 0, 0.0, 0));
        }
    }
    pieces
}

/// Returns a table with up to four chairs on its long sides. The ends stay free, so that objects on
/// the table can be reached.
fn dining(chairs: usize, variant: usize) -> Vec<Piece> {
    let ([w, _, d], [_, _, chair_d]) = (size("dining_table"), size("side_chair"));
    let out = 0.5 * d + 0.5 * chair_d + 0.03;
    // A chair at turn 0 faces into the room (-z); this one stands nearer to the wall.
    let places =
        [(-0.25 * w, -out, 0), (0.25 * w, out, 2), (0.25 * w, -out, 0), (-0.25 * w, out, 2)];
    let mut pieces = vec![at("dining_table", 0.0, 0.0, 0, 0.0, variant)];
    for (x, d, turns) in places.into_iter().take(chairs) {
        pieces.push(at("side_chair", x, d, turns, 0.0, 0));
    }
    pieces
}

/// Returns a desk against the wall with its chair.
fn desk(variant: usize) -> Vec<Piece> {
    let ([_, _, d], [_, _, chair_d]) = (size("desk"), size("side_chair"));
    vec![
        at("desk", 0.0, 0.5 * d, 0, 0.0, variant),
        at("side_chair", -0.15, d + 0.03 + 0.5 * chair_d, 2, 0.0, 0),
    ]
}

/// Returns a sofa against the wall with a coffee table in front of it, optionally on a rug.
fn lounge(has_rug: bool, variant: usize) -> Vec<Piece> {
    let ([_, _, sofa_d], [_, _, table_d]) = (size("long_sofa"), size("coffee_table"));
    let table_at = sofa_d + LOUNGE_GAP_M + 0.5 * table_d;
    let mut pieces = vec![
        at("long_sofa", 0.0, 0.5 * sofa_d, 0, 0.0, variant),
        at("coffee_table", 0.0, table_at, 0, 0.0, variant / 2),
    ];
    if has_rug {
        pieces.push(at("rug", 0.0, table_at, 0, 0.0, variant));
    }
    pieces
}

/// Returns two armchairs that face each other across a coffee table.
fn reading(variant: usize) -> Vec<Piece> {
    let ([table_w, _, _], [_, _, chair_d]) = (size("coffee_table"), size("armchair"));
    let x = 0.5 * table_w + 0.5 * chair_d + 0.3;
    vec![
        at("coffee_table", 0.0, 0.0, 0, 0.0, variant),
        at("armchair", -x, 0.0, 3, 0.0, variant),
        at("armchair", x, 0.0, 1, 0.0, variant),
    ]
}

/// Places the first group that fits.
fn place_first(
    room: &mut RoomPlan,
    rng: &mut RngStream,
    groups: &[Vec<Piece>],
    spot: Spot,
) -> Option<(Side, f32)> {
    groups.iter().find_map(|g| room.place(rng, g, spot))
}

/// Returns the maximum number of pieces of a class in a room.
fn max_count(class: &str) -> usize {
    match class {
        "tv_stand" => 1,
        "stool" | "floor_lamp" | "long_sofa" | "potted_plant" => 2,
        _ => 3,
    }
}

/// Adds small pieces at corners and walls, each with its probability and if it fits.
fn add_extras(room: &mut RoomPlan, rng: &mut RngStream, classes: &[(&str, f32)]) {
    for (class, chance) in classes {
        if rng.chance(*chance) && room.count(class) < max_count(class) {
            let variant = rng.below(8);
            let (access_m, spot) = match *class {
                "potted_plant" | "floor_lamp" | "stool" => (0.0, Spot::Corner),
                "armchair" => (0.4, Spot::Corner),
                "long_sofa" => (0.5, Spot::Wall),
                _ => (OPEN_M, Spot::Wall),
            };
            let group =
                if *class == "desk" { desk(variant) } else { single(class, access_m, variant) };
            room.place(rng, &group, spot);
        }
    }
}

/// Furnishes a bedroom; `None` if a required piece does not fit.
pub(super) fn bedroom(room: &mut RoomPlan, rng: &mut RngStream) -> Option<()> {
    let v = rng.below(8);
    let beds =
        [bed([true, true], v), bed([true, false], v), bed([false, true], v), bed([false; 2], v)];
    place_first(room, rng, &beds, Spot::Wall)?;
    room.place(rng, &single("wardrobe", OPEN_M, 0), Spot::Wall)?;
    if rng.chance(0.6) {
        let pieces = desk(v % 3);
        room.place(rng, &pieces, Spot::Wall);
    }
    add_extras(
        room,
        rng,
        &[("armchair", 0.6), ("potted_plant", 0.7), ("floor_lamp", 0.7), ("bookshelf", 0.3)],
    );
    Some(())
}

/// Furnishes a kitchen; `None` if a required piece does not fit.
pub(super) fn kitchen(room: &mut RoomPlan, rng: &mut RngStream) -> Option<()> {
    let v = rng.below(3);
    let mut rows = [
        row(&["refrigerator", "kitchen_counter", "stove", "kitchen_counter"], v),
        row(&["refrigerator", "kitchen_counter", "stove"], v),
        row(&["stove", "kitchen_counter", "refrigerator"], v),
    ];
    if rng.chance(0.5) {
        rows[0].reverse();
        let x_max = rows[0].iter().fold(0.0f32, |m, p| m.max(p.x));
        rows[0].iter_mut().for_each(|p| p.x = x_max - p.x);
    }
    place_first(room, rng, &rows, Spot::Wall)?;
    let dv = rng.below(3);
    let tables = [dining(4, dv), dining(2, dv)];
    place_first(room, rng, &tables, Spot::Free)?;
    add_extras(
        room,
        rng,
        &[("kitchen_counter", 0.7), ("potted_plant", 0.5), ("stool", 0.5), ("stool", 0.4)],
    );
    Some(())
}

/// Furnishes an office; `None` if a required piece does not fit.
pub(super) fn office(room: &mut RoomPlan, rng: &mut RngStream) -> Option<()> {
    let v = rng.below(3);
    room.place(rng, &desk(v), Spot::Wall)?;
    room.place(rng, &single("bookshelf", OPEN_M, 0), Spot::Wall)?;
    if rng.chance(0.7) {
        room.place(rng, &desk(v), Spot::Wall);
    }
    if rng.chance(0.5) {
        room.place(rng, &reading(v), Spot::Free);
    }
    add_extras(
        room,
        rng,
        &[
            ("bookshelf", 0.7),
            ("armchair", 0.6),
            ("potted_plant", 0.8),
            ("floor_lamp", 0.6),
            ("tv_stand", 0.3),
        ],
    );
    Some(())
}

/// Furnishes the `nth` living room of a house: in turn as lounge, dining room, library and lounge.
/// Returns `None` if a required piece does not fit.
pub(super) fn living_room(room: &mut RoomPlan, rng: &mut RngStream, nth: usize) -> Option<()> {
    let v = rng.below(8);
    match nth % 4 {
        1 => {
            let tables = [dining(4, v % 3), dining(2, v % 3)];
            place_first(room, rng, &tables, Spot::Free)?;
            add_extras(room, rng, &[("long_sofa", 0.7), ("tv_stand", 0.5), ("bookshelf", 0.4)]);
        }
        2 => {
            room.place(rng, &reading(v % 3), Spot::Free)?;
            room.place(rng, &single("long_sofa", 0.5, v), Spot::Wall);
            add_extras(room, rng, &[("bookshelf", 1.0), ("bookshelf", 0.8), ("tv_stand", 0.3)]);
        }
        _ => {
            let groups = [lounge(rng.chance(0.7), v), lounge(false, v)];
            match place_first(room, rng, &groups, Spot::Wall) {
                Some((side, along_m)) => {
                    // The positions along opposite walls have opposite signs.
                    let tv = single("tv_stand", OPEN_M, v);
                    let shifts = [0.0, 0.3, -0.3, 0.6, -0.6, 1.0, -1.0];
                    shifts.iter().any(|s| room.place_at(&tv, side.opposite(), s - along_m));
                }
                None => {
                    room.place(rng, &single("long_sofa", 0.5, v), Spot::Wall)?;
                    room.place(rng, &single("tv_stand", OPEN_M, v), Spot::Wall);
                }
            }
            add_extras(room, rng, &[("armchair", 0.8), ("bookshelf", 0.4)]);
        }
    }
    add_extras(
        room,
        rng,
        &[("armchair", 0.4), ("potted_plant", 0.8), ("floor_lamp", 0.7), ("potted_plant", 0.3)],
    );
    Some(())
}

/// Adds pieces until the room no longer looks empty.
pub(super) fn fill_room(room: &mut RoomPlan, rng: &mut RngStream, classes: &[&str]) {
    for _ in 0..MAX_FILLERS {
        if room.furnished_fraction() > MAX_FILLED_FRACTION {
            break;
        }
        let class = classes[rng.below(classes.len())];
        add_extras(room, rng, &[(class, 1.0)]);
    }
}

/// Classes that fill living rooms.
pub(super) const LIVING_FILLERS: [&str; 6] =
    ["bookshelf", "armchair", "long_sofa", "potted_plant", "tv_stand", "desk"];
/// Classes that fill offices and bedrooms.
pub(super) const QUIET_FILLERS: [&str; 5] =
    ["bookshelf", "armchair", "potted_plant", "floor_lamp", "desk"];
/// Classes that fill kitchens.
pub(super) const KITCHEN_FILLERS: [&str; 3] = ["kitchen_counter", "stool", "potted_plant"];

/// Furnishes a corridor, which has little space.
pub(super) fn corridor(room: &mut RoomPlan, rng: &mut RngStream) {
    add_extras(room, rng, &[("potted_plant", 0.8), ("potted_plant", 0.5)]);
}

/// Adds a piece that opens to the front; returns whether it fits.
pub(super) fn add_piece(room: &mut RoomPlan, rng: &mut RngStream, class: &str) -> bool {
    room.place(rng, &single(class, OPEN_M, 0), Spot::Wall).is_some()
}
