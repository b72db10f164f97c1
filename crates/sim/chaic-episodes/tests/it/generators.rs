//! The generators: every seed gives a valid episode, the same one each time, with the properties
//! stated by the paper and the original's facts. `examples/soak.rs` checks more seeds.

use std::collections::BTreeMap;

use chaic_core::capability::Persona;
use chaic_core::geom::to_xz;
use chaic_core::{ClassId, Role, TaskId};
use chaic_episodes::{Episode, GeneratorSeeds, Split, episodes, generate, validate};
use chaic_world::{ObjectSpec, RoomKind, Setup};

const SEEDS: u64 = 60;

fn setups(task: TaskId) -> impl Iterator<Item = Setup> {
    (0..SEEDS).map(move |seed| {
        generate(task, GeneratorSeeds { place: seed, episode: 7_000 + seed })
            .expect("every seed has an episode")
    })
}

fn count(setup: &Setup, is_counted: impl Fn(&ObjectSpec) -> bool) -> usize {
    setup.things.iter().filter(|t| is_counted(t)).count()
}

fn named(name: &str) -> impl Fn(&ObjectSpec) -> bool {
    let class = ClassId::named(name);
    move |t| t.class == class
}

fn is_movable_target(object: &ObjectSpec) -> bool {
    matches!(object.class.info().role, Role::Target | Role::Fragile) && !object.fixed
}

fn top_m(object: &ObjectSpec) -> f32 {
    object.position.y + object.size_m().y
}

#[test]
fn generated_episodes_are_valid_and_round_trip() {
    for task in TaskId::all() {
        for seed in 0..SEEDS {
            let episode = episodes(&Split::Generated(seed..seed + 1), task)
                .next()
                .expect("one seed, one episode")
                .expect("every seed has an episode");
            assert_eq!(validate(episode.setup()), [], "{}", episode.id());
            let text = episode.to_json();
            let again = Episode::parse(text.as_bytes(), "again").expect("its own file is valid");
            assert_eq!(again, episode);
            assert_eq!(again.to_json(), text);
        }
    }
}

#[test]
fn a_world_can_be_created_for_every_task() {
    for task in TaskId::all() {
        for setup in setups(task).take(6) {
            let world = chaic_world::World::new(setup, chaic_world::Rules::paper());
            assert!(world.expect("a valid setup is a world").waiting().len() >= 2, "{task}");
        }
    }
}

