//! Houses whose inventory doesn't tell the task: every indoor task gets the things of all.
//!
//! The numbers of an episode ([`Inventory`]) are drawn without regard to the task. What differs is
//! what the task is about, and no more: which of the things that lie high or on the floor are
//! wanted, how many of the containers lie high, whether obstacles stand in doorways, and which
//! refrigerators are the goal place. `docs/episodes.md` tells it to users.

use std::f32::consts::TAU;

use chaic_core::briefing::Goal;
use chaic_core::geom::xz;
use chaic_core::rng::Stream;
use chaic_core::task::{Arrangement, GoalTop};
use chaic_core::{ClassId, EntityId, TaskId};
use chaic_world::{Setup, Thing};

use super::goods::{VASES, containers, goods};
use super::populate::{Contents, LEAST_HIGH_CLASSES, Scene, assembled, people};
use super::room::RoomPlan;
use super::slots::{HIGH_M, HighTop};
use super::{House, beside, doors, recipes, slots};

/// Cabinets of a house; on all of them things lie. The paper's shape has three or four: with four
/// there is room for four containers and seven things.
pub(super) const CABINETS: usize = 4;
/// What is put up on refrigerators and cabinets indoors, but for the goal place (ours: what lies on
/// the goal place could be delivered without a step).
const HIGH_HOST: &str = "cabinet";
/// The class of the goal place of all indoor tasks (ours: the paper's high goal places are cabinets
/// and refrigerators, and a class that is told must not tell the task).
const GOAL_CLASS: &str = "refrigerator";
/// Height of refrigerators over the catalogue's: 2.05 m, as high as the cabinets that are the
/// paper's usual high goal place, so that the task is as hard.
const TALL: f32 = 1.15;
/// Height of the low refrigerator over the catalogue's: 0.85 m, as high as a kitchen counter.
const LOW: f32 = 0.48;
/// Where a container stands on a high top, as a share of its half length: at one end.
const CONTAINER_U: f32 = -1.0;
/// Places of things beside it.
const BESIDE_U: [f32; 2] = [0.2, 0.75];
/// Places of things on a high top without a container.
const ALONE_U: [f32; 3] = [-0.66, 0.0, 0.66];
/// Tries for one thing on a high top.
const TRIES: usize = 6;

/// How much there is in a house, whatever the task.
#[derive(Clone, Copy, Debug)]
struct Inventory {
    /// Objects on the floor, 7 to 9: as many as leave a choice of unwanted ones.
    n_floor: usize,
    /// Objects on high tops besides one vase, 5 or 6.
    n_high: usize,
    /// Containers on high tops, 1 to 4, where the task isn't about them.
    n_containers_high: usize,
    /// Obstacles, 5 to 7: up to 5 stand in doorways where the task asks for it.
    n_obstacles: usize,
}

impl Inventory {
    /// The same for all tasks and all attempts, so that no task prefers numbers that come out
    /// easily.
    fn new(seed: u64) -> Inventory {
        let mut rng = Stream::new(seed, "decoys/inventory", 0);
        Inventory {
            n_floor: 7 + rng.below(3),
            n_high: 5 + rng.below(2),
            n_containers_high: 1 + rng.below(CABINETS),
            n_obstacles: 5 + rng.below(3),
        }
    }
}

/// Which objects are taken for a place.
#[derive(Clone, Copy, Debug)]
enum Share {
    /// Any: the partner gets at them there.
    Any,
    /// Only unwanted ones: it doesn't, and the task isn't about that.
    Unwanted,
    /// So many wanted ones: it doesn't, and that is the task.
    Wanted(usize),
}

/// Makes the refrigerators of a house tall, and adds a low one in the first room that has a place.
pub(super) fn refrigerators(
    rooms: &mut [RoomPlan],
    order: &[usize],
    rng: &mut Stream,
) -> Result<(), &'static str> {
    let things = rooms.iter_mut().flat_map(|r| &mut r.things);
    things.filter(|t| t.class.name() == GOAL_CLASS).for_each(|t| t.scale[1] = TALL);
    let room = order.iter().find(|i| recipes::add(&mut rooms[**i], rng, GOAL_CLASS));
    let added = room.and_then(|i| rooms[*i].things.last_mut());
    added.ok_or("no room for the low refrigerator")?.scale[1] = LOW;
    Ok(())
}

