//! Simulated participants with drop-outs, and the balance of the design after them.

use std::collections::{BTreeMap, BTreeSet};

use chaic_core::rng::RngStream;

use crate::plan::StudyPlan;
use crate::slots::{SlotHolder, lowest_free_slot};

/// Longest time between the arrivals of two participants, seconds.
const MAX_ARRIVAL_SECS: f32 = 600.0;
/// Shortest and longest stay, in units of the estimated length.
const STAY: [f32; 2] = [1.0, 2.0];
/// Seconds of a minute.
const SECS_PER_MINUTE: f64 = 60.0;

/// Balance of a design after simulated participants.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DesignBalance {
    /// Number of participants who arrived.
    pub arrived: u32,
    /// Number of finished slots.
    pub completed: u32,
    /// Number of participants who finished after their slot had been given away.
    pub late: u32,
    /// Number of finished slots for each pair of position (from 0) and condition.
    pub counts: Vec<Vec<u32>>,
    /// Number of blocks of slots that are finished in part.
    pub open_blocks: u32,
}

impl DesignBalance {
    /// Returns the smallest and the largest count of all positions and conditions.
    pub fn range(&self) -> [u32; 2] {
        let all = || self.counts.iter().flatten().copied();
        [all().min().unwrap_or(0), all().max().unwrap_or(0)]
    }

    /// Returns the largest minus the smallest count.
    pub fn spread(&self) -> u32 {
        let [low, high] = self.range();
        high - low
    }
}

/// A simulated participant.
#[derive(Clone, Copy)]
struct Participant {
    holder: SlotHolder,
    leaves_secs: u64,
    finishes: bool,
}

/// Simulates participants who arrive one after the other, each with this probability of dropping out
/// without notice. The slots of drop-outs are free after the study's time-out.
pub fn simulate(plan: &StudyPlan, n_participants: u32, dropout: f64) -> DesignBalance {
    let timeout_secs = u64::from(plan.study().timeout_minutes) * 60;
    let length_secs = (plan.length_minutes() * SECS_PER_MINUTE) as f32;
    let (mut now_secs, mut late) = (0, 0);
    let mut participants: Vec<Participant> = Vec::new();
    for k in 0..n_participants {
        let mut draws = RngStream::new(plan.seed(), "study_participants", u64::from(k));
        now_secs += draws.range(0.0, MAX_ARRIVAL_SECS) as u64;
        late += leave(&mut participants, now_secs);
        let stay_secs = draws.range(STAY[0], STAY[1]) * length_secs;
        let finishes = !draws.chance(dropout as f32);
        let holders = participants.iter().map(|participant| participant.holder);
        // There are as many slots as participants, so one is free.
        if let Some(slot) = lowest_free_slot(n_participants, timeout_secs, now_secs, holders) {
            let holder = SlotHolder { slot, since_secs: now_secs, is_complete: false };
            let leaves_secs = now_secs + stay_secs as u64;
            participants.push(Participant { holder, leaves_secs, finishes });
        }
    }
    late += leave(&mut participants, u64::MAX);
    let complete = participants.iter().filter(|participant| participant.holder.is_complete);
    let done: BTreeSet<u32> = complete.map(|participant| participant.holder.slot).collect();
    balance(plan, n_participants, &done, late)
}

/// Ends the participants who leave up to now. Returns the number of those whose slot had been given away.
fn leave(participants: &mut [Participant], now_secs: u64) -> u32 {
    let mut late = 0;
    for k in 0..participants.len() {
        let Participant { holder, leaves_secs, finishes } = participants[k];
        if finishes && !holder.is_complete && leaves_secs <= now_secs {
            let has_slot = |other: &Participant| other.holder.slot == holder.slot;
            late += u32::from(participants[k + 1..].iter().any(has_slot));
            participants[k].holder.is_complete = true;
        }
    }
    late
}

fn balance(plan: &StudyPlan, arrived: u32, done: &BTreeSet<u32>, late: u32) -> DesignBalance {
    let assignment = plan.assignment();
    let n_positions = assignment.orders()[0].len();
    let mut counts = vec![vec![0; plan.conditions().len()]; n_positions];
    let mut blocks: BTreeMap<usize, usize> = BTreeMap::new();
    for slot in done.iter().copied() {
        *blocks.entry(assignment.block(slot)).or_default() += 1;
        for (position, condition) in assignment.order(slot).iter().enumerate() {
            counts[position][*condition] += 1;
        }
    }
    let n_orders = assignment.orders().len();
    let open_blocks = blocks.values().filter(|n| **n < n_orders).count() as u32;
    DesignBalance { arrived, completed: done.len() as u32, late, counts, open_blocks }
}
