//! Tests that an environment behaves the same in a batch and alone, for any batch size and position.
//! Images are written only to their place in the layout.

use std::collections::BTreeMap;

use chaic_core::action::Hand;
use chaic_core::observation::{FrameHistorySpec, Grants, SensorConfig};
use chaic_core::rng::RngStream;
use chaic_core::{Action, AgentId, EntityId, Target, TaskId};
use chaic_env::{
    AdvanceOutcome, AgentSlot, Env, EnvBatch, EnvError, EpisodeAgents, EpisodeConfig, ImageLayout,
    ImagesMut,
};
use chaic_episodes::{Episode, Split, episodes};
use xxhash_rust::xxh3::Xxh3;

/// Side of all images, pixels.
const SIZE: u32 = 16;
/// Decisions of each helper.
const N_DECISIONS: usize = 5;

const ALL: SensorConfig =
    SensorConfig { image_size: SIZE, rgb: true, depth: true, ids: true, frame_history: None };

fn bundled() -> Vec<Episode> {
    let episodes_of =
        |task| episodes(&Split::Test, task).map(|e| e.expect("bundled episodes are valid"));
    TaskId::paper().flat_map(|task| episodes_of(task).take(3)).collect()
}

fn config(bundled: &[Episode], number: usize) -> EpisodeConfig<'_> {
    EpisodeConfig {
        seed: (number / bundled.len()) as u32,
        image_size: Some(SIZE),
        ..EpisodeConfig::new(&bundled[number % bundled.len()], "caller")
    }
}

fn env(bundled: &[Episode], number: usize, grants: Grants, sensors: SensorConfig) -> Env {
    let helper = Some(AgentSlot::external(grants, sensors));
    let agents = EpisodeAgents { helper, partner: None };
    Env::new(config(bundled, number), agents).expect("the setup is valid")
}

/// Draws an action; some have pixels as targets.
fn random_action(rng: &mut RngStream) -> Action {
    let (column, row) = (rng.below(16) as u32, rng.below(16) as u32);
    let hand = Hand::Left;
    match rng.below(6) {
        0 | 1 => Action::MoveForward,
        2 => Action::TurnLeft,
        3 => Action::PickUp { object: Target::Pixel { column, row }, hand },
        4 => Action::PutOn { place: Target::Pixel { column, row }, hand },
        _ => Action::PickUp { object: Target::Entity(EntityId::FIRST_OBJECT), hand },
    }
}

/// Image buffers of the caller.
struct Buffers {
    rgb: Vec<u8>,
    depth_m: Vec<f32>,
    ids: Vec<u16>,
}

impl Buffers {
    /// Creates buffers with values that no image has.
    fn new(layout: ImageLayout) -> Buffers {
        let [rgb, depth, ids] = layout.lengths();
        Buffers { rgb: vec![7; rgb], depth_m: vec![-1.0; depth], ids: vec![u16::MAX; ids] }
    }

    fn images_mut(&mut self) -> ImagesMut<'_> {
        ImagesMut {
            rgb: Some(&mut self.rgb),
            depth_m: Some(&mut self.depth_m),
            ids: Some(&mut self.ids),
        }
    }

    fn digest_slot(&self, slot: usize, into: &mut Xxh3) {
        let n = (SIZE * SIZE) as usize;
        into.update(&self.rgb[3 * n * slot..3 * n * (slot + 1)]);
        for depth in &self.depth_m[n * slot..n * (slot + 1)] {
            into.update(&depth.to_bits().to_le_bytes());
        }
        for id in &self.ids[n * slot..n * (slot + 1)] {
            into.update(&id.to_le_bytes());
        }
    }
}

/// Methods that advance a batch and observe its agents.
#[derive(Clone, Copy)]
enum Passes {
    One,
    Two,
}

impl Passes {
    /// Advances and observes; returns the waiting slots.
    fn run(self, batch: &mut EnvBatch, buffers: &mut Buffers) -> Vec<usize> {
        let outcomes = match self {
            Passes::One => batch.advance_and_observe(None, buffers.images_mut()),
            Passes::Two => Ok(batch.advance(None)),
        };
        let outcomes = outcomes.expect("the buffers fit");
        assert!(outcomes.iter().all(|outcome| *outcome == Ok(AdvanceOutcome::NeedsAction)));
        match self {
            Passes::One => batch.waiting(),
            Passes::Two => batch.observe(buffers.images_mut()).expect("the buffers fit"),
        }
    }
}

