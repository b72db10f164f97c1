//! Toy world for tests: boxes in a room, a small ray caster, and one body whose actions never fail
//! at random.

use chaic_core::briefing::{Companion, CompanionRole, Goal, Layout, LayoutBlock, MotionParams};
use chaic_core::capability::Persona;
use chaic_core::geom::{Camera, Pose, Rect, forward, to_xz, wrap_angle, yaw_rotation};
use chaic_core::observation::{
    GrantedInfo, Grants, HeldIdentity, HeldObject, Images, ObjectState, Proprioception, WorldState,
};
use chaic_core::{
    Action, Agent, AgentId, Briefing, ClassId, EntityId, FailureReason, Frame, Hand, Observation,
    Outcome, Role, Target, Vec2, Vec3,
};

use crate::execution::steering::step_length_m;
use crate::mapping::grid::Grid;
use crate::mapping::occupancy::{CellOccupancy, OccupancyMap};
use crate::mapping::{PersonMap, SemanticMap};
use crate::memory::Memory;
use crate::perception::{Detection, GroundTruthIds, Perception as _};
use crate::planning::careful_costs::CarefulCosts;
use crate::planning::cost_map::CostMap;
use crate::planning::cost_model::{CostInputs, CostModel as _};
use crate::track::{CarriedObject, Hands, TrackId};

/// Motion parameters: those of the paper's world rules.
pub const MOTION: MotionParams = MotionParams {
    turn_rad: std::f32::consts::PI / 12.0,
    stride_m: 0.4,
    step_over_m: 0.12,
    arm_reach_m: 0.7,
    reach_limit_m: 2.0,
};

/// Object of the toy world: an upright box with a class.
pub struct ToyObject {
    class: ClassId,
    low: Vec3,
    high: Vec3,
}

impl ToyObject {
    /// Creates a box; `at` is the center of its bottom, `size` its extents.
    pub fn new(class: &str, at: [f32; 3], size: [f32; 3]) -> ToyObject {
        let (at, half) = (Vec3::from(at), 0.5 * Vec3::new(size[0], 0.0, size[2]));
        ToyObject {
            class: ClassId::named(class),
            low: at - half,
            high: at + half + Vec3::new(0.0, size[1], 0.0),
        }
    }
}

struct ToyBox {
    entity: EntityId,
    low: Vec3,
    high: Vec3,
}

impl ToyBox {
    /// Returns the depth at which the ray enters the box.
    fn hit(&self, eye: Vec3, direction: Vec3) -> Option<f32> {
        let inverse = direction.recip();
        let (a, b) = ((self.low - eye) * inverse, (self.high - eye) * inverse);
        let enter = a.min(b).max_element();
        let leave = a.max(b).min_element();
        (enter <= leave && enter > 0.0).then_some(enter)
    }

    fn distance_from(&self, p: Vec2) -> f32 {
        p.distance(p.clamp(to_xz(self.low), to_xz(self.high)))
    }
}

/// Room with objects and one body.
pub struct Toy {
    room: Rect,
    solids: Vec<ToyBox>,
    classes: Vec<Option<ClassId>>,
    pose: Pose,
    pub frame: Frame,
    hands: [Option<HeldIdentity>; 2],
    pub grants_ids: bool,
    pub delivered: Vec<TrackId>,
    last: Option<(Action, Outcome)>,
    pub size: u32,
    pub radius_m: f32,
    pub n_blocked: u32,
}

