//! Promises of the generators: every seed gives a valid episode, the same one each time, with what
//! the paper and the original's facts say of it. `examples/soak.rs` does the same for longer.

use std::collections::BTreeMap;

use chaic_core::capability::Persona;
use chaic_core::geom::xz;
use chaic_core::{ClassId, Role, TaskId};
use chaic_episodes::{Episode, Seeds, Split, episodes, generate, validate};
use chaic_world::{RoomKind, Setup, Thing};

const SEEDS: u64 = 60;

fn setups(task: TaskId) -> impl Iterator<Item = Setup> {
    (0..SEEDS).map(move |seed| {
        generate(task, Seeds { place: seed, episode: 7_000 + seed }).expect("every seed works")
    })
}

fn count(setup: &Setup, is_counted: impl Fn(&Thing) -> bool) -> usize {
    setup.things.iter().filter(|t| is_counted(t)).count()
}

fn named(name: &str) -> impl Fn(&Thing) -> bool {
    let class = ClassId::named(name);
    move |t| t.class == class
}

fn is_loose_good(thing: &Thing) -> bool {
    matches!(thing.class.info().role, Role::Target | Role::Fragile) && !thing.fixed
}

fn top_m(thing: &Thing) -> f32 {
    thing.position.y + thing.size_m().y
}

#[test]
fn every_task_gives_valid_episodes_that_read_back() {
    for task in TaskId::all() {
        for seed in 0..SEEDS {
            let episode = episodes(&Split::Generated(seed..seed + 1), task)
                .next()
                .expect("one seed, one episode")
                .expect("every seed works");
            assert_eq!(validate(episode.setup()), [], "{}", episode.id());
            let text = episode.to_json();
            let again = Episode::parse(text.as_bytes(), "again").expect("it reads back");
            assert_eq!(again, episode);
            assert_eq!(again.to_json(), text);
        }
    }
}

#[test]
fn a_world_can_begin_from_every_task() {
    for task in TaskId::all() {
        for setup in setups(task).take(6) {
            let world = chaic_world::World::new(setup, chaic_world::Rules::paper());
            assert!(world.expect("a valid setup is a world").waiting().len() >= 2, "{task}");
        }
    }
}

#[test]
fn the_same_seeds_give_the_same_bytes_and_others_do_not() {
    for task in TaskId::all() {
        let make = |place, episode| {
            let setup = generate(task, Seeds { place, episode }).expect("every seed works");
            Episode::new("x", "test", None, setup).expect("it is valid").to_json()
        };
        assert_eq!(make(3, 4), make(3, 4), "{task}");
        assert_ne!(make(3, 4), make(3, 5), "{task}");
        assert_ne!(make(3, 4), make(2, 4), "{task}");
    }
}

#[test]
fn houses_have_six_to_eight_rooms_of_the_right_kinds() {
    let mut corridors = 0;
    for setup in setups(TaskId::NoConstraint) {
        assert!((6..=8).contains(&setup.rooms.len()));
        let rooms = |kind| setup.rooms.iter().filter(|r| r.kind == kind).count();
        assert_eq!((rooms(RoomKind::Kitchen), rooms(RoomKind::Bedroom)), (1, 1));
        assert!((1..=2).contains(&rooms(RoomKind::Office)));
        assert!((2..=4).contains(&rooms(RoomKind::LivingRoom)));
        corridors += rooms(RoomKind::Corridor);
        assert_eq!(count(&setup, named("bed")), 1);
        assert!((3..=4).contains(&count(&setup, named("cabinet"))));
        assert!((1..=2).contains(&count(&setup, named("refrigerator"))));
        let tree = setup.rooms.len() - 1;
        assert!((tree..=tree + 2).contains(&setup.openings.len()));
        for opening in &setup.openings {
            assert!((opening.a.distance(opening.b) - 1.2).abs() < 0.01);
        }
    }
    assert!(corridors > 0, "some houses have a corridor");
}

#[test]
fn houses_of_one_place_are_shared_by_all_indoor_tasks() {
    let furniture = |task| {
        let setup = generate(task, Seeds { place: 5, episode: 9 }).expect("every seed works");
        setup.things.into_iter().filter(|t| t.fixed).collect::<Vec<_>>()
    };
    assert_eq!(furniture(TaskId::NoConstraint), furniture(TaskId::HighGoal));
    assert_eq!(furniture(TaskId::NoConstraint), furniture(TaskId::Obstacle));
}

#[test]
fn indoor_goals_are_one_set_and_one_more() {
    for task in TaskId::all().take(6) {
        for setup in setups(task) {
            let vases = if task == TaskId::HighTarget { 2 } else { 0 };
            assert_eq!(count(&setup, is_loose_good), 31 + vases, "{task}");
            let total = setup.goal.total() as usize;
            assert!((8 + vases..=10 + vases).contains(&total), "{task}: {total}");
            assert_eq!(setup.goal.wanted(ClassId::named("vase")) as usize, vases);
            let sets = task.info().sets;
            let complete = sets.iter().filter(|set| {
                let all = setup.things.iter().filter(|t| t.class.info().sets.contains(set));
                let wanted = setup.goal.targets.iter().filter(|(c, _)| c.info().sets.contains(set));
                all.count() as u32 == wanted.map(|(_, n)| n).sum::<u32>()
            });
            assert_eq!(complete.count(), 1, "{task}: {:?}", setup.goal);
            let is_container = |t: &Thing| t.class.info().role == Role::Container;
            let expected = if task == TaskId::HighContainer { 3..=6 } else { 6..=6 };
            assert!(expected.contains(&count(&setup, is_container)), "{task}");
        }
    }
}