/// Runs the environments of these numbers in one batch; returns a digest of observations and final
/// state for each.
fn run_batch(bundled: &[Episode], numbers: &[usize], passes: Passes) -> BTreeMap<usize, u64> {
    let envs = numbers.iter().map(|n| env(bundled, *n, Grants::IDS, ALL)).collect();
    let mut batch = EnvBatch::new(envs).expect("the sensors are equal");
    let mut buffers = Buffers::new(batch.layout());
    let rng = |n: &usize| RngStream::new(*n as u64, "batch", 0);
    let mut rngs: Vec<RngStream> = numbers.iter().map(rng).collect();
    let mut digests: Vec<Xxh3> = numbers.iter().map(|_| Xxh3::new()).collect();
    for _ in 0..N_DECISIONS {
        for slot in passes.run(&mut batch, &mut buffers) {
            let observation = batch.observation(slot).expect("the agent waits");
            digests[slot].update(
                format!("{:?} {:?}", observation.proprioception, observation.granted).as_bytes(),
            );
            buffers.digest_slot(slot, &mut digests[slot]);
            assert!(batch.submit(slot, random_action(&mut rngs[slot])));
        }
    }
    for (env, digest) in batch.envs().iter().zip(&mut digests) {
        digest.update(env.digest().to_string().as_bytes());
    }
    numbers.iter().copied().zip(digests.iter().map(Xxh3::digest)).collect()
}

#[test]
fn batch_size_and_position_change_nothing() {
    let bundled = bundled();
    let mut alone = BTreeMap::new();
    for number in 0..7 {
        alone.extend(run_batch(&bundled, &[number], Passes::Two));
    }
    let different: std::collections::BTreeSet<_> = alone.values().collect();
    assert_eq!(different.len(), 7, "the environments differ");
    for (size, passes) in [(7, Passes::Two), (64, Passes::One), (1024, Passes::Two)] {
        let numbers: Vec<usize> = (0..size).rev().collect();
        let mut together = run_batch(&bundled, &numbers, passes);
        together.retain(|number, _| *number < 7);
        assert_eq!(together, alone, "{size} environments");
    }
}

/// A second pass leaves the images and observations of the same turn.
#[test]
fn one_pass_observes_each_turn_once() {
    let bundled = bundled();
    let envs = (0..2).map(|n| env(&bundled, n, Grants::IDS, ALL)).collect();
    let mut batch = EnvBatch::new(envs).unwrap();
    let mut buffers = Buffers::new(batch.layout());
    Passes::One.run(&mut batch, &mut buffers);
    assert!(batch.submit(0, Action::TurnLeft));
    buffers.depth_m.fill(-1.0);
    assert_eq!(Passes::One.run(&mut batch, &mut buffers), [0, 1]);
    let (first, second) = buffers.depth_m.split_at((SIZE * SIZE) as usize);
    assert!(first.iter().all(|depth| *depth >= 0.0), "a new turn");
    assert!(second.iter().all(|depth| *depth == -1.0), "the same turn");
    assert!(batch.observation(1).is_some());
}

/// The caller's buffers show another state by then.
#[test]
fn a_restored_turn_is_observed_again() {
    let bundled = bundled();
    let mut batch = EnvBatch::new(vec![env(&bundled, 0, Grants::IDS, ALL)]).unwrap();
    let mut buffers = Buffers::new(batch.layout());
    Passes::One.run(&mut batch, &mut buffers);
    let snapshot = batch.envs()[0].snapshot().unwrap();
    let start = buffers.depth_m.clone();
    assert!(batch.submit(0, Action::TurnLeft));
    Passes::One.run(&mut batch, &mut buffers);
    buffers.depth_m.fill(-1.0);
    batch.restore(0, &snapshot).unwrap();
    assert_eq!(Passes::One.run(&mut batch, &mut buffers), [0]);
    assert!(buffers.depth_m == start);
    let mut alone = env(&bundled, 0, Grants::IDS, ALL);
    alone.restore(&snapshot).unwrap();
    let images = &alone.observe(AgentId::HELPER).unwrap().images;
    assert!(images.depth_m.as_ref() == Some(&start));
}