impl Toy {
    /// Creates an empty room around the origin, `width` along x, `depth` along z.
    pub fn room(width: f32, depth: f32) -> Toy {
        let (w, d) = (0.5 * width, 0.5 * depth);
        let room = Rect::new([-w, -d], [w, d]);
        let mut toy = Toy {
            room,
            solids: Vec::new(),
            classes: vec![None; 16],
            pose: Pose::default(),
            frame: 0,
            hands: [None, None],
            grants_ids: true,
            delivered: Vec::new(),
            last: None,
            size: 128,
            radius_m: 0.2,
            n_blocked: 0,
        };
        toy.classes[8] = ClassId::from_name("person");
        toy.classes[9] = ClassId::from_name("person");
        toy.add_wall([-w - 0.1, -d - 0.1], [w + 0.1, -d]);
        toy.add_wall([-w - 0.1, d], [w + 0.1, d + 0.1]);
        toy.add_wall([-w - 0.1, -d], [-w, d]);
        toy.add_wall([w, -d], [w + 0.1, d]);
        toy
    }

    pub fn bounds(&self) -> Rect {
        self.room
    }

    pub fn pixels(&self) -> u32 {
        self.size * self.size
    }

    pub fn add_wall(&mut self, low: [f32; 2], high: [f32; 2]) {
        self.solids.push(ToyBox {
            entity: EntityId::WALL,
            low: Vec3::new(low[0], 0.0, low[1]),
            high: Vec3::new(high[0], 2.8, high[1]),
        });
    }

    /// Adds an object; returns its track for agents with perfect perception.
    pub fn add(&mut self, object: ToyObject) -> TrackId {
        let entity = EntityId(self.classes.len() as u16);
        self.classes.push(Some(object.class));
        self.solids.push(ToyBox { entity, low: object.low, high: object.high });
        entity.into()
    }

    /// Adds a standing person.
    pub fn add_person(&mut self, agent: AgentId, at: [f32; 2]) -> TrackId {
        let entity = EntityId::from_agent(agent);
        let (low, high) = (Vec3::new(-0.2, 0.0, -0.2), Vec3::new(0.2, 1.7, 0.2));
        let at = Vec3::new(at[0], 0.0, at[1]);
        self.solids.push(ToyBox { entity, low: at + low, high: at + high });
        entity.into()
    }

    /// Returns whether all objects are at least this far from a point.
    pub fn is_clear(&self, p: Vec2, min_m: f32) -> bool {
        self.solids.iter().all(|s| s.distance_from(p) >= min_m)
    }

    pub fn remove(&mut self, track: TrackId) {
        let entity = EntityId(track.0 as u16);
        self.solids.retain(|s| s.entity != entity);
    }

    pub fn stand(&mut self, at: [f32; 2], yaw_rad: f32) {
        self.pose = Pose { position: Vec3::new(at[0], 0.0, at[1]), yaw_rad };
    }

    pub fn here(&self) -> Vec2 {
        to_xz(self.pose.position)
    }

    pub fn class(&self, track: TrackId) -> ClassId {
        self.classes[track.0 as usize].expect("an object has a class")
    }

    /// Puts an object into a hand without removing its box.
    pub fn hold(&mut self, hand: usize, track: TrackId) {
        let (entity, class) = (EntityId(track.0 as u16), self.class(track));
        self.hands[hand] = Some(HeldIdentity { entity, class, contents: Vec::new() });
    }

    pub fn briefing(&self) -> Briefing {
        let classes = |names: &[&str]| names.iter().map(|n| ClassId::named(n)).collect();
        Briefing {
            me: AgentId::HELPER,
            capability: Persona::Helper.capability(),
            motion: MOTION,
            companions: vec![Companion { agent: AgentId::PARTNER, role: CompanionRole::Partner }],
            seed: 1,
            horizon: 3000,
            bounds: self.room,
            possible_targets: classes(&["apple", "banana", "orange"]),
            containers: classes(&["wicker_basket"]),
            obstacles: classes(&["trashbin"]),
            goal_places: vec![ClassId::named("bed")],
            goal_place_min_top_m: 0.0,
            container_capacity: 3,
            grants: Grants::IDS,
            goal: None,
            disclosure: None,
            layout: None,
        }
    }

