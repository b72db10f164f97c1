//! Houses whose inventory does not reveal the task: every indoor task gets the objects of all
//! tasks.
//!
//! The counts of an episode ([`Inventory`]) are drawn independently of the task. Only task-relevant
//! properties differ: which of the high or low objects are targets, how many containers are high,
//! whether obstacles stand in doorways, and which refrigerators are the goal place.
//! `docs/episodes.md` documents this for users.

use std::f32::consts::TAU;

use chaic_core::briefing::Goal;
use chaic_core::geom::to_xz;
use chaic_core::rng::RngStream;
use chaic_core::task::{Arrangement, GoalTop};
use chaic_core::{ClassId, EntityId, TaskId};
use chaic_world::{ObjectSpec, Setup};

use super::objects::{VASES, containers, draw_objects_and_goal};
use super::populate::{Contents, MIN_HIGH_CLASSES, Scene, assemble, draw_people};
use super::room::RoomPlan;
use super::slots::{HIGH_M, HighTop};
use super::{House, doorway_obstacles, recipes, slots, wall_obstacles};

/// Number of cabinets; objects lie on all of them. The paper's houses have three or four: four have
/// room for four containers and seven objects.
pub(super) const CABINETS: usize = 4;
/// Class of the furniture whose tops hold high objects indoors (ours: objects on the goal place
/// could be delivered without a step).
const HIGH_HOST: &str = "cabinet";
/// Class of the goal place of all indoor tasks. Ours: the paper's high goal places are cabinets and
/// refrigerators, but a class that is disclosed must not reveal the task.
const GOAL_CLASS: &str = "refrigerator";
/// Height of refrigerators relative to the catalogue's: 2.05 m. Most high goal places of the paper
/// are cabinets of this height, so the task is equally hard.
const TALL_SCALE: f32 = 1.15;
/// Height of the low refrigerator relative to the catalogue's: 0.85 m, as high as a kitchen
/// counter.
const LOW_SCALE: f32 = 0.48;
/// Position of a container on a high top as a fraction of its half length: at one end.
const CONTAINER_U: f32 = -1.0;
/// Positions of objects beside a container.
const BESIDE_U: [f32; 2] = [0.2, 0.75];
/// Positions of objects on a high top without a container.
const ALONE_U: [f32; 3] = [-0.66, 0.0, 0.66];
/// Attempts per object on a high top.
const MAX_ATTEMPTS: usize = 6;

/// Object counts of a house, independent of the task.
#[derive(Clone, Copy, Debug)]
struct Inventory {
    /// Objects on the floor, 7 to 9: few enough to leave a choice of distractors.
    n_floor: usize,
    /// Objects on high tops besides one vase, 5 or 6.
    n_high: usize,
    /// Containers on high tops, 1 to 4, in tasks that are not about them.
    n_containers_high: usize,
    /// Obstacles, 5 to 7: up to 5 stand in doorways in the obstacle task.
    n_obstacles: usize,
}

impl Inventory {
    /// Draws the counts from the episode seed only. All tasks and attempts get the same, so that no
    /// task prefers counts that are easier to place.
    fn new(seed: u64) -> Inventory {
        let mut rng = RngStream::new(seed, "decoys/inventory", 0);
        Inventory {
            n_floor: 7 + rng.below(3),
            n_high: 5 + rng.below(2),
            n_containers_high: 1 + rng.below(CABINETS),
            n_obstacles: 5 + rng.below(3),
        }
    }
}

/// Objects that may be selected for a location.
#[derive(Clone, Copy, Debug)]
enum Selection {
    /// Targets and distractors: the partner can reach them there.
    Any,
    /// Distractors only: the partner cannot reach them, and the task is not about reach.
    Distractors,
    /// This number of targets: the task is that the partner cannot reach them.
    Targets(usize),
}

