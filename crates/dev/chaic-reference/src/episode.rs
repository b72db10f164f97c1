//! Random episodes, and one run of the comparison.

use std::fmt;

use chaic_core::capability::{Impairment, Impairments, PersonKind, Persona};
use chaic_core::catalogue::Role;
use chaic_core::rng::RngStream;
use chaic_core::task::SceneKind;
use chaic_core::{AgentId, ClassId, Frame, ResolvedAction, TaskId, Vec3};
use chaic_episodes::{GeneratorSeeds, Settings, generate_with};
use chaic_world::{AgentSpec, ObjectSpec, Rules, Setup, World, blocks_of};

use crate::compare::Comparison;
use crate::coverage::Coverage;
use crate::driver::Driver;
use crate::numbers::RuleSet;
use crate::scene::{GivenQuantities, walkers};

/// A difference between the reference and the world.
#[derive(Clone, Debug)]
pub struct Difference {
    /// Index of the episode.
    pub episode: u64,
    /// Frame after which they differed.
    pub frame: Frame,
    /// Both values, and the actions in progress.
    pub text: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "episode {}, frame {}:\n{}", self.episode, self.frame, self.text)
    }
}

/// Returns the random kind of person that takes the place of another.
fn random_kind(rng: &mut RngStream, scene: SceneKind) -> PersonKind {
    const IMPAIRMENTS: [Impairment; 4] =
        [Impairment::OneHanded, Impairment::LowVision, Impairment::Tires, Impairment::Tremor];
    // The slowest person lets the other wait at furniture until it gives up.
    if scene == SceneKind::Yard && rng.chance(0.5) {
        let impairments = Impairments::new(Impairment::Tires);
        return PersonKind { persona: Persona::Child, impairments };
    }
    let is_street = scene == SceneKind::Street;
    let persona = Persona::ALL[rng.below(Persona::ALL.len())];
    // Without a bicycle there is no rider.
    let persona = if persona == Persona::Rider && !is_street { Persona::Child } else { persona };
    let mut kind = PersonKind::from(persona);
    for impairment in IMPAIRMENTS {
        // A rider needs both hands.
        let is_possible = persona != Persona::Rider || impairment != Impairment::OneHanded;
        if is_possible && rng.chance(0.2) {
            kind.impairments = kind.impairments.with(impairment);
        }
    }
    kind
}

/// Returns the task, the rules and the initial condition of a random episode.
fn random_setup(index: u64) -> (RuleSet, Setup) {
    let mut rng = RngStream::new(index, "reference episode", 0);
    let mut tasks: Vec<TaskId> = TaskId::paper().collect();
    // Furniture takes long, so the yard has fewer actions in an episode.
    let yards = tasks.iter().copied().filter(|t| t.info().scene == SceneKind::Yard);
    tasks.extend(yards.collect::<Vec<_>>().repeat(4));
    let task = tasks[(index % tasks.len() as u64) as usize];
    let set = match index / tasks.len() as u64 % 2 {
        0 => RuleSet::Paper,
        _ => RuleSet::Compat,
    };
    let settings = if rng.chance(0.5) { Settings::STANDARD } else { Settings::PAPER };
    let seeds = GeneratorSeeds { place: index, episode: index };
    let mut setup = generate_with(task, seeds, settings).expect("every seed has an episode");
    let scene = task.info().scene;
    // The partner and the helper; a third person stays a child.
    for person in setup.people.iter_mut().take(2) {
        if rng.chance(if scene == SceneKind::Street { 0.3 } else { 0.5 }) {
            *person = AgentSpec::new(random_kind(&mut rng, scene), person.pose, 0);
        }
    }
    if scene == SceneKind::Yard && rng.chance(0.4) {
        add_small_things(&mut setup, &mut rng);
    }
    add_vases(&mut setup, &mut rng);
    add_stacks(&mut setup, &mut rng);
    // Some goals are small enough to be completed.
    if rng.chance(0.3) {
        setup.goal.targets.truncate(1);
        setup.goal.targets[0].1 = 1 + rng.below(2) as u32;
    }
    // A third person may take the furniture that two are about to lift.
    if scene == SceneKind::Yard && rng.chance(0.4) {
        let mut pose = setup.people[1].pose;
        pose.position.x += 1.0;
        setup.people.push(AgentSpec::new(Persona::Adult, pose, 0));
    }
    setup.horizon = setup.horizon.min(300 + rng.below(3000) as u32);
    (set, setup)
}

/// Returns the indices of loose objects with this role.
fn loose(setup: &Setup, of_role: Role) -> Vec<usize> {
    let things = setup.things.iter().enumerate();
    let loose = things.filter(|(_, t)| !t.fixed && t.class.info().role == of_role);
    loose.map(|(k, _)| k).collect()
}

/// Adds targets and a basket beside the furniture of a yard, so that hands can be full.
fn add_small_things(setup: &mut Setup, rng: &mut RngStream) {
    let pieces = loose(setup, Role::HeavyTarget);
    for name in ["apple", "apple", "bread", "orange", "vase", "wood_basket"] {
        let Some(piece) = rng.choose(&pieces) else { return };
        let aside = Vec3::new(rng.range(-1.2, 1.2), 0.0, rng.range(-1.2, 1.2));
        let position = setup.things[*piece].position + aside;
        setup.things.push(ObjectSpec::new(ClassId::named(name), position.with_y(0.0), 0.0));
    }
}