    /// Returns the granted layout: the room, and all boxes that are fixed.
    pub fn layout(&self) -> Layout {
        let is_fixed =
            |s: &&ToyBox| !s.entity.is_object() || !self.class(s.entity.into()).info().is_movable();
        let block = |s: &ToyBox| LayoutBlock {
            center_xz: 0.5 * to_xz(s.low + s.high),
            half_xz: 0.5 * to_xz(s.high - s.low),
            yaw_rad: 0.0,
            y_range_m: [s.low.y, s.high.y],
        };
        Layout {
            floors: vec![self.room],
            blocks: self.solids.iter().filter(is_fixed).map(block).collect(),
        }
    }

    /// Returns the granted state of all objects that are not held; `goal_places` are its goal
    /// places.
    pub fn state(&self, goal_places: &[TrackId]) -> WorldState {
        let state = |s: &ToyBox| {
            let class = self.class(s.entity.into());
            let corners = [(s.low.x, s.low.z), (s.high.x, s.low.z), (s.low.x, s.high.z)];
            let corners = corners.into_iter().chain([(s.high.x, s.high.z)]).map(Vec2::from);
            ObjectState {
                entity: s.entity,
                class,
                position_in_world: 0.5 * (s.low + s.high),
                bottom_m: s.low.y,
                top_m: s.high.y,
                footprint: if class.info().is_carriable() { vec![] } else { corners.collect() },
                holder: None,
                container: None,
                is_gone: self.delivered.contains(&s.entity.into()),
            }
        };
        WorldState {
            objects: self.solids.iter().filter(|s| s.entity.is_object()).map(state).collect(),
            goal_places: goal_places.iter().map(|t| EntityId(t.0 as u16)).collect(),
        }
    }

    pub fn goal(wanted: &[(&str, u32)]) -> Option<Goal> {
        Some(Goal { targets: wanted.iter().map(|(c, n)| (ClassId::named(c), *n)).collect() })
    }

    pub fn observe(&self) -> Observation {
        let camera = Camera {
            eye_in_world: self.pose.position + Vec3::new(0.0, 1.65, 0.0),
            world_from_camera: yaw_rotation(self.pose.yaw_rad),
            vertical_fov_rad: Camera::EYE_FOV_RAD,
            width: self.size,
            height: self.size,
        };
        let n = self.pixels() as usize;
        let (mut depth, mut ids) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for row in 0..self.size {
            for column in 0..self.size {
                let direction = camera.unproject(column, row, 1.0) - camera.eye_in_world;
                let (d, id) = self.cast(camera.eye_in_world, direction);
                depth.push(d);
                ids.push(id.0);
            }
        }
        let is_joint = matches!(&self.hands, [Some(l), Some(r)] if l.entity == r.entity);
        let sensed = |held: &HeldIdentity| HeldObject {
            n_contents: held.contents.len() as u32,
            in_both_hands: is_joint,
            identity: self.grants_ids.then(|| held.clone()),
        };
        let hands = [0, 1].map(|k| self.hands[k].as_ref().map(sensed));
        let in_view = |e: &EntityId| ids.contains(&e.0);
        let all = (0..self.classes.len()).map(|i| EntityId(i as u16));
        let class = |e: EntityId| Some((e, self.classes[usize::from(e.0)]?));
        let granted = GrantedInfo {
            classes: all.filter(in_view).filter_map(class).collect(),
            delivered: self.delivered.iter().filter_map(|t| class(EntityId(t.0 as u16))).collect(),
            ..GrantedInfo::default()
        };
        Observation {
            frame: self.frame,
            proprioception: Proprioception {
                pose: self.pose,
                hands,
                last: self.last,
                other_end: None,
            },
            camera,
            images: Images { rgb: None, depth_m: Some(depth), ids: Some(ids) },
            frame_history: Vec::new(),
            granted,
        }
    }

    /// Returns the entity that a target names: directly, or by a pixel of the current image.
    fn resolve(&self, target: Target) -> EntityId {
        let ids = || self.observe().images.ids.expect("the toy world always renders ids");
        match target {
            Target::Entity(entity) => entity,
            Target::Pixel { column, row } => EntityId(ids()[(row * self.size + column) as usize]),
        }
    }