#[test]
fn equal_seeds_give_equal_bytes_and_others_differ() {
    for task in TaskId::all() {
        let make = |place, episode| {
            let setup = generate(task, GeneratorSeeds { place, episode })
                .expect("every seed has an episode");
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
        let setup = generate(task, GeneratorSeeds { place: 5, episode: 9 })
            .expect("every seed has an episode");
        setup.things.into_iter().filter(|t| t.fixed).collect::<Vec<_>>()
    };
    assert_eq!(furniture(TaskId::NoConstraint), furniture(TaskId::HighGoal));
    assert_eq!(furniture(TaskId::NoConstraint), furniture(TaskId::Obstacle));
}

#[test]
fn indoor_goals_are_one_complete_set_and_one_more_object() {
    for task in TaskId::all().take(6) {
        for setup in setups(task) {
            let vases = if task == TaskId::HighTarget { 2 } else { 0 };
            assert_eq!(count(&setup, is_movable_target), 31 + vases, "{task}");
            let total = setup.goal.total() as usize;
            assert!((8 + vases..=10 + vases).contains(&total), "{task}: {total}");
            assert_eq!(setup.goal.count(ClassId::named("vase")) as usize, vases);
            let sets = task.info().sets;
            let complete = sets.iter().filter(|set| {
                let all = setup.things.iter().filter(|t| t.class.info().sets.contains(set));
                let targets =
                    setup.goal.targets.iter().filter(|(c, _)| c.info().sets.contains(set));
                all.count() as u32 == targets.map(|(_, n)| n).sum::<u32>()
            });
            assert_eq!(complete.count(), 1, "{task}: {:?}", setup.goal);
            let is_container = |t: &ObjectSpec| t.class.info().role == Role::Container;
            let expected = if task == TaskId::HighContainer { 3..=6 } else { 6..=6 };
            assert!(expected.contains(&count(&setup, is_container)), "{task}");
        }
    }
}

#[test]
fn tasks_have_their_difficulties() {
    for setup in setups(TaskId::LowTarget) {
        assert_eq!(count(&setup, |t| is_movable_target(t) && t.position.y == 0.0), 16);
    }
    for setup in setups(TaskId::HighTarget) {
        let high = |t: &ObjectSpec| is_movable_target(t) && t.position.y > 1.5;
        assert!((8..=15).contains(&count(&setup, high)), "{}", count(&setup, high));
        assert_eq!(count(&setup, |t| high(t) && named("vase")(t)), 1);
        let is_target = |t: &&ObjectSpec| high(t) && setup.goal.count(t.class) > 0;
        let classes: std::collections::BTreeSet<ClassId> =
            setup.things.iter().filter(is_target).map(|t| t.class).collect();
        assert!(classes.len() >= 3, "two classes and the vase: {classes:?}");
    }
    for setup in setups(TaskId::HighContainer) {
        let is_container = |t: &ObjectSpec| t.class.info().role == Role::Container;
        assert_eq!(count(&setup, |t| is_container(t) && t.position.y < 1.5), 0);
    }
    for setup in setups(TaskId::HighGoal) {
        let places = setup.goal_places.iter().filter_map(|e| setup.object(*e));
        assert!(places.into_iter().all(|t| top_m(t) >= 1.5));
    }
}

/// A walker fits past an obstacle, a wheelchair does not.
#[test]
fn obstacles_block_wheelchairs_only() {
    for setup in setups(TaskId::Obstacle) {
        let obstacles: Vec<&ObjectSpec> =
            setup.things.iter().filter(|t| t.class.info().role == Role::Obstacle).collect();
        assert!((3..=5).contains(&obstacles.len()));
        assert_eq!(setup.people[0].persona, Persona::Wheelchair);
        for obstacle in obstacles {
            let p = to_xz(obstacle.position);
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
                            to_xz(b.center + turn * corner)
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
fn people_start_at_various_distances() {
    let mut distances: Vec<f32> = Vec::new();
    for setup in setups(TaskId::NoConstraint) {
        let at = |i: usize| to_xz(setup.people[i].pose.position);
        distances.push(at(0).distance(at(1)));
    }
    distances.sort_by(f32::total_cmp);
    let median = distances[distances.len() / 2];
    assert!(distances[0] >= 0.7 && (3.0..=12.0).contains(&median), "{distances:?}");
}

#[test]
fn shops_have_their_stock() {
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
        assert_eq!(count(&setup, is_movable_target), 33);
        assert_eq!(count(&setup, |t| t.class.info().role == Role::Container), 3);
        assert_eq!(setup.goal.total(), [13, 11, 12][(seed % 3) as usize]);
        assert_eq!(count(&setup, named("tent")), 6);
        assert_eq!(count(&setup, named("wood_shelving")), 12);
        let at = |i: usize| to_xz(setup.people[i].pose.position);
        assert!(at(0).distance(at(1)) > 5.0 && (at(0).distance(at(2)) - 1.414).abs() < 0.01);
        assert_eq!(setup.people[2].persona, Persona::Child);
    }
}

#[test]
fn moving_house_has_five_pieces_and_a_truck() {
    for setup in setups(TaskId::MovingHouse) {
        let is_piece = |t: &ObjectSpec| t.class.info().role == Role::HeavyTarget && !t.fixed;
        assert_eq!(count(&setup, is_piece), 5);
        assert_eq!(setup.goal.total(), 5);
        assert_eq!(setup.horizon, 1500);
        let truck = setup.object(setup.goal_places[0]).expect("checked by validate");
        assert_eq!(truck.class.name(), "truck");
        for piece in setup.things.iter().filter(|t| is_piece(t)) {
            let away = to_xz(piece.position).distance(to_xz(truck.position));
            assert!((8.0..17.0).contains(&away), "{away}");
        }
    }
}
