//! Promise: an environment in a batch plays and sees as it would alone, whatever the batch's size and
//! wherever in it it stands; images land where the layout says and nowhere else.

use std::collections::BTreeMap;

use chaic_core::action::Hand;
use chaic_core::observation::{Grants, Senses};
use chaic_core::rng::Stream;
use chaic_core::{Action, AgentId, EntityId, Target, TaskId};
use chaic_env::rules::RuleSet;
use chaic_env::{
    Appearance, Env, EnvBatch, EnvError, EpisodeConfig, Flow, ImageLayout, ImagesMut, Minds, Seat,
};
use chaic_episodes::{Episode, Split, episodes};
use xxhash_rust::xxh3::Xxh3;

/// Side of all images, pixels.
const SIZE: u32 = 16;
/// Decisions of each helper.
const N_DECISIONS: usize = 5;

const ALL: Senses = Senses { image_size: SIZE, rgb: true, depth: true, ids: true, film: None };

fn bundled() -> Vec<Episode> {
    let of = |task| episodes(&Split::Test, task).map(|e| e.expect("bundled episodes are valid"));
    TaskId::paper().flat_map(|task| of(task).take(3)).collect()
}

fn config(bundled: &[Episode], number: usize) -> EpisodeConfig<'_> {
    EpisodeConfig {
        episode: &bundled[number % bundled.len()],
        seed: (number / bundled.len()) as u32,
        rules: RuleSet::PAPER,
        helper: "caller",
        partner: None,
        image_size: Some(SIZE),
        appearance: Appearance::Canonical,
    }
}

fn env(bundled: &[Episode], number: usize, grants: Grants, senses: Senses) -> Env {
    let helper = Some(Seat::of_caller(grants, senses));
    Env::new(config(bundled, number), Minds { helper, partner: None }).expect("it is valid")
}

/// Something to do, with pixels among the targets.
fn some_action(luck: &mut Stream) -> Action {
    let (column, row) = (luck.below(16) as u32, luck.below(16) as u32);
    let hand = Hand::Left;
    match luck.below(6) {
        0 | 1 => Action::MoveForward,
        2 => Action::TurnLeft,
        3 => Action::PickUp { object: Target::Pixel { column, row }, hand },
        4 => Action::PutOn { place: Target::Pixel { column, row }, hand },
        _ => Action::PickUp { object: Target::Entity(EntityId::FIRST_OBJECT), hand },
    }
}

/// What the caller's buffers are made of.
struct Buffers {
    rgb: Vec<u8>,
    depth_m: Vec<f32>,
    ids: Vec<u16>,
}

impl Buffers {
    /// Full of what no image holds.
    fn of(layout: ImageLayout) -> Buffers {
        let [rgb, depth, ids] = layout.lengths();
        Buffers { rgb: vec![7; rgb], depth_m: vec![-1.0; depth], ids: vec![u16::MAX; ids] }
    }