    fn cast(&self, eye: Vec3, direction: Vec3) -> (f32, EntityId) {
        let mut best = (Camera::FAR_M, EntityId::NOTHING);
        if direction.y < 0.0 {
            best = (-eye.y / direction.y, EntityId::FLOOR);
        }
        for solid in &self.solids {
            if let Some(d) = solid.hit(eye, direction)
                && d < best.0
            {
                best = (d, solid.entity);
            }
        }
        best
    }

    fn is_free(&self, p: Vec2) -> bool {
        self.solids.iter().all(|s| {
            let is_small =
                s.entity.is_object() && self.class(s.entity.into()).info().is_carriable();
            is_small || s.high.y < 0.12 || s.distance_from(p) >= self.radius_m
        })
    }

    /// Moves the body, sliding along obstacles; returns the distance.
    fn walk(&mut self, offset: Vec2) -> f32 {
        let start = self.here();
        for _ in 0..10 {
            let (here, step) = (self.here(), 0.1 * offset);
            let slides = [step, Vec2::new(step.x, 0.0), Vec2::new(0.0, step.y)];
            if let Some(s) = slides.iter().find(|s| self.is_free(here + **s)) {
                self.pose.position += Vec3::new(s.x, 0.0, s.y);
            }
        }
        self.here().distance(start)
    }

    /// Steps up to an object until the arm reaches it, or something is in the way of the body. The
    /// hand reaches farther then.
    fn step_up(&mut self, entity: EntityId) -> Result<(), FailureReason> {
        let solid = |t: &Toy| t.solids.iter().position(|s| s.entity == entity);
        let i = solid(self).ok_or(FailureReason::OutOfReach)?;
        let target = 0.5 * (to_xz(self.solids[i].low) + to_xz(self.solids[i].high));
        let half = 0.5 * to_xz(self.solids[i].high - self.solids[i].low).max_element();
        if self.here().distance(target) > 3.0 + half {
            return Err(FailureReason::OutOfReach);
        }
        for _ in 0..60 {
            if self.solids[i].distance_from(self.here()) <= MOTION.arm_reach_m {
                return Ok(());
            }
            let ahead = (target - self.here()).normalize_or_zero();
            if !self.is_free(self.here() + 0.05 * ahead) {
                let is_in_reach = self.solids[i].distance_from(self.here()) <= MOTION.reach_limit_m;
                return if is_in_reach { Ok(()) } else { Err(FailureReason::Blocked) };
            }
            self.pose.position += 0.05 * Vec3::new(ahead.x, 0.0, ahead.y);
        }
        Err(FailureReason::Blocked)
    }

    pub fn apply(&mut self, action: Action) -> Outcome {
        let (frames, result) = match action {
            Action::TurnLeft => (2, self.turn(1.0)),
            Action::TurnRight => (2, self.turn(-1.0)),
            Action::Wait { frames } => (frames.max(1), Ok(())),
            Action::MoveForward => {
                let distance_m =
                    self.walk(step_length_m(&MOTION) * to_xz(forward(self.pose.yaw_rad)));
                self.n_blocked += u32::from(distance_m < 0.1);
                (10, if distance_m < 0.1 { Err(FailureReason::Blocked) } else { Ok(()) })
            }
            Action::PickUp { object, hand } => (40, self.pick_up(self.resolve(object), hand)),
            Action::RemoveObstacle { obstacle, .. } => {
                let obstacle = self.resolve(obstacle);
                let result = self.step_up(obstacle);
                if result.is_ok() {
                    self.remove(obstacle.into());
                }
                (60, result)
            }
            Action::PutIn => (20, self.put_in()),
            Action::PutOn { place, hand } => (40, self.put_on(self.resolve(place), hand)),
        };
        self.frame += frames;
        let outcome = result.map_or_else(Outcome::Failure, |()| Outcome::Success);
        self.last = Some((action, outcome));
        outcome
    }