#[test]
fn what_makes_a_task_hard_is_there() {
    for setup in setups(TaskId::LowTarget) {
        assert_eq!(count(&setup, |t| is_loose_good(t) && t.position.y == 0.0), 16);
    }
    for setup in setups(TaskId::HighTarget) {
        let high = |t: &Thing| is_loose_good(t) && t.position.y > 1.5;
        assert!((8..=15).contains(&count(&setup, high)), "{}", count(&setup, high));
        assert_eq!(count(&setup, |t| high(t) && named("vase")(t)), 1);
        let is_target = |t: &&Thing| high(t) && setup.goal.wanted(t.class) > 0;
        let classes: std::collections::BTreeSet<ClassId> =
            setup.things.iter().filter(is_target).map(|t| t.class).collect();
        assert!(classes.len() >= 3, "two classes and the vase: {classes:?}");
    }
    for setup in setups(TaskId::HighContainer) {
        let is_container = |t: &Thing| t.class.info().role == Role::Container;
        assert_eq!(count(&setup, |t| is_container(t) && t.position.y < 1.5), 0);
    }
    for setup in setups(TaskId::HighGoal) {
        let places = setup.goal_places.iter().filter_map(|e| setup.thing(*e));
        assert!(places.into_iter().all(|t| top_m(t) >= 1.5));
    }
}

/// A wheelchair must not fit through where an obstacle stands; whoever walks must.
#[test]
fn obstacles_close_doorways_to_wheelchairs_alone() {
    for setup in setups(TaskId::Obstacle) {
        let obstacles: Vec<&Thing> =
            setup.things.iter().filter(|t| t.class.info().role == Role::Obstacle).collect();
        assert!((3..=5).contains(&obstacles.len()));
        assert_eq!(setup.people[0].persona, Persona::Wheelchair);
        for obstacle in obstacles {
            let p = xz(obstacle.position);
            let opening = setup
                .openings
                .iter()
                .min_by(|a, b| {
                    let d = |o: &chaic_world::Opening| p.distance(0.5 * (o.a + o.b));
                    d(a).total_cmp(&d(b))
                })
                .expect("a house has doorways");
            let along = (opening.b - opening.a).normalize();
            let blocks = chaic_world::blocks_of(obstacle);
            let reach = |sign: f32| {
                let ends = blocks.iter().flat_map(|b| {
                    let turn = chaic_core::geom::yaw_rotation(b.yaw_rad);
                    [-1.0, 1.0].into_iter().flat_map(move |x| {
                        [-1.0, 1.0].map(|z| {
                            let corner = glam::Vec3::new(x * b.half.x, 0.0, z * b.half.z);
                            xz(b.center + turn * corner)
                        })
                    })
                });
                ends.map(|q| sign * (q - opening.a).dot(along)).fold(f32::MIN, f32::max)
            };
            let gaps = [-reach(-1.0), 1.2 - reach(1.0)];
            let widest = gaps[0].max(gaps[1]);
            assert!((0.50..=0.665).contains(&widest), "{gaps:?}");
        }
    }
}

#[test]
fn people_start_apart_and_far_apart_at_times() {
    let mut distances: Vec<f32> = Vec::new();
    for setup in setups(TaskId::NoConstraint) {
        let at = |i: usize| xz(setup.people[i].pose.position);
        distances.push(at(0).distance(at(1)));
    }
    distances.sort_by(f32::total_cmp);
    let median = distances[distances.len() / 2];
    assert!(distances[0] >= 0.7 && (3.0..=12.0).contains(&median), "{distances:?}");
}

#[test]
fn shops_sell_exactly_what_they_should() {
    let stock: BTreeMap<&str, usize> = [
        ("apple", 3),
        ("orange", 3),
        ("shop_banana", 3),
        ("grape", 3),
        ("loaf_bread", 3),
        ("croissant", 3),
        ("burger", 2),
        ("pink_donut", 2),
        ("pepsi_can", 2),
        ("sprite_can", 3),
        ("fanta_can", 3),
        ("cocacola_can", 3),
    ]
    .into();
    for (seed, setup) in (7_000..).zip(setups(TaskId::Shopping)) {
        for (name, n) in &stock {
            assert_eq!(count(&setup, |t| named(name)(t) && !t.fixed), *n, "{name}");
        }
        assert_eq!(count(&setup, is_loose_good), 33);
        assert_eq!(count(&setup, |t| t.class.info().role == Role::Container), 3);
        assert_eq!(setup.goal.total(), [13, 11, 12][(seed % 3) as usize]);
        assert_eq!(count(&setup, named("tent")), 6);
        assert_eq!(count(&setup, named("wood_shelving")), 12);
        let at = |i: usize| xz(setup.people[i].pose.position);
        assert!(at(0).distance(at(1)) > 5.0 && (at(0).distance(at(2)) - 1.414).abs() < 0.01);
        assert_eq!(setup.people[2].persona, Persona::Child);
    }
}

#[test]
fn five_pieces_wait_for_the_truck() {
    for setup in setups(TaskId::MovingHouse) {
        let is_piece = |t: &Thing| t.class.info().role == Role::HeavyTarget && !t.fixed;
        assert_eq!(count(&setup, is_piece), 5);
        assert_eq!(setup.goal.total(), 5);
        assert_eq!(setup.horizon, 1500);
        let truck = setup.thing(setup.goal_places[0]).expect("checked by validate");
        assert_eq!(truck.class.name(), "truck");
        for piece in setup.things.iter().filter(|t| is_piece(t)) {
            let away = xz(piece.position).distance(xz(truck.position));
            assert!((8.0..17.0).contains(&away), "{away}");
        }
    }
}
