//! What belongs into which kind of room, and how it stands together.

use chaic_core::ClassId;
use chaic_core::rng::Stream;

use super::room::{Piece, RoomPlan, Side, Spot};

/// What one stands before to open it, metres.
const OPEN_M: f32 = 0.75;
/// Share of a room's floor under furniture from which it no longer looks empty.
const ENOUGH_FURNITURE: f32 = 0.17;
/// Most pieces that are added to a room so that it doesn't look empty.
const MOST_FILLERS: usize = 5;
/// Between a sofa and its coffee table, metres: a wheelchair passes.
const LOUNGE_GAP_M: f32 = 0.82;

fn size(class: &str) -> [f32; 3] {
    ClassId::named(class).info().size_m
}

/// A single piece with its back to a wall.
fn single(class: &str, access_m: f32, variant: usize) -> Vec<Piece> {
    vec![at(class, 0.0, 0.5 * size(class)[2], 0, access_m, variant)]
}

fn at(class: &str, x: f32, d: f32, turns: u8, access_m: f32, variant: usize) -> Piece {
    Piece { class: ClassId::named(class), x, d, turns, access_m, variant: variant as u8 }
}

/// Pieces side by side along a wall.
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

/// A bed, its head to the wall, with nightstands on the sides that `left` and `right` say.
fn bed(stands: [bool; 2], variant: usize) -> Vec<Piece> {
    let ([bed_w, _, bed_d], [stand_w, _, stand_d]) = (size("bed"), size("nightstand"));
    let mut pieces = vec![at("bed", 0.0, 0.5 * bed_d, 0, 0.0, variant)];
    for (sign, wanted) in [(-1.0, stands[0]), (1.0, stands[1])] {
        if wanted {
            let x = sign * (0.5 * (bed_w + stand_w) + 0.05);
            pieces.push(at("nightstand", x, 0.5 * stand_d, 0, 0.0, 0));
        }
    }
    pieces
}

/// A table with up to four chairs on its long sides; its ends stay free, so that what lies on it
/// can be got at.
fn dining(chairs: usize, variant: usize) -> Vec<Piece> {
    let ([w, _, d], [_, _, chair_d]) = (size("dining_table"), size("side_chair"));
    let out = 0.5 * d + 0.5 * chair_d + 0.03;
    // A chair at turn 0 looks into the room (-z); this one stands nearer to the wall.
    let places =
        [(-0.25 * w, -out, 0), (0.25 * w, out, 2), (0.25 * w, -out, 0), (-0.25 * w, out, 2)];
    let mut pieces = vec![at("dining_table", 0.0, 0.0, 0, 0.0, variant)];
    for (x, d, turns) in places.into_iter().take(chairs) {
        pieces.push(at("side_chair", x, d, turns, 0.0, 0));
    }
    pieces
}

/// A desk against the wall with its chair.
fn desk(variant: usize) -> Vec<Piece> {
    let ([_, _, d], [_, _, chair_d]) = (size("desk"), size("side_chair"));
    vec![
        at("desk", 0.0, 0.5 * d, 0, 0.0, variant),
        at("side_chair", -0.15, d + 0.03 + 0.5 * chair_d, 2, 0.0, 0),
    ]
}

/// A sofa against the wall, a coffee table before it, on a rug if wanted.
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

/// Two armchairs that face each other across a coffee table.
fn reading(variant: usize) -> Vec<Piece> {
    let ([table_w, _, _], [_, _, chair_d]) = (size("coffee_table"), size("armchair"));
    let x = 0.5 * table_w + 0.5 * chair_d + 0.3;
    vec![
        at("coffee_table", 0.0, 0.0, 0, 0.0, variant),
        at("armchair", -x, 0.0, 3, 0.0, variant),
        at("armchair", x, 0.0, 1, 0.0, variant),
    ]
}

/// Tries groups in turn until one finds a place.
fn first_of(
    room: &mut RoomPlan,
    rng: &mut Stream,
    groups: &[Vec<Piece>],
    spot: Spot,
) -> Option<(Side, f32)> {
    groups.iter().find_map(|g| room.place(rng, g, spot))
}

/// How many pieces of a class a room has at most, however empty it is.
fn most_of(class: &str) -> usize {
    match class {
        "tv_stand" => 1,
        "stool" | "floor_lamp" | "long_sofa" | "potted_plant" => 2,
        _ => 3,
    }
}