    fn turn(&mut self, sign: f32) -> Result<(), FailureReason> {
        self.pose.yaw_rad = wrap_angle(self.pose.yaw_rad + sign * MOTION.turn_rad);
        Ok(())
    }

    fn pick_up(&mut self, object: EntityId, hand: Hand) -> Result<(), FailureReason> {
        let class = self.class(object.into());
        if let Some(bike) = self.hands[0].as_ref().filter(|h| h.class.name() == "bike") {
            if bike.contents.len() >= 3 {
                return Err(FailureReason::Full);
            }
        } else if self.hands[hand.index()].is_some() {
            return Err(FailureReason::HandFull);
        }
        self.step_up(object)?;
        self.remove(object.into());
        match self.hands[0].as_mut().filter(|h| h.class.name() == "bike") {
            Some(bike) => bike.contents.push((object, class)),
            None if class.info().role == Role::HeavyTarget => {
                self.hold(0, object.into());
                self.hold(1, object.into());
            }
            None => self.hold(hand.index(), object.into()),
        }
        Ok(())
    }

    fn put_in(&mut self) -> Result<(), FailureReason> {
        let container = |h: &Option<HeldIdentity>| {
            h.as_ref()
                .is_some_and(|h| h.class.info().role == Role::Container && h.contents.len() < 3)
        };
        let i = self.hands.iter().position(container);
        let i = i.ok_or(FailureReason::NotContainerAndTarget)?;
        let held = self.hands[1 - i].take().ok_or(FailureReason::NotContainerAndTarget)?;
        let container = self.hands[i].as_mut().expect("found above");
        container.contents.push((held.entity, held.class));
        Ok(())
    }

    fn put_on(&mut self, place: EntityId, hand: Hand) -> Result<(), FailureReason> {
        if self.hands[hand.index()].is_none() {
            return Err(FailureReason::HandEmpty);
        }
        self.step_up(place)?;
        if let Some(bike) = self.hands[0].as_mut().filter(|h| h.class.name() == "bike") {
            self.delivered.extend(bike.contents.drain(..).map(|(e, _)| TrackId::from(e)));
            return Ok(());
        }
        let held = self.hands[hand.index()].take().expect("checked above");
        if held.class.info().role == Role::HeavyTarget {
            self.hands = [None, None];
        }
        self.delivered.push(held.entity.into());
        self.delivered.extend(held.contents.iter().map(|(e, _)| TrackId::from(*e)));
        Ok(())
    }

    /// Runs an agent in this world until the horizon; returns its plans without repetitions.
    pub fn run(&mut self, agent: &mut dyn Agent, briefing: &Briefing) -> Vec<String> {
        agent.reset(briefing);
        let mut plans = Vec::new();
        while self.frame < briefing.horizon {
            let action = agent.act(&self.observe()).expect("rule-based agents do not fail");
            let plan = agent.thought().plan;
            if plans.last() != Some(&plan) {
                plans.push(plan);
            }
            self.apply(action);
            if let Some(goal) = &briefing.goal
                && self.delivered.iter().filter(|e| goal.count(self.class(**e)) > 0).count()
                    >= goal.total() as usize
            {
                break;
            }
        }
        plans
    }
}

/// Toy world with a memory of it, for tests of single parts.
pub struct ToyRun {
    pub toy: Toy,
    briefing: Briefing,
    memory: Option<Memory>,
}

impl ToyRun {
    pub fn new(toy: Toy) -> ToyRun {
        let briefing = toy.briefing();
        ToyRun { toy, memory: Some(Memory::new(&briefing, crate::PlannerRules::paper())), briefing }
    }

    /// Returns the memory, updated with another observation.
    pub fn observe(&mut self) -> Memory {
        let observation = self.toy.observe();
        let percepts = GroundTruthIds.perceive(&observation);
        let mut memory = self.memory.take().expect("returned after each observation");
        memory.update(&self.briefing, &observation, &percepts);
        memory
    }

