//! Contents of a house for one episode.

use chaic_core::briefing::Goal;
use chaic_core::capability::Persona;
use chaic_core::geom::{Pose, to_xz};
use chaic_core::rng::RngStream;
use chaic_core::task::{Arrangement, GoalTop};
use chaic_core::{ClassId, EntityId, TaskId, Vec2, Vec3};
use chaic_world::{AgentSpec, ObjectSpec, Setup};

use super::objects::{ObjectsAndGoal, VASES, containers, draw_objects_and_goal};
use super::slots::{HighTop, Slot};
use super::walls::CEILING_M;
use super::{House, doorway_obstacles, slots};
use crate::upright_box::mm;

/// Maximum number of small objects on high tops (facts S11.2).
const MAX_HIGH: usize = 15;
/// Minimum number of target classes among them (facts S11.2).
pub(super) const MIN_HIGH_CLASSES: usize = 2;
/// Minimum distance between two objects on the floor, meters.
const FLOOR_APART_M: f32 = 0.5;
/// Clearance of people from walls at the start, meters: 0.5 (paper) plus a margin for rounding.
const START_CLEAR_M: f32 = 0.6;
/// Minimum distance between people at the start, meters (facts S12.5: 0.7 to 24).
const PEOPLE_APART_M: f32 = 0.9;
/// Probability that the refrigerators are the high goal place (facts S11.2: one of twelve
/// episodes).
const REFRIGERATOR_GOAL_PROBABILITY: f32 = 2.0 / 24.0;

/// A scene that is being populated.
pub(super) struct Scene<'a> {
    pub house: &'a House,
    pub rng: RngStream,
    /// Objects placed so far, without furniture.
    pub placed: Vec<ObjectSpec>,
}

/// Creates an episode in this house, or returns the reason for failure.
pub(super) fn setup(
    house: &House,
    task: TaskId,
    seed: u64,
    attempt: u64,
) -> Result<Setup, &'static str> {
    let stream = |purpose: &str| RngStream::new(seed, &format!("{task}/{purpose}"), attempt);
    let drawn = draw_objects_and_goal(task, &mut stream("goods"));
    let mut scene = Scene { house, rng: stream("places"), placed: Vec::new() };
    let people = draw_people(house, task, &mut stream("people")).ok_or("no room for the people")?;
    let goal_places = goal_places(house, task, &mut stream("goal place"))?;
    let first_goal = house.furniture[usize::from(goal_places[0].0 - EntityId::FIRST_OBJECT.0)];
    if task.info().arrangement == Arrangement::Obstacles {
        let (partner, goal) = (to_xz(people[0].pose.position), to_xz(first_goal.position));
        let obstacles =
            doorway_obstacles::obstacles(house, partner, goal, &mut stream("obstacles"));
        scene.placed = obstacles.ok_or("obstacles block too little")?;
    }
    scene.place_objects(task, &drawn)?;
    let placed = scene.placed;
    Ok(assemble(house, task, seed, Contents { placed, people, goal: drawn.goal, goal_places }))
}

/// Objects, people and goal that an episode adds to a house.
pub(super) struct Contents {
    pub placed: Vec<ObjectSpec>,
    pub people: Vec<AgentSpec>,
    pub goal: Goal,
    pub goal_places: Vec<EntityId>,
}