/// An episode with decoys in this house, or why this draw leads to none.
pub(super) fn setup(
    house: &House,
    task: TaskId,
    seed: u64,
    attempt: u64,
) -> Result<Setup, &'static str> {
    let stream = |purpose: &str| Stream::new(seed, &format!("{task}/decoys/{purpose}"), attempt);
    let inventory = Inventory::new(seed);
    // Whoever walks keeps clear of what stands beside walls, and so does what lies on the floor.
    let mut house = house.clone();
    let mut aside = beside::obstacles(&mut house, inventory.n_obstacles, &mut stream("obstacles"))
        .ok_or("no room for the obstacles")?;
    let people = people(&house, task, &mut stream("people")).ok_or("no room for the people")?;
    let goal_places = goal_places(&house, task);
    let mut put = Vec::new();
    if task.info().arrangement == Arrangement::Obstacles {
        let first = goal_places.first().ok_or("the house has no goal place")?;
        let goal = house.furniture[usize::from(first.0 - EntityId::FIRST_OBJECT.0)].position;
        let partner = xz(people[0].pose.position);
        put = doors::obstacles(&house, partner, xz(goal), &mut stream("doorways"))
            .ok_or("obstacles close too little")?;
        aside.truncate(inventory.n_obstacles - put.len());
    }
    put.extend(aside);
    let mut scene = Scene { house: &house, rng: stream("places"), put };
    let goods = goods(task, &mut stream("goods"));
    scene.lay_out_decoys(task, inventory, goods.objects, &goods.goal)?;
    Ok(assembled(
        &house,
        task,
        seed,
        Contents { put: scene.put, people, goal: goods.goal, goal_places },
    ))
}

/// The tall refrigerators where the goal is high, else all of them.
fn goal_places(house: &House, task: TaskId) -> Vec<EntityId> {
    let is_any = task.info().goal_top == GoalTop::Any;
    let is_goal = |k: &usize| {
        let thing = &house.furniture[*k];
        let is_high = thing.position.y + thing.size_m().y >= HIGH_M;
        thing.class.name() == GOAL_CLASS && (is_high || is_any)
    };
    (0..house.furniture.len()).filter(is_goal).map(Setup::entity).collect()
}

/// What lies on high tops and on the floor, for this task's partner.
fn shares(task: TaskId, goal: &Goal, rng: &mut Stream) -> [Share; 2] {
    let info = task.info();
    let [lowest_m, highest_m] = info.partner.capability().pick_range_m;
    let high = match info.arrangement {
        // A third to a half of the wanted ones, as in the paper's shape.
        Arrangement::HighTargets => Share::Wanted(3 + rng.below(2)),
        _ if highest_m < HIGH_M + 1.0 => Share::Unwanted,
        _ => Share::Any,
    };
    let floor = match info.arrangement {
        // Half of the wanted ones, as in the paper's shape.
        Arrangement::LowTargets => Share::Wanted(goal.total().div_ceil(2) as usize),
        _ if lowest_m > 0.0 => Share::Unwanted,
        _ => Share::Any,
    };
    [high, floor]
}

/// Takes `n` objects out, in random order, or `None` if there are too few that suit.
fn take(
    objects: &mut Vec<ClassId>,
    goal: &Goal,
    n: usize,
    share: Share,
    rng: &mut Stream,
) -> Option<Vec<ClassId>> {
    let mut left = match share {
        // Wanted and unwanted ones alike.
        Share::Any => [n, n],
        Share::Unwanted => [0, n],
        Share::Wanted(wanted) => [wanted.min(n), n - wanted.min(n)],
    };
    let (mut taken, mut kept) = (Vec::new(), Vec::new());
    for class in objects.drain(..) {
        let left = &mut left[usize::from(goal.wanted(class) == 0)];
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
    fn lay_out_decoys(
        &mut self,
        task: TaskId,
        inventory: Inventory,
        mut objects: Vec<ClassId>,
        goal: &Goal,
    ) -> Result<(), &'static str> {
        let few = "too few unwanted objects";
        let [high, floor] = shares(task, goal, &mut self.rng);
        let rng = &mut self.rng;
        let mut up = take(&mut objects, goal, inventory.n_high, high, rng).ok_or(few)?;
        let down = take(&mut objects, goal, inventory.n_floor, floor, rng).ok_or(few)?;
        let mut targets: Vec<ClassId> =
            up.iter().copied().filter(|c| goal.wanted(*c) > 0).collect();
        targets.sort();
        targets.dedup();
        let arrangement = task.info().arrangement;
        if arrangement == Arrangement::HighTargets && targets.len() < LEAST_HIGH_CLASSES {
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
        let low_containers = self.up(n_high, &up)?;
        let mut low = slots::low(self.house);
        self.rng.shuffle(&mut low);
        self.on_low(&low_containers, &mut low, 0.0).ok_or("no room for the containers")?;
        self.on_floor(&down)?;
        self.on_low(&objects, &mut low, TAU).ok_or("no room for the objects")
    }

    /// Fills the high tops with so many containers, one each, and these objects; returns the
    /// containers that are left.
    fn up(&mut self, n_high: usize, objects: &[ClassId]) -> Result<Vec<ClassId>, &'static str> {
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
            match top.middle.along(CONTAINER_U).put(self.house, class, 0.0, &self.put) {
                Some(thing) => {
                    self.push(thing);
                    places.extend(BESIDE_U.map(|u| top.middle.along(u)));
                }
                // A dish that is wider than a cabinet lies low; the top waits for the next.
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
            let thing: Option<Thing> = places.by_ref().find_map(|place| {
                (0..TRIES).find_map(|_| {
                    let turn_rad = self.rng.range(0.0, TAU);
                    place.jittered(&mut self.rng).put(self.house, *class, turn_rad, &self.put)
                })
            });
            self.push(thing.ok_or("no room on a high top")?);
        }
        Ok(left)
    }
}