/// Small things that fill corners and walls, as many as find a place.
fn extras(room: &mut RoomPlan, rng: &mut Stream, classes: &[(&str, f32)]) {
    for (class, chance) in classes {
        if rng.chance(*chance) && room.count(class) < most_of(class) {
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

/// Furnishes a bedroom; `None` if what it must have finds no place.
pub(super) fn bedroom(room: &mut RoomPlan, rng: &mut Stream) -> Option<()> {
    let v = rng.below(8);
    let beds =
        [bed([true, true], v), bed([true, false], v), bed([false, true], v), bed([false; 2], v)];
    first_of(room, rng, &beds, Spot::Wall)?;
    room.place(rng, &single("wardrobe", OPEN_M, 0), Spot::Wall)?;
    if rng.chance(0.6) {
        let pieces = desk(v % 3);
        room.place(rng, &pieces, Spot::Wall);
    }
    extras(
        room,
        rng,
        &[("armchair", 0.6), ("potted_plant", 0.7), ("floor_lamp", 0.7), ("bookshelf", 0.3)],
    );
    Some(())
}

/// Furnishes a kitchen.
pub(super) fn kitchen(room: &mut RoomPlan, rng: &mut Stream) -> Option<()> {
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
    first_of(room, rng, &rows, Spot::Wall)?;
    let dv = rng.below(3);
    let tables = [dining(4, dv), dining(2, dv)];
    first_of(room, rng, &tables, Spot::Free)?;
    extras(
        room,
        rng,
        &[("kitchen_counter", 0.7), ("potted_plant", 0.5), ("stool", 0.5), ("stool", 0.4)],
    );
    Some(())
}

/// Furnishes an office.
pub(super) fn office(room: &mut RoomPlan, rng: &mut Stream) -> Option<()> {
    let v = rng.below(3);
    room.place(rng, &desk(v), Spot::Wall)?;
    room.place(rng, &single("bookshelf", OPEN_M, 0), Spot::Wall)?;
    if rng.chance(0.7) {
        room.place(rng, &desk(v), Spot::Wall);
    }
    if rng.chance(0.5) {
        room.place(rng, &reading(v), Spot::Free);
    }
    extras(
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

/// Furnishes the `nth` living room of a house: a lounge, a dining room, a library, a lounge again.
pub(super) fn living_room(room: &mut RoomPlan, rng: &mut Stream, nth: usize) -> Option<()> {
    let v = rng.below(8);
    match nth % 4 {
        1 => {
            let tables = [dining(4, v % 3), dining(2, v % 3)];
            first_of(room, rng, &tables, Spot::Free)?;
            extras(room, rng, &[("long_sofa", 0.7), ("tv_stand", 0.5), ("bookshelf", 0.4)]);
        }
        2 => {
            room.place(rng, &reading(v % 3), Spot::Free)?;
            room.place(rng, &single("long_sofa", 0.5, v), Spot::Wall);
            extras(room, rng, &[("bookshelf", 1.0), ("bookshelf", 0.8), ("tv_stand", 0.3)]);
        }
        _ => {
            let groups = [lounge(rng.chance(0.7), v), lounge(false, v)];
            match first_of(room, rng, &groups, Spot::Wall) {
                Some((side, along_m)) => {
                    // Opposite walls count their length in opposite directions.
                    let tv = single("tv_stand", OPEN_M, v);
                    let shifts = [0.0, 0.3, -0.3, 0.6, -0.6, 1.0, -1.0];
                    shifts.iter().any(|s| room.place_at(&tv, side.opposite(), s - along_m));
                }
                None => {
                    room.place(rng, &single("long_sofa", 0.5, v), Spot::Wall)?;
                    room.place(rng, &single("tv_stand", OPEN_M, v), Spot::Wall);
                }
            }
            extras(room, rng, &[("armchair", 0.8), ("bookshelf", 0.4)]);
        }
    }
    extras(
        room,
        rng,
        &[("armchair", 0.4), ("potted_plant", 0.8), ("floor_lamp", 0.7), ("potted_plant", 0.3)],
    );
    Some(())
}

/// Adds pieces to a room that would look empty: large rooms hold more.
pub(super) fn fill(room: &mut RoomPlan, rng: &mut Stream, classes: &[&str]) {
    for _ in 0..MOST_FILLERS {
        if room.furnished_share() > ENOUGH_FURNITURE {
            break;
        }
        let class = classes[rng.below(classes.len())];
        extras(room, rng, &[(class, 1.0)]);
    }
}

/// Pieces with which the living rooms of a house are filled.
pub(super) const LIVING_FILLERS: [&str; 6] =
    ["bookshelf", "armchair", "long_sofa", "potted_plant", "tv_stand", "desk"];
/// The same for offices and bedrooms.
pub(super) const QUIET_FILLERS: [&str; 5] =
    ["bookshelf", "armchair", "potted_plant", "floor_lamp", "desk"];
/// The same for kitchens.
pub(super) const KITCHEN_FILLERS: [&str; 3] = ["kitchen_counter", "stool", "potted_plant"];

/// Furnishes a corridor, which has little room.
pub(super) fn corridor(room: &mut RoomPlan, rng: &mut Stream) {
    extras(room, rng, &[("potted_plant", 0.8), ("potted_plant", 0.5)]);
}

/// One more piece that opens to the front.
pub(super) fn add(room: &mut RoomPlan, rng: &mut Stream, class: &str) -> bool {
    room.place(rng, &single(class, OPEN_M, 0), Spot::Wall).is_some()
}