    pub fn put_back(&mut self, memory: Memory) {
        self.memory = Some(memory);
    }

    pub fn act(&mut self, action: crate::Intent, memory: Memory) {
        self.put_back(memory);
        let target = |track| GroundTruthIds.target(track);
        self.toy
            .apply(crate::track::resolve_target(action, target).expect("every track has a target"));
    }
}

/// Creates a detection of an object with a square base; `at` is the center of its bottom.
pub fn seen(track: TrackId, class: &str, at: [f32; 3], width_m: f32, height_m: f32) -> Detection {
    let half = 0.5 * width_m;
    let n = (width_m / 0.1).ceil() as i32;
    let offset = |k: i32| half * (2.0 * k as f32 / n as f32 - 1.0);
    let footprint =
        (0..=n).flat_map(|i| (0..=n).map(move |j| Vec2::new(at[0] + offset(i), at[2] + offset(j))));
    Detection {
        track,
        class: ClassId::named(class),
        confidence: 1.0,
        person: u16::try_from(track.0).ok().and_then(|e| EntityId(e).agent()),
        pixel: [0, 0],
        position_in_world: Vec3::from(at) + Vec3::new(0.0, 0.5 * height_m, 0.0),
        bottom_m: at[1],
        top_m: at[1] + height_m,
        n_pixels: 100,
        footprint: footprint.collect(),
    }
}

/// Creates a detection of the partner as an adult.
pub fn seen_partner(x: f32, z: f32) -> Detection {
    seen(EntityId::from_agent(AgentId::PARTNER).into(), "person", [x, 0.0, z], 0.3, 1.7)
}

/// Creates a held object, with contents numbered from 90.
pub fn identity(class: &str, entity: u16, contents: &[&str]) -> HeldIdentity {
    let contents = contents.iter().zip(90..);
    HeldIdentity {
        entity: EntityId(entity),
        class: ClassId::named(class),
        contents: contents.map(|(c, e)| (EntityId(e), ClassId::named(c))).collect(),
    }
}

/// The same object as known by the agent.
pub fn carried(class: &str, track: u16, contents: &[&str]) -> CarriedObject {
    let held = identity(class, track, contents);
    CarriedObject {
        object: Some((held.entity.into(), held.class)),
        n_contents: held.contents.len() as u32,
        contents: held.contents.into_iter().map(|(e, class)| (e.into(), class)).collect(),
    }
}

/// Creates hands that hold these objects.
pub fn hands(hands: [Option<CarriedObject>; 2]) -> Hands {
    Hands { hands, is_joint: false }
}

/// Map drawn in text: `.` free, `#` wall, `?` unknown.
pub struct DrawnMap {
    grid: Grid,
    cells: Vec<CellOccupancy>,
}

impl DrawnMap {
    pub fn parse(text: &str) -> DrawnMap {
        let rows: Vec<&str> = text.lines().map(str::trim).collect();
        let cells: Vec<CellOccupancy> = rows
            .iter()
            .flat_map(|row| row.chars())
            .map(|c| match c {
                '.' => CellOccupancy::Free,
                '#' => CellOccupancy::Wall,
                _ => CellOccupancy::Unknown,
            })
            .collect();
        DrawnMap { grid: Grid::with_size(rows[0].len(), rows.len()), cells }
    }

    pub fn costs(&self, radius_m: f32) -> CostMap {
        let map = OccupancyMap::from_cells(self.grid, &self.cells);
        let mut costs = CostMap::new(self.grid, radius_m);
        let (objects, people) = (SemanticMap::default(), PersonMap::default());
        let inputs = CostInputs {
            map: &map,
            objects: &objects,
            people: &people,
            avoids_obstacles: false,
            position: Vec2::splat(1e6),
            now: 0,
        };
        CarefulCosts.recompute(&mut costs, &inputs);
        costs
    }
}
