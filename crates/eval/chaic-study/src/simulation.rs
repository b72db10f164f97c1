//! Simulated participants with drop-outs, and the balance of the design after them.

use std::collections::BTreeMap;

use chaic_core::rng::RngStream;

use crate::plan::Plan;
use crate::slots::{Claim, Finish, SlotTable};

/// Longest time between the arrivals of two participants, seconds.
const MAX_ARRIVAL_SECS: f32 = 600.0;
/// Shortest and longest stay, in units of the estimated length.
const STAY: [f32; 2] = [1.0, 2.0];
/// Seconds of a minute.
const SECS_PER_MINUTE: f64 = 60.0;

/// Balance of a design after simulated participants.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Balance {
    /// Number of participants who arrived.
    pub arrived: u32,
    /// Number of participants who finished in time.
    pub completed: u32,
    /// Number of participants who finished after their slot had been given away.
    pub late: u32,
    /// Number of finished slots for each pair of position (from 0) and condition.
    pub counts: Vec<Vec<u32>>,
    /// Number of blocks of slots that are finished in part.
    pub open_blocks: u32,
}

impl Balance {
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

/// A participant who is present.
struct Participant {
    claim: Claim,
    leaves_secs: u64,
    finishes: bool,
}

/// Simulates participants who arrive one after the other, each with this probability of dropping out
/// without notice. The slots of drop-outs are free after the study's time-out.
pub fn simulate(plan: &Plan, n_participants: u32, dropout: f64) -> Balance {
    let timeout_secs = u64::from(plan.study().timeout_minutes) * 60;
    let length_secs = (plan.length_minutes() * SECS_PER_MINUTE) as f32;
    let mut table = SlotTable::new(n_participants, timeout_secs);
    let (mut now_secs, mut late) = (0, 0);
    let mut present: Vec<Participant> = Vec::new();
    for k in 0..n_participants {
        let mut draws = RngStream::new(plan.seed(), "study_participants", u64::from(k));
        now_secs += draws.range(0.0, MAX_ARRIVAL_SECS) as u64;
        late += leave(&mut table, &mut present, now_secs);
        let stay_secs = draws.range(STAY[0], STAY[1]) * length_secs;
        let finishes = !draws.chance(dropout as f32);
        // There are as many slots as participants, so one is free.
        if let Some(claim) = table.claim(now_secs) {
            let leaves_secs = now_secs + stay_secs as u64;
            present.push(Participant { claim, leaves_secs, finishes });
        }
    }
    late += leave(&mut table, &mut present, u64::MAX);
    balance(plan, n_participants, &table, late)
}

/// Ends the participants who leave up to now, in this order. Returns the number of late ones.
fn leave(table: &mut SlotTable, present: &mut Vec<Participant>, now_secs: u64) -> u32 {
    present.sort_by_key(|participant| participant.leaves_secs);
    let n_leaving = present.partition_point(|participant| participant.leaves_secs <= now_secs);
    let finished = present.drain(..n_leaving).filter(|participant| participant.finishes);
    finished.filter(|participant| table.finish(participant.claim) == Finish::Late).count() as u32
}

fn balance(plan: &Plan, arrived: u32, table: &SlotTable, late: u32) -> Balance {
    let assignment = plan.assignment();
    let n_positions = assignment.orders()[0].len();
    let mut counts = vec![vec![0; plan.conditions().len()]; n_positions];
    let mut blocks: BTreeMap<usize, usize> = BTreeMap::new();
    let mut completed = 0;
    for slot in table.done() {
        completed += 1;
        *blocks.entry(assignment.block(slot)).or_default() += 1;
        for (position, condition) in assignment.order(slot).iter().enumerate() {
            counts[position][*condition] += 1;
        }
    }
    let n_orders = assignment.orders().len();
    let open_blocks = blocks.values().filter(|n| **n < n_orders).count() as u32;
    Balance { arrived, completed, late, counts, open_blocks }
}