/// Makes the refrigerators of a house tall, and adds a low one in the first room that has space.
pub(super) fn refrigerators(
    rooms: &mut [RoomPlan],
    order: &[usize],
    rng: &mut RngStream,
) -> Result<(), &'static str> {
    let things = rooms.iter_mut().flat_map(|r| &mut r.things);
    things.filter(|t| t.class.name() == GOAL_CLASS).for_each(|t| t.scale[1] = TALL_SCALE);
    let room = order.iter().find(|i| recipes::add_piece(&mut rooms[**i], rng, GOAL_CLASS));
    let added = room.and_then(|i| rooms[*i].things.last_mut());
    added.ok_or("no room for the low refrigerator")?.scale[1] = LOW_SCALE;
    Ok(())
}

/// Creates an episode with decoys in this house, or returns the reason for failure.
pub(super) fn setup(
    house: &House,
    task: TaskId,
    seed: u64,
    attempt: u64,
) -> Result<Setup, &'static str> {
    let stream = |purpose: &str| RngStream::new(seed, &format!("{task}/decoys/{purpose}"), attempt);
    let inventory = Inventory::new(seed);
    // Objects on the floor and the people keep clear of the obstacles beside walls.
    let mut house = house.clone();
    let mut at_walls =
        wall_obstacles::obstacles(&mut house, inventory.n_obstacles, &mut stream("obstacles"))
            .ok_or("no room for the obstacles")?;
    let people =
        draw_people(&house, task, &mut stream("people")).ok_or("no room for the people")?;
    let goal_places = goal_places(&house, task);
    let mut placed = Vec::new();
    if task.info().arrangement == Arrangement::Obstacles {
        let first = goal_places.first().ok_or("the house has no goal place")?;
        let goal = house.furniture[usize::from(first.0 - EntityId::FIRST_OBJECT.0)].position;
        let partner = to_xz(people[0].pose.position);
        placed =
            doorway_obstacles::obstacles(&house, partner, to_xz(goal), &mut stream("doorways"))
                .ok_or("obstacles block too little")?;
        at_walls.truncate(inventory.n_obstacles - placed.len());
    }
    placed.extend(at_walls);
    let mut scene = Scene { house: &house, rng: stream("places"), placed };
    let drawn = draw_objects_and_goal(task, &mut stream("goods"));
    scene.place_with_decoys(task, inventory, drawn.objects, &drawn.goal)?;
    Ok(assemble(
        &house,
        task,
        seed,
        Contents { placed: scene.placed, people, goal: drawn.goal, goal_places },
    ))
}

/// Returns the tall refrigerators if the goal is high, else all refrigerators.
fn goal_places(house: &House, task: TaskId) -> Vec<EntityId> {
    let is_any = task.info().goal_top == GoalTop::Any;
    let is_goal = |k: &usize| {
        let object = &house.furniture[*k];
        let is_high = object.position.y + object.size_m().y >= HIGH_M;
        object.class.name() == GOAL_CLASS && (is_high || is_any)
    };
    (0..house.furniture.len()).filter(is_goal).map(Setup::entity).collect()
}

/// Returns the selection for high tops and for the floor, given the task's partner.
fn draw_selections(task: TaskId, goal: &Goal, rng: &mut RngStream) -> [Selection; 2] {
    let info = task.info();
    let [lowest_m, highest_m] = info.partner.capability().pick_range_m;
    let high = match info.arrangement {
        // A third to a half of the targets, as in the paper's houses.
        Arrangement::HighTargets => Selection::Targets(3 + rng.below(2)),
        _ if highest_m < HIGH_M + 1.0 => Selection::Distractors,
        _ => Selection::Any,
    };
    let floor = match info.arrangement {
        // Half of the targets, as in the paper's houses.
        Arrangement::LowTargets => Selection::Targets(goal.total().div_ceil(2) as usize),
        _ if lowest_m > 0.0 => Selection::Distractors,
        _ => Selection::Any,
    };
    [high, floor]
}