#[test]
fn a_frame_history_begins_after_the_last_decision() {
    let bundled = bundled();
    let spec = FrameHistorySpec { image_size: SIZE, every_frames: 1, max_len: 256 };
    let sensors = SensorConfig { frame_history: Some(spec), ..ALL };
    let envs = (0..2).map(|n| env(&bundled, n, Grants::IDS, sensors)).collect();
    let mut batch = EnvBatch::new(envs).unwrap();
    let mut buffers = Buffers::new(batch.layout());
    let frame = |batch: &EnvBatch| batch.envs()[1].world().state().frame;
    let history = |batch: &EnvBatch| -> Vec<u32> {
        let observation = batch.observation(1).expect("the agent was observed");
        observation.frame_history.iter().map(|taken| taken.frame).collect()
    };
    let mut before = 0;
    for _ in 0..2 {
        // Without an observation.
        batch.advance(None);
        before = frame(&batch);
        assert!(batch.submit(0, Action::TurnLeft) && batch.submit(1, Action::TurnLeft));
    }
    Passes::Two.run(&mut batch, &mut buffers);
    let expected: Vec<u32> = (before + 1..=frame(&batch)).collect();
    assert!(before > 0 && !expected.is_empty());
    assert_eq!(history(&batch), expected);
    // A repeated observation has the same history.
    assert!(batch.submit(0, Action::TurnLeft));
    Passes::Two.run(&mut batch, &mut buffers);
    assert_eq!(history(&batch), expected);
}

#[test]
fn absent_images_may_have_an_empty_buffer() {
    let bundled = bundled();
    let mut batch = EnvBatch::new(vec![env(&bundled, 0, Grants::NONE, ALL)]).unwrap();
    let mut buffers = Buffers::new(batch.layout());
    assert!(buffers.ids.is_empty(), "ids are not granted");
    for passes in [Passes::One, Passes::Two] {
        assert_eq!(passes.run(&mut batch, &mut buffers), [0]);
        assert!(buffers.depth_m.iter().all(|depth| *depth >= 0.0));
        buffers.depth_m.fill(-1.0);
    }
}

#[test]
fn a_batch_renders_the_images_of_its_environments() {
    let bundled = bundled();
    let mut batch =
        EnvBatch::new((0..5).map(|n| env(&bundled, 8 + n, Grants::IDS, ALL)).collect()).unwrap();
    batch.advance(None);
    let mut buffers = Buffers::new(batch.layout());
    assert_eq!(batch.observe(buffers.images_mut()).unwrap(), [0, 1, 2, 3, 4]);
    let n = (SIZE * SIZE) as usize;
    for k in 0..5 {
        let mut alone = env(&bundled, 8 + k, Grants::IDS, ALL);
        alone.advance(None).unwrap();
        let expected = alone.observe(AgentId::HELPER).unwrap();
        let images = &expected.images;
        assert_eq!(images.rgb.as_deref(), Some(&buffers.rgb[3 * n * k..3 * n * (k + 1)]));
        assert_eq!(images.depth_m.as_deref(), Some(&buffers.depth_m[n * k..n * (k + 1)]));
        assert_eq!(images.ids.as_deref(), Some(&buffers.ids[n * k..n * (k + 1)]));
        let found = batch.observation(k).unwrap();
        assert_eq!(expected.proprioception, found.proprioception);
        assert_eq!(expected.granted, found.granted);
    }
}

#[test]
fn buffers_of_agents_that_do_not_wait_stay_unchanged() {
    let bundled = bundled();
    let mut batch =
        EnvBatch::new((0..2).map(|n| env(&bundled, n, Grants::IDS, ALL)).collect()).unwrap();
    batch.advance(None);
    let mut buffers = Buffers::new(batch.layout());
    assert!(batch.submit(0, Action::Wait { frames: 50 }), "without an observation");
    assert!(!batch.submit(0, Action::TurnLeft), "it has chosen already");
    assert_eq!(batch.observe(buffers.images_mut()).unwrap(), [1]);
    let n = (SIZE * SIZE) as usize;
    assert!(buffers.ids[..n].iter().all(|id| *id == u16::MAX), "slot 0 is unchanged");
    assert!(buffers.ids[n..].iter().all(|id| *id != u16::MAX));
    assert!(batch.observation(0).is_none() && batch.observation(2).is_none());
    assert!(!batch.submit(2, Action::TurnLeft), "there is no such slot");
}

