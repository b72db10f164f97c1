//! What lies and stands in a house for one episode.

use chaic_core::briefing::Goal;
use chaic_core::capability::Persona;
use chaic_core::geom::{Pose, xz};
use chaic_core::rng::Stream;
use chaic_core::task::{Arrangement, GoalTop};
use chaic_core::{ClassId, EntityId, TaskId, Vec2, Vec3};
use chaic_world::{Person, Setup, Thing};

use super::goods::{Goods, VASES, containers, goods};
use super::slots::{HighTop, Slot};
use super::walls::CEILING_M;
use super::{House, doors, slots};
use crate::upright_box::mm;

/// Most small objects on high tops (facts S11.2).
const MOST_HIGH: usize = 15;
/// Fewest target classes among them (facts S11.2).
pub(super) const LEAST_HIGH_CLASSES: usize = 2;
/// Between two things on the floor, metres.
const FLOOR_APART_M: f32 = 0.5;
/// Around people at the start, metres: 0.5 from walls (paper), with room for rounding.
const START_CLEAR_M: f32 = 0.6;
/// Between people at the start, metres (facts S12.5: 0.7 to 24).
const PEOPLE_APART_M: f32 = 0.9;
/// How often the refrigerators are the high goal place (facts S11.2: one of twelve episodes).
const REFRIGERATOR_GOAL: f32 = 2.0 / 24.0;

/// A scene that is being filled.
pub(super) struct Scene<'a> {
    pub house: &'a House,
    pub rng: Stream,
    /// What has been put so far, without furniture.
    pub put: Vec<Thing>,
}

/// An episode in this house, or why this draw leads to none.
pub(super) fn setup(
    house: &House,
    task: TaskId,
    seed: u64,
    attempt: u64,
) -> Result<Setup, &'static str> {
    let stream = |purpose: &str| Stream::new(seed, &format!("{task}/{purpose}"), attempt);
    let goods = goods(task, &mut stream("goods"));
    let mut scene = Scene { house, rng: stream("places"), put: Vec::new() };
    let people = people(house, task, &mut stream("people")).ok_or("no room for the people")?;
    let goal_places = goal_places(house, task, &mut stream("goal place"))?;
    let first_goal = house.furniture[usize::from(goal_places[0].0 - EntityId::FIRST_OBJECT.0)];
    if task.info().arrangement == Arrangement::Obstacles {
        let (partner, goal) = (xz(people[0].pose.position), xz(first_goal.position));
        let obstacles = doors::obstacles(house, partner, goal, &mut stream("obstacles"));
        scene.put = obstacles.ok_or("obstacles close too little")?;
    }
    scene.lay_out(task, &goods)?;
    let put = scene.put;
    Ok(assembled(house, task, seed, Contents { put, people, goal: goods.goal, goal_places }))
}

/// What an episode adds to a house.
pub(super) struct Contents {
    pub put: Vec<Thing>,
    pub people: Vec<Person>,
    pub goal: Goal,
    pub goal_places: Vec<EntityId>,
}

/// The episode of this house and these contents.
pub(super) fn assembled(house: &House, task: TaskId, seed: u64, contents: Contents) -> Setup {
    let mut things = house.furniture.clone();
    things.extend(contents.put);
    Setup {
        task,
        seed,
        horizon: task.info().horizon,
        bounds: house.bounds,
        ceiling_m: Some(CEILING_M),
        rooms: house.rooms.clone(),
        walls: house.walls.clone(),
        openings: house.openings.clone(),
        floors: house.floors.clone(),
        things,
        people: contents.people,
        goal: contents.goal,
        goal_places: contents.goal_places,
    }
}