/// Removes `n` suitable objects and returns them in random order; `None` if there are too few.
fn select_objects(
    objects: &mut Vec<ClassId>,
    goal: &Goal,
    n: usize,
    selection: Selection,
    rng: &mut RngStream,
) -> Option<Vec<ClassId>> {
    let mut left = match selection {
        // Any mix of targets and distractors.
        Selection::Any => [n, n],
        Selection::Distractors => [0, n],
        Selection::Targets(n_targets) => [n_targets.min(n), n - n_targets.min(n)],
    };
    let (mut taken, mut kept) = (Vec::new(), Vec::new());
    for class in objects.drain(..) {
        let left = &mut left[usize::from(goal.count(class) == 0)];
        if *left > 0 && taken.len() < n {
            *left -= 1;
            taken.push(class);
        } else {
            kept.push(class);
        }
    }
    *objects = kept;
    rng.shuffle(&mut taken);
    (taken.len() == n).then_some(taken)
}

impl Scene<'_> {
    fn place_with_decoys(
        &mut self,
        task: TaskId,
        inventory: Inventory,
        mut objects: Vec<ClassId>,
        goal: &Goal,
    ) -> Result<(), &'static str> {
        let too_few = "too few distractors";
        let [high, floor] = draw_selections(task, goal, &mut self.rng);
        let rng = &mut self.rng;
        let mut up =
            select_objects(&mut objects, goal, inventory.n_high, high, rng).ok_or(too_few)?;
        let down =
            select_objects(&mut objects, goal, inventory.n_floor, floor, rng).ok_or(too_few)?;
        let mut targets: Vec<ClassId> = up.iter().copied().filter(|c| goal.count(*c) > 0).collect();
        targets.sort();
        targets.dedup();
        let arrangement = task.info().arrangement;
        if arrangement == Arrangement::HighTargets && targets.len() < MIN_HIGH_CLASSES {
            return Err("too few target classes are high");
        }
        let vase = ClassId::named("vase");
        up.insert(rng.below(up.len() + 1), vase);
        objects.extend(std::iter::repeat_n(vase, VASES - 1));
        rng.shuffle(&mut objects);
        let n_high = match arrangement {
            Arrangement::HighContainers => CABINETS,
            _ => inventory.n_containers_high,
        };
        let low_containers = self.place_high(n_high, &up)?;
        let mut low = slots::low(self.house);
        self.rng.shuffle(&mut low);
        self.place_low(&low_containers, &mut low, 0.0).ok_or("no room for the containers")?;
        self.place_on_floor(&down)?;
        self.place_low(&objects, &mut low, TAU).ok_or("no room for the objects")
    }

    /// Fills the high tops with `n_high` containers, one each, and these objects; returns the
    /// remaining containers.
    fn place_high(
        &mut self,
        n_high: usize,
        objects: &[ClassId],
    ) -> Result<Vec<ClassId>, &'static str> {
        let mut tops: Vec<HighTop> = slots::high(self.house);
        tops.retain(|top| top.class.name() == HIGH_HOST);
        self.rng.shuffle(&mut tops);
        let (mut places, mut left) = (Vec::new(), Vec::new());
        let mut free = tops.iter();
        for class in containers(&mut self.rng, 6) {
            if places.len() == n_high * BESIDE_U.len() {
                left.push(class);
                continue;
            }
            let top = free.next().ok_or("no room for the containers on high tops")?;
            match top.middle.along(CONTAINER_U).place(self.house, class, 0.0, &self.placed) {
                Some(object) => {
                    self.push(object);
                    places.extend(BESIDE_U.map(|u| top.middle.along(u)));
                }
                // A dish that is wider than a cabinet is placed low; the top is used for the
                // next container.
                None => {
                    left.push(class);
                    free = tops[places.len() / BESIDE_U.len()..].iter();
                }
            }
        }
        if places.len() < n_high * BESIDE_U.len() {
            return Err("no room for the containers on high tops");
        }
        places.extend(free.flat_map(|top| ALONE_U.map(|u| top.middle.along(u))));
        self.rng.shuffle(&mut places);
        let mut places = places.into_iter();
        for class in objects {
            let object: Option<ObjectSpec> = places.by_ref().find_map(|place| {
                (0..MAX_ATTEMPTS).find_map(|_| {
                    let turn_rad = self.rng.range(0.0, TAU);
                    place.jittered(&mut self.rng).place(self.house, *class, turn_rad, &self.placed)
                })
            });
            self.push(object.ok_or("no room on a high top")?);
        }
        Ok(left)
    }
}