/// Turns some targets into vases.
fn add_vases(setup: &mut Setup, rng: &mut RngStream) {
    for k in loose(setup, Role::Target) {
        if rng.chance(0.15) {
            setup.things[k].class = ClassId::named("vase");
        }
    }
}

/// Moves some targets onto obstacles, containers and furniture, and targets onto these.
fn add_stacks(setup: &mut Setup, rng: &mut RngStream) {
    let mut targets = loose(setup, Role::Target);
    let supports = [Role::Obstacle, Role::Container, Role::HeavyTarget];
    for below in supports.into_iter().flat_map(|r| loose(setup, r)).collect::<Vec<_>>() {
        let mut below = below;
        while rng.chance(0.4) && targets.len() > 2 {
            let above = targets.remove(rng.below(targets.len()));
            let spec = setup.things[below];
            let tops = blocks_of(&spec).into_iter().map(|b| b.y_range()[1]);
            let top_m = tops.fold(spec.position.y, f32::max);
            setup.things[above].position = spec.position.with_y(top_m);
            below = above;
        }
    }
}

/// Plays one random episode, and compares the reference with the world after every frame.
///
/// # Errors
/// The first difference.
pub fn play(index: u64) -> Result<Coverage, Box<Difference>> {
    let (set, setup) = random_setup(index);
    let mut driver = Driver::new(index);
    let difference = |(frame, text)| Box::new(Difference { episode: index, frame, text });
    compare(&setup, set, &mut driver).map_err(difference)
}

/// Plays an episode in which `choose` chooses the actions, and compares the reference with the
/// world after every frame.
///
/// # Errors
/// The first difference.
pub fn play_actions(
    setup: &Setup,
    set: RuleSet,
    choose: impl FnMut(&World, AgentId) -> Option<ResolvedAction>,
) -> Result<Coverage, Box<Difference>> {
    let difference = |(frame, text)| Box::new(Difference { episode: 0, frame, text });
    compare(setup, set, &mut Script(choose)).map_err(difference)
}

/// Source of actions.
trait Actor {
    /// Moves people between two frames; returns whether a person was moved.
    fn move_people(&mut self, world: &mut World) -> bool;
    /// Chooses the next action of a person; `None` lets it wait for another frame.
    fn choose(&mut self, world: &World, agent: AgentId) -> Option<ResolvedAction>;
}

impl Actor for Driver {
    fn move_people(&mut self, world: &mut World) -> bool {
        Driver::move_people(self, world)
    }

    fn choose(&mut self, world: &World, agent: AgentId) -> Option<ResolvedAction> {
        Driver::choose(self, world, agent)
    }
}

/// Actions that a function chooses.
struct Script<F>(F);

impl<F: FnMut(&World, AgentId) -> Option<ResolvedAction>> Actor for Script<F> {
    fn move_people(&mut self, _: &mut World) -> bool {
        false
    }

    fn choose(&mut self, world: &World, agent: AgentId) -> Option<ResolvedAction> {
        (self.0)(world, agent)
    }
}

/// Compares the reference with a world; returns the frame and a description of a difference.
fn compare(
    setup: &Setup,
    set: RuleSet,
    actor: &mut dyn Actor,
) -> Result<Coverage, (Frame, String)> {
    let rules = match set {
        RuleSet::Paper => Rules::paper(),
        RuleSet::Compat => Rules::compat(),
    };
    let mut world = World::new(setup.clone(), rules).expect("the setup is valid");
    let mut reference = Comparison::new(setup, set, &world);
    let mut coverage = Coverage { n_episodes: 1, ..Coverage::default() };
    while !world.is_over() {
        if actor.move_people(&mut world) {
            reference.move_people(&world);
        }
        let mut submitted = Vec::new();
        for agent in world.waiting() {
            // A call to lift furniture together may have given the person an action.
            let is_waiting = world.state().agents[agent.index()].activity.is_none();
            if let Some(action) = actor.choose(&world, agent).filter(|_| is_waiting) {
                world.submit(agent, action).expect("the agent waits");
                submitted.push((agent, action));
            }
        }
        let walked = walkers(&world);
        world.tick();
        let events = world.drain_events();
        let given = GivenQuantities::of(&world, &walked);
        reference.frame(&submitted, &given, &world, &events).map_err(|text| {
            let ongoing = reference.describe();
            let people = setup.people.iter().map(|p| p.kind().to_string()).collect::<Vec<_>>();
            let task = setup.task;
            let text =
                format!("{text}\n{task} {set:?}, {people:?}\nsubmitted {submitted:?}\n{ongoing}");
            (world.state().frame, text)
        })?;
        coverage.count(&events);
        coverage.n_frames += 1;
        if !submitted.is_empty() {
            coverage.n_joint_actions += 1;
        }
        for (agent, _) in submitted {
            *coverage.people.entry(person_name(setup, agent)).or_default() += 1;
        }
    }
    coverage.n_open = reference.n_open;
    let name = format!("{}, {set:?}", setup.task).to_lowercase();
    coverage.tasks.insert(name, coverage.n_joint_actions);
    Ok(coverage)
}

fn person_name(setup: &Setup, agent: AgentId) -> String {
    setup.people[agent.index()].kind().to_string()
}

/// Plays episodes from index `first` until they had this number of joint actions.
///
/// # Errors
/// The first difference.
pub fn play_many(first: u64, n_joint_actions: u64) -> Result<Coverage, Box<Difference>> {
    let mut total = Coverage::default();
    for index in first.. {
        if total.n_joint_actions >= n_joint_actions {
            break;
        }
        total.add(&play(index)?);
    }
    Ok(total)
}