#[test]
fn different_sensors_wrong_buffers_and_unknown_environments_are_refused() {
    let bundled = bundled();
    let small = SensorConfig { image_size: 8, ..ALL };
    let mut other = config(&bundled, 1);
    other.image_size = None;
    let helper = Some(AgentSlot::external(Grants::IDS, small));
    let other = Env::new(other, EpisodeAgents { helper, partner: None }).unwrap();
    let result = EnvBatch::new(vec![env(&bundled, 0, Grants::IDS, ALL), other]);
    assert!(matches!(result, Err(EnvError::Batch(_))), "the sensors differ");
    assert!(matches!(EnvBatch::new(Vec::new()), Err(EnvError::Batch(_))), "there is no agent");

    // The layout has no ids without their grant.
    let mut batch = EnvBatch::new(vec![env(&bundled, 0, Grants::NONE, ALL)]).unwrap();
    assert!(!batch.layout().ids);
    batch.advance(None);
    let mut buffers = Buffers::new(ImageLayout { ids: true, ..batch.layout() });
    let refused = batch.observe(buffers.images_mut());
    assert!(matches!(refused, Err(EnvError::Buffer { image: "ids", expected: 0, .. })));
    let short = ImagesMut { rgb: Some(&mut buffers.rgb[1..]), ..ImagesMut::default() };
    assert!(matches!(batch.observe(short), Err(EnvError::Buffer { image: "color", .. })));
    let config = config(&bundled, 3);
    let before = batch.envs()[0].digest();
    assert!(batch.reset_many(vec![(0, config), (1, config)]).is_err(), "there is one environment");
    assert_eq!(batch.envs()[0].digest(), before, "none is reset");
    assert!(batch.reset(0, config).is_ok());
    let snapshot = batch.envs()[0].snapshot().unwrap();
    batch.advance(Some(60));
    assert!(batch.restore(1, &snapshot).is_err());
    batch.restore(0, &snapshot).unwrap();
    assert_eq!(batch.envs()[0].world().state().frame, 0);
}

#[test]
fn agents_without_images_observe_the_same_in_a_batch_and_alone() {
    let bundled = bundled();
    let sensors = SensorConfig { rgb: false, depth: false, ids: false, ..ALL };
    let new_env = || env(&bundled, 0, Grants::PLANNER, sensors);
    let (mut alone, mut batch) = (new_env(), EnvBatch::new(vec![new_env()]).unwrap());
    let pixel = Target::Pixel { column: SIZE / 2, row: SIZE / 2 };
    for k in 0..8 {
        alone.advance(None).unwrap();
        batch.advance(None);
        batch.observe(ImagesMut::default()).unwrap();
        let expected = alone.observe(AgentId::HELPER).unwrap();
        let found = batch.observation(0).unwrap();
        assert_eq!(format!("{found:?}"), format!("{expected:?}"), "decision {k}");
        // The ids that resolve the pixel are not part of the next observation.
        let action = match k % 2 {
            0 => Action::PickUp { object: pixel, hand: Hand::Left },
            _ => Action::TurnLeft,
        };
        assert!(alone.submit(AgentId::HELPER, action) && batch.submit(0, action));
    }
    assert_eq!(alone.digest(), batch.envs()[0].digest());
}

#[test]
fn actions_submitted_together_act_as_one_by_one() {
    let bundled = bundled();
    let without_images = SensorConfig { rgb: false, depth: false, ids: false, ..ALL };
    for (sensors, is_observed) in [(ALL, false), (ALL, true), (without_images, true)] {
        let new_batch = || {
            let envs = (0..4).map(|n| env(&bundled, n, Grants::NONE, sensors)).collect();
            EnvBatch::new(envs).unwrap()
        };
        let (mut serial, mut parallel) = (new_batch(), new_batch());
        let mut buffers = Buffers::new(serial.layout());
        let mut rng = RngStream::new(0, "submit many", 0);
        for _ in 0..N_DECISIONS {
            for batch in [&mut serial, &mut parallel] {
                batch.advance(None);
                if is_observed {
                    batch.observe(buffers.images_mut()).unwrap();
                }
            }
            // Slot 2 chooses twice, and there is no slot 9.
            let actions = [3, 2, 0, 9, 2].map(|slot| (slot, random_action(&mut rng)));
            let one_by_one: Vec<bool> =
                actions.iter().map(|(slot, action)| serial.submit(*slot, *action)).collect();
            assert_eq!(parallel.submit_many(&actions), one_by_one);
            assert_eq!(parallel.waiting(), [1]);
            let last = random_action(&mut rng);
            assert!(serial.submit(1, last));
            assert_eq!(parallel.submit_many(&[(1, last)]), [true]);
        }
        serial.advance(None);
        parallel.advance(None);
        for (one, other) in serial.envs().iter().zip(parallel.envs()) {
            assert_eq!(one.digest(), other.digest());
        }
    }
}
