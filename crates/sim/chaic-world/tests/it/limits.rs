//! Promise: a setup at a limit is accepted, and one beyond it is refused in one line.

use chaic_core::Vec2;
use chaic_core::capability::Persona;
use chaic_core::geom::Rect;
use chaic_world::{Floor, FloorMaterial, Opening, Room, RoomKind, Setup};

use crate::common::{at, hall, person, thing, wall};

fn base() -> Setup {
    let mut setup = hall(vec![], vec![person(Persona::Adult, 0.0, 0.0)]);
    setup.rooms = vec![room()];
    setup
}

fn room() -> Room {
    Room { kind: RoomKind::Office, rect: Rect::new([0.0, 0.0], [4.0, 4.0]) }
}

fn floor(min: [f32; 2], max: [f32; 2]) -> Floor {
    Floor { rect: Rect::new(min, max), material: FloorMaterial::Wood, color: [190, 160, 120] }
}

/// Returns rooms 0.5 m wide over the whole bounds of 200 by 200 m: `n` along z, `n_across` along x.
fn strips(n: usize, n_across: usize) -> Setup {
    let at = |k: usize| 1.5 * k as f32 - 99.0;
    let along = (0..n).map(|k| Rect::new([at(k), -100.0], [at(k) + 0.5, 100.0]));
    let across = (0..n_across).map(|k| Rect::new([-100.0, at(k)], [100.0, at(k) + 0.5]));
    let room = |rect| Room { kind: RoomKind::Office, rect };
    let bounds = Rect::new([-100.0; 2], [100.0; 2]);
    Setup { bounds, rooms: along.chain(across).map(room).collect(), ..base() }
}

/// Checks a list to which `fill` gives a number of entries.
fn check_count(field: &str, max: usize, fill: impl Fn(&mut Setup, usize)) {
    let check = |n: usize| {
        let mut setup = base();
        fill(&mut setup, n);
        setup.check()
    };
    assert_eq!(check(max), Ok(()), "{field}");
    for n in [max + 1, 10 * max] {
        let problem = check(n).expect_err("too many").to_string();
        assert_eq!(problem, format!("{field}: has {n} entries, at most {max}"));
    }
}

#[test]
fn lists_have_a_maximum_length() {
    let bed = thing("bed", at(0.0, 0.0, 0.0));
    let opening = Opening { a: Vec2::ZERO, b: Vec2::X, rooms: [0, 0] };
    let tile = floor([0.0, 0.0], [1.0, 1.0]);
    check_count("rooms", Setup::MAX_ROOMS, |s, n| s.rooms = vec![room(); n]);
    check_count("walls", Setup::MAX_WALLS, |s, n| s.walls = vec![wall([0.0; 2], [1.0; 2]); n]);
    check_count("openings", Setup::MAX_OPENINGS, |s, n| s.openings = vec![opening; n]);
    check_count("floors", Setup::MAX_FLOORS, |s, n| s.floors = vec![tile; n]);
    check_count("things", Setup::MAX_OBJECTS, |s, n| s.things = vec![bed; n]);
    check_count("goal_places", Setup::MAX_OBJECTS, |s, n| {
        s.goal_places = vec![Setup::entity(0); n];
    });
}

#[test]
fn bounds_have_a_maximum_length() {
    let check = |length_m: f32| {
        let bounds = Rect::new([-100.0, -5.0], [length_m - 100.0, 5.0]);
        Setup { bounds, ..base() }.check()
    };
    assert_eq!(check(Setup::MAX_LENGTH_M), Ok(()));
    for length_m in [Setup::MAX_LENGTH_M + 0.5, 1000.0] {
        let problem = check(length_m).expect_err("too long").to_string();
        let expected = format!("bounds (length along x): is {length_m}, expected a number in");
        assert!(problem.starts_with(&expected), "{problem}");
    }
}

#[test]
fn crossing_floors_have_a_maximum_number_of_pieces() {
    // Each of the later strips cuts each of the first ones once.
    let crossing = |n: usize, n_across: usize| {
        let along = (0..n).map(|k| k as f32).map(|x| floor([x, 0.0], [x + 0.5, 501.0]));
        let across = (0..n_across).map(|k| k as f32 + 0.25);
        let across = across.map(|z| floor([-1.0, z], [600.0, z + 0.5]));
        Setup { floors: along.chain(across).collect(), ..base() }
    };
    let mut full = crossing(16, 240);
    assert_eq!(full.check(), Ok(()));
    let pieces = full.floor_pieces().expect("few enough");
    assert_eq!(pieces.len(), Setup::MAX_FLOOR_PIECES);
    full.floors.push(floor([-50.0, -50.0], [-40.0, -40.0]));
    for setup in [full, crossing(500, 500)] {
        assert_eq!(setup.floor_pieces(), None);
        let problem = setup.check().expect_err("too many pieces").to_string();
        assert_eq!(problem, "floors: cut each other into more than 4096 pieces");
    }
}

#[test]
fn ceilings_between_rooms_have_a_maximum_number_of_pieces() {
    let full = strips(63, 63);
    assert_eq!(full.check(), Ok(()));
    let pieces = full.ceiling_pieces().expect("few enough");
    assert_eq!(pieces.len(), full.rooms.len() + Setup::MAX_CEILING_PIECES);
    for (n, n_across) in [(64, 63), (120, 120)] {
        let setup = strips(n, n_across);
        let problem = setup.check().expect_err("too many pieces").to_string();
        let expected = "rooms: cut the ceiling between them into more than 4096 pieces";
        assert_eq!(problem, expected);
        assert_eq!(Setup { ceiling_m: None, ..setup }.check(), Ok(()));
    }
}

#[test]
fn walls_have_a_maximum_total_length() {
    let check = |n: usize| {
        let walls = vec![wall([-1000.0, 0.0], [1000.0, 0.0]); n];
        Setup { walls, ..base() }.check()
    };
    assert_eq!(check(50), Ok(()));
    let problem = check(51).expect_err("too long").to_string();
    assert_eq!(problem, "walls (total length): is 102000, expected a number in [0, 100000]");
}