/// Combines a house and its contents to a setup.
pub(super) fn assemble(house: &House, task: TaskId, seed: u64, contents: Contents) -> Setup {
    let mut things = house.furniture.clone();
    things.extend(contents.placed);
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
    fn place_objects(&mut self, task: TaskId, drawn: &ObjectsAndGoal) -> Result<(), &'static str> {
        let mut low = slots::low(self.house);
        self.rng.shuffle(&mut low);
        let tops = slots::high(self.house);
        let arrangement = task.info().arrangement;
        if arrangement == Arrangement::HighContainers {
            self.place_containers_high(&tops)?;
        } else {
            let containers = containers(&mut self.rng, 6);
            self.place_low(&containers, &mut low, 0.0).ok_or("no room for the containers")?;
        }
        let mut objects = drawn.objects.clone();
        match arrangement {
            Arrangement::HighTargets => self.place_objects_high(drawn, &tops, &mut objects)?,
            Arrangement::LowTargets => {
                let on_floor: Vec<ClassId> = objects.drain(..objects.len().div_ceil(2)).collect();
                self.place_on_floor(&on_floor)?;
            }
            _ => {}
        }
        self.place_low(&objects, &mut low, std::f32::consts::TAU).ok_or("no room for the objects")
    }

    /// Places each class on the first free low slot that fits it; a slot holds one object.
    pub fn place_low(
        &mut self,
        classes: &[ClassId],
        low: &mut Vec<Slot>,
        turn_rad: f32,
    ) -> Option<()> {
        for class in classes {
            let (k, object) = (0..low.len()).find_map(|k| {
                let turn_rad = turn_rad * self.rng.unit();
                let slot = low[k].jittered(&mut self.rng);
                Some((k, slot.place(self.house, *class, turn_rad, &self.placed)?))
            })?;
            low.remove(k);
            self.push(object);
        }
        Some(())
    }

    /// Places one container on each high top.
    fn place_containers_high(&mut self, tops: &[HighTop]) -> Result<(), &'static str> {
        let mut order: Vec<usize> = (0..tops.len()).collect();
        self.rng.shuffle(&mut order);
        for class in containers(&mut self.rng, tops.len().min(6)) {
            let found = order.iter().enumerate().find_map(|(k, top)| {
                let object = tops[*top].middle.place(self.house, class, 0.0, &self.placed)?;
                Some((k, object))
            });
            // A dish that is wider than every remaining top is left out.
            if let Some((k, object)) = found {
                order.remove(k);
                self.push(object);
            }
        }
        if self.placed.len() >= 3 {
            Ok(())
        } else {
            Err("no room for three containers on high tops")
        }
    }

    /// Moves objects to high tops, one vase among them; the other vase joins the remaining objects.
    fn place_objects_high(
        &mut self,
        drawn: &ObjectsAndGoal,
        tops: &[HighTop],
        objects: &mut Vec<ClassId>,
    ) -> Result<(), &'static str> {
        let mut places: Vec<Slot> = tops.iter().flat_map(|t| t.slots.iter().copied()).collect();
        self.rng.shuffle(&mut places);
        places.truncate(MAX_HIGH);
        let vase = ClassId::named("vase");
        let mut up: Vec<ClassId> = objects.drain(..places.len() - 1).collect();
        up.insert(self.rng.below(places.len()), vase);
        objects.extend(std::iter::repeat_n(vase, VASES - 1));
        self.rng.shuffle(objects);
        for (class, slot) in up.iter().zip(places) {
            let object = (0..6).find_map(|_| {
                let turn_rad = self.rng.range(0.0, std::f32::consts::TAU);
                slot.jittered(&mut self.rng).place(self.house, *class, turn_rad, &self.placed)
            });
            self.push(object.ok_or("no room on a high top")?);
        }
        let mut targets: Vec<ClassId> =
            up.into_iter().filter(|c| *c != vase && drawn.goal.count(*c) > 0).collect();
        targets.sort();
        targets.dedup();
        let enough = targets.len() >= MIN_HIGH_CLASSES;
        if enough { Ok(()) } else { Err("too few target classes are high") }
    }

    pub fn place_on_floor(&mut self, classes: &[ClassId]) -> Result<(), &'static str> {
        let mut points = slots::floor_for_targets(self.house);
        self.rng.shuffle(&mut points);
        let mut taken: Vec<Vec2> = Vec::new();
        for class in classes {
            let is_free = |p: &Vec2| taken.iter().all(|t| t.distance(*p) >= FLOOR_APART_M);
            let p = *points.iter().find(|p| is_free(p)).ok_or("no room on the floor")?;
            taken.push(p);
            let yaw_rad = mm(self.rng.range(-std::f32::consts::PI, std::f32::consts::PI));
            let position = Vec3::new(mm(p.x), 0.0, mm(p.y));
            self.push(ObjectSpec::new(*class, position, yaw_rad));
        }
        Ok(())
    }

    pub fn push(&mut self, mut object: ObjectSpec) {
        let n = object.class.info().palette.len().max(1);
        object.variant = self.rng.below(n) as u8;
        self.placed.push(object);
    }
}

/// Returns the bed, or the cabinets or refrigerators if the goal is high.
fn goal_places(
    house: &House,
    task: TaskId,
    rng: &mut RngStream,
) -> Result<Vec<EntityId>, &'static str> {
    let class = match task.info().goal_top {
        GoalTop::High if rng.chance(REFRIGERATOR_GOAL_PROBABILITY) => "refrigerator",
        GoalTop::High => "cabinet",
        GoalTop::Any => "bed",
    };
    let is_goal = |k: &usize| house.furniture[*k].class.name() == class;
    let places: Vec<EntityId> =
        (0..house.furniture.len()).filter(is_goal).map(Setup::entity).collect();
    if places.is_empty() { Err("the house has no goal place") } else { Ok(places) }
}

/// Draws the poses of partner and helper, each in a random room.
pub(super) fn draw_people(
    house: &House,
    task: TaskId,
    rng: &mut RngStream,
) -> Option<Vec<AgentSpec>> {
    let free = slots::floor(house, START_CLEAR_M);
    let mut people: Vec<AgentSpec> = Vec::new();
    for kind in [task.info().partner, Persona::Helper.into()] {
        let apart =
            |p: &Vec2| people.iter().all(|o| to_xz(o.pose.position).distance(*p) >= PEOPLE_APART_M);
        // The room is drawn first, so that small rooms are as likely as large ones (facts
        // S11.2).
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
        people.push(AgentSpec::new(kind, pose, rng.below(16) as u8));
    }
    Some(people)
}