impl Scene<'_> {
    fn lay_out(&mut self, task: TaskId, goods: &Goods) -> Result<(), &'static str> {
        let mut low = slots::low(self.house);
        self.rng.shuffle(&mut low);
        let tops = slots::high(self.house);
        let arrangement = task.info().arrangement;
        if arrangement == Arrangement::HighContainers {
            self.containers_up(&tops)?;
        } else {
            let containers = containers(&mut self.rng, 6);
            self.on_low(&containers, &mut low, 0.0).ok_or("no room for the containers")?;
        }
        let mut objects = goods.objects.clone();
        match arrangement {
            Arrangement::HighTargets => self.objects_up(goods, &tops, &mut objects)?,
            Arrangement::LowTargets => {
                let on_floor: Vec<ClassId> = objects.drain(..objects.len().div_ceil(2)).collect();
                self.on_floor(&on_floor)?;
            }
            _ => {}
        }
        self.on_low(&objects, &mut low, std::f32::consts::TAU).ok_or("no room for the objects")
    }

    /// Puts each on the first free low place that suits it; a place takes one thing.
    pub fn on_low(
        &mut self,
        classes: &[ClassId],
        low: &mut Vec<Slot>,
        turn_rad: f32,
    ) -> Option<()> {
        for class in classes {
            let (k, thing) = (0..low.len()).find_map(|k| {
                let turn_rad = turn_rad * self.rng.unit();
                let slot = low[k].jittered(&mut self.rng);
                Some((k, slot.put(self.house, *class, turn_rad, &self.put)?))
            })?;
            low.remove(k);
            self.push(thing);
        }
        Some(())
    }

    /// One container on each high top, as many as there are.
    fn containers_up(&mut self, tops: &[HighTop]) -> Result<(), &'static str> {
        let mut order: Vec<usize> = (0..tops.len()).collect();
        self.rng.shuffle(&mut order);
        for class in containers(&mut self.rng, tops.len().min(6)) {
            let found = order.iter().enumerate().find_map(|(k, top)| {
                let thing = tops[*top].middle.put(self.house, class, 0.0, &self.put)?;
                Some((k, thing))
            });
            // A dish that is wider than every top that is left stays in the cupboard.
            if let Some((k, thing)) = found {
                order.remove(k);
                self.push(thing);
            }
        }
        if self.put.len() >= 3 { Ok(()) } else { Err("no room for three containers on high tops") }
    }

    /// Moves objects onto high tops, one vase among them; the other vase joins the rest.
    fn objects_up(
        &mut self,
        goods: &Goods,
        tops: &[HighTop],
        objects: &mut Vec<ClassId>,
    ) -> Result<(), &'static str> {
        let mut places: Vec<Slot> = tops.iter().flat_map(|t| t.slots.iter().copied()).collect();
        self.rng.shuffle(&mut places);
        places.truncate(MOST_HIGH);
        let vase = ClassId::named("vase");
        let mut up: Vec<ClassId> = objects.drain(..places.len() - 1).collect();
        up.insert(self.rng.below(places.len()), vase);
        objects.extend(std::iter::repeat_n(vase, VASES - 1));
        self.rng.shuffle(objects);
        for (class, slot) in up.iter().zip(places) {
            let thing = (0..6).find_map(|_| {
                let turn_rad = self.rng.range(0.0, std::f32::consts::TAU);
                slot.jittered(&mut self.rng).put(self.house, *class, turn_rad, &self.put)
            });
            self.push(thing.ok_or("no room on a high top")?);
        }
        let mut targets: Vec<ClassId> =
            up.into_iter().filter(|c| *c != vase && goods.goal.wanted(*c) > 0).collect();
        targets.sort();
        targets.dedup();
        let enough = targets.len() >= LEAST_HIGH_CLASSES;
        if enough { Ok(()) } else { Err("too few target classes are high") }
    }

    pub fn on_floor(&mut self, classes: &[ClassId]) -> Result<(), &'static str> {
        let mut points = slots::floor_for_goods(self.house);
        self.rng.shuffle(&mut points);
        let mut taken: Vec<Vec2> = Vec::new();
        for class in classes {
            let is_free = |p: &Vec2| taken.iter().all(|t| t.distance(*p) >= FLOOR_APART_M);
            let p = *points.iter().find(|p| is_free(p)).ok_or("no room on the floor")?;
            taken.push(p);
            let yaw_rad = mm(self.rng.range(-std::f32::consts::PI, std::f32::consts::PI));
            let position = Vec3::new(mm(p.x), 0.0, mm(p.y));
            self.push(Thing::new(*class, position, yaw_rad));
        }
        Ok(())
    }

    pub fn push(&mut self, mut thing: Thing) {
        let n = thing.class.info().palette.len().max(1);
        thing.variant = self.rng.below(n) as u8;
        self.put.push(thing);
    }
}

/// The bed, or what is high.
fn goal_places(
    house: &House,
    task: TaskId,
    rng: &mut Stream,
) -> Result<Vec<EntityId>, &'static str> {
    let class = match task.info().goal_top {
        GoalTop::High if rng.chance(REFRIGERATOR_GOAL) => "refrigerator",
        GoalTop::High => "cabinet",
        GoalTop::Any => "bed",
    };
    let is_goal = |k: &usize| house.furniture[*k].class.name() == class;
    let places: Vec<EntityId> =
        (0..house.furniture.len()).filter(is_goal).map(Setup::entity).collect();
    if places.is_empty() { Err("the house has no goal place") } else { Ok(places) }
}

/// Partner and helper, each in a random room.
pub(super) fn people(house: &House, task: TaskId, rng: &mut Stream) -> Option<Vec<Person>> {
    let free = slots::floor(house, START_CLEAR_M);
    let mut people: Vec<Person> = Vec::new();
    for kind in [task.info().partner, Persona::Helper.into()] {
        let apart =
            |p: &Vec2| people.iter().all(|o| xz(o.pose.position).distance(*p) >= PEOPLE_APART_M);
        // A room first, so that small rooms are as likely as large ones (facts S11.2).
        let p = (0..32).find_map(|_| {
            let room = rng.choose(&house.rooms)?.rect;
            let inside: Vec<Vec2> =
                free.iter().copied().filter(|p| room.contains(*p) && apart(p)).collect();
            rng.choose(&inside).copied()
        })?;
        let heading = rng.below(24) as f32 - 11.0;
        let pose = Pose {
            position: Vec3::new(mm(p.x), 0.0, mm(p.y)),
            yaw_rad: mm(heading * std::f32::consts::PI / 12.0),
        };
        people.push(Person::new(kind, pose, rng.below(16) as u8));
    }
    Some(people)
}
