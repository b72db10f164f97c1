//! State of the slots of a study: which are free, taken or done. Time is a parameter.

/// State of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SlotState {
    Free,
    /// A participant has it.
    Taken {
        /// Number of the claim.
        claim: u64,
        /// Time of the claim, seconds.
        since_secs: u64,
    },
    /// A participant has finished.
    Done,
}

/// A participant's right to a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Claim {
    /// Slot, from 1.
    pub slot: u32,
    number: u64,
}

/// Effect of the end of a participant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finish {
    /// The slot is done.
    Counted,
    /// The slot was freed by time-out, and another participant has it or has finished it. The data are
    /// additional.
    Late,
}

/// Slots of a study.
#[derive(Clone, Debug)]
pub struct SlotTable {
    timeout_secs: u64,
    slots: Vec<SlotState>,
    n_claims: u64,
}

impl SlotTable {
    /// Creates `n` free slots. A slot is free again `timeout_secs` after it was taken.
    pub fn new(n: u32, timeout_secs: u64) -> SlotTable {
        SlotTable { timeout_secs, slots: vec![SlotState::Free; n as usize], n_claims: 0 }
    }

    /// Takes the lowest free slot at the time `now_secs`; `None` if all are taken or done.
    pub fn claim(&mut self, now_secs: u64) -> Option<Claim> {
        let is_free = |state: &SlotState| match *state {
            SlotState::Free => true,
            SlotState::Taken { since_secs, .. } => {
                now_secs.saturating_sub(since_secs) >= self.timeout_secs
            }
            SlotState::Done => false,
        };
        let k = self.slots.iter().position(is_free)?;
        self.n_claims += 1;
        self.slots[k] = SlotState::Taken { claim: self.n_claims, since_secs: now_secs };
        Some(Claim { slot: k as u32 + 1, number: self.n_claims })
    }

    /// Ends a participant's work. A participant who is late and whose slot was not given away counts.
    pub fn finish(&mut self, claim: Claim) -> Finish {
        if !self.is_held(claim) {
            return Finish::Late;
        }
        self.slots[claim.slot as usize - 1] = SlotState::Done;
        Finish::Counted
    }

    /// Frees the slot of a participant who has left and whose data are deleted.
    pub fn withdraw(&mut self, claim: Claim) {
        if self.is_held(claim) {
            self.slots[claim.slot as usize - 1] = SlotState::Free;
        }
    }

    /// Returns the slots that are done.
    pub fn done(&self) -> impl Iterator<Item = u32> {
        let numbered = (1..).zip(&self.slots);
        numbered.filter(|(_, state)| **state == SlotState::Done).map(|(slot, _)| slot)
    }

    fn is_held(&self, Claim { slot, number }: Claim) -> bool {
        let state = self.slots.get(slot as usize - 1);
        matches!(state, Some(SlotState::Taken { claim, .. }) if *claim == number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(table: &mut SlotTable, now_secs: u64) -> Claim {
        table.claim(now_secs).expect("a free slot")
    }

    #[test]
    fn a_slot_is_free_after_its_time_out_and_not_before() {
        let mut table = SlotTable::new(2, 60);
        let first = claim(&mut table, 0);
        assert_eq!((first.slot, claim(&mut table, 1).slot), (1, 2));
        assert_eq!(table.claim(59), None);
        let second = claim(&mut table, 60);
        assert_eq!(second.slot, 1);
        // The first participant is late: the slot belongs to the second one.
        assert_eq!(table.finish(first), Finish::Late);
        assert_eq!(table.finish(second), Finish::Counted);
        assert_eq!(table.finish(second), Finish::Late);
        assert_eq!(table.done().collect::<Vec<_>>(), [1]);
        assert_eq!(claim(&mut table, 1000).slot, 2);
        assert_eq!(table.claim(1000), None);
    }

    #[test]
    fn a_late_participant_counts_if_the_slot_was_not_given_away() {
        let mut table = SlotTable::new(1, 60);
        let only = claim(&mut table, 0);
        assert_eq!(table.finish(only), Finish::Counted);
        assert_eq!(table.claim(1_000_000), None);
    }

    #[test]
    fn a_withdrawn_slot_is_free_at_once() {
        let mut table = SlotTable::new(1, 60);
        let first = claim(&mut table, 0);
        table.withdraw(first);
        let second = claim(&mut table, 0);
        // A repeated withdrawal does not concern the next participant.
        table.withdraw(first);
        assert_eq!(table.finish(second), Finish::Counted);
    }
}