    fn lent(&mut self) -> ImagesMut<'_> {
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

/// Plays the environments of these numbers in one batch: what each of them saw and came to.
fn played(bundled: &[Episode], numbers: &[usize]) -> BTreeMap<usize, u64> {
    let envs = numbers.iter().map(|n| env(bundled, *n, Grants::IDS, ALL)).collect();
    let mut batch = EnvBatch::new(envs).expect("all see alike");
    let mut buffers = Buffers::of(batch.layout());
    let luck = |n: &usize| Stream::new(*n as u64, "batch", 0);
    let mut lucks: Vec<Stream> = numbers.iter().map(luck).collect();
    let mut digests: Vec<Xxh3> = numbers.iter().map(|_| Xxh3::new()).collect();
    for _ in 0..N_DECISIONS {
        assert!(batch.advance(None).iter().all(|flow| *flow == Ok(Flow::Waits)));
        for slot in batch.observe(buffers.lent()).expect("the buffers fit") {
            let seen = batch.observation(slot).expect("it waits");
            digests[slot].update(format!("{:?} {:?}", seen.own, seen.granted).as_bytes());
            buffers.digest_slot(slot, &mut digests[slot]);
            assert!(batch.submit(slot, some_action(&mut lucks[slot])));
        }
    }
    for (env, digest) in batch.envs().iter().zip(&mut digests) {
        digest.update(env.digest().to_string().as_bytes());
    }
    numbers.iter().copied().zip(digests.iter().map(Xxh3::digest)).collect()
}

#[test]
fn neither_size_nor_place_in_a_batch_changes_anything() {
    let bundled = bundled();
    let mut alone = BTreeMap::new();
    for number in 0..7 {
        alone.extend(played(&bundled, &[number]));
    }
    let different: std::collections::BTreeSet<_> = alone.values().collect();
    assert_eq!(different.len(), 7, "each environment is another one");
    for size in [7, 64, 1024] {
        let numbers: Vec<usize> = (0..size).rev().collect();
        let mut together = played(&bundled, &numbers);
        together.retain(|number, _| *number < 7);
        assert_eq!(together, alone, "{size} environments");
    }
}

#[test]
fn images_of_a_batch_are_those_of_its_environments() {
    let bundled = bundled();
    let mut batch =
        EnvBatch::new((0..5).map(|n| env(&bundled, 8 + n, Grants::IDS, ALL)).collect()).unwrap();
    batch.advance(None);
    let mut buffers = Buffers::of(batch.layout());
    assert_eq!(batch.observe(buffers.lent()).unwrap(), [0, 1, 2, 3, 4]);
    let n = (SIZE * SIZE) as usize;
    for k in 0..5 {
        let mut alone = env(&bundled, 8 + k, Grants::IDS, ALL);
        alone.advance(None).unwrap();
        let seen = alone.observe(AgentId::HELPER).unwrap();
        let images = &seen.images;
        assert_eq!(images.rgb.as_deref(), Some(&buffers.rgb[3 * n * k..3 * n * (k + 1)]));
        assert_eq!(images.depth_m.as_deref(), Some(&buffers.depth_m[n * k..n * (k + 1)]));
        assert_eq!(images.ids.as_deref(), Some(&buffers.ids[n * k..n * (k + 1)]));
        let told = batch.observation(k).unwrap();
        assert_eq!((&seen.own, &seen.granted), (&told.own, &told.granted));
    }
}

#[test]
fn who_doesn_t_wait_is_left_as_it_was() {
    let bundled = bundled();
    let mut batch =
        EnvBatch::new((0..2).map(|n| env(&bundled, n, Grants::IDS, ALL)).collect()).unwrap();
    batch.advance(None);
    let mut buffers = Buffers::of(batch.layout());
    assert!(batch.submit(0, Action::Wait { frames: 50 }), "without having looked");
    assert!(!batch.submit(0, Action::TurnLeft), "it has chosen");
    assert_eq!(batch.observe(buffers.lent()).unwrap(), [1]);
    let n = (SIZE * SIZE) as usize;
    assert!(buffers.ids[..n].iter().all(|id| *id == u16::MAX), "slot 0 is as it was");
    assert!(buffers.ids[n..].iter().all(|id| *id != u16::MAX));
    assert!(batch.observation(0).is_none() && batch.observation(2).is_none());
    assert!(!batch.submit(2, Action::TurnLeft), "there is no such slot");
}

#[test]
fn what_does_not_fit_is_refused() {
    let bundled = bundled();
    let small = Senses { image_size: 8, ..ALL };
    let mut other = config(&bundled, 1);
    other.image_size = None;
    let helper = Some(Seat::of_caller(Grants::IDS, small));
    let other = Env::new(other, Minds { helper, partner: None }).unwrap();
    let unlike = EnvBatch::new(vec![env(&bundled, 0, Grants::IDS, ALL), other]);
    assert!(matches!(unlike, Err(EnvError::Batch(_))), "they see differently");
    assert!(matches!(EnvBatch::new(Vec::new()), Err(EnvError::Batch(_))), "nobody is there");

    // Ids that aren't granted have no place in the layout.
    let mut batch = EnvBatch::new(vec![env(&bundled, 0, Grants::NONE, ALL)]).unwrap();
    assert!(!batch.layout().ids);
    batch.advance(None);
    let mut buffers = Buffers::of(ImageLayout { ids: true, ..batch.layout() });
    let refused = batch.observe(buffers.lent());
    assert!(matches!(refused, Err(EnvError::Buffer { image: "ids", expected: 0, .. })));
    let short = ImagesMut { rgb: Some(&mut buffers.rgb[1..]), ..ImagesMut::default() };
    assert!(matches!(batch.observe(short), Err(EnvError::Buffer { image: "color", .. })));
    let config = config(&bundled, 3);
    let before = batch.envs()[0].digest();
    assert!(batch.reset_many(vec![(0, config), (1, config)]).is_err(), "there is but one");
    assert_eq!(batch.envs()[0].digest(), before, "none is reset then");
    assert!(batch.reset(0, config).is_ok());
    let snapshot = batch.envs()[0].snapshot().unwrap();
    batch.advance(Some(60));
    assert!(batch.restore(1, &snapshot).is_err());
    batch.restore(0, &snapshot).unwrap();
    assert_eq!(batch.envs()[0].world().state().frame, 0);
}
