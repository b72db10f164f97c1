//! Slots of a study, and the choice of the slot of the next participant. Time is a parameter.

/// A participant with a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotHolder {
    /// Slot, from 1.
    pub slot: u32,
    /// Time of the entry, seconds.
    pub since_secs: u64,
    /// True if the participant has finished.
    pub is_complete: bool,
}

/// Returns the lowest free one of `n_slots` slots at the time `now_secs`. A slot is done if a participant with
/// it has finished, and taken until `timeout_secs` after the entry of its last participant.
pub fn lowest_free_slot(
    n_slots: u32,
    timeout_secs: u64,
    now_secs: u64,
    holders: impl IntoIterator<Item = SlotHolder>,
) -> Option<u32> {
    let mut is_taken = vec![false; n_slots as usize];
    for SlotHolder { slot, since_secs, is_complete } in holders {
        if is_complete || now_secs.saturating_sub(since_secs) < timeout_secs {
            is_taken[slot as usize - 1] = true;
        }
    }
    (1..).zip(is_taken).find(|(_, is_taken)| !is_taken).map(|(slot, _)| slot)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_is_free_after_its_time_out_unless_somebody_has_finished_it() {
        let holder = |slot, since_secs, is_complete| SlotHolder { slot, since_secs, is_complete };
        let free = |holders: &[SlotHolder], now_secs| {
            lowest_free_slot(2, 60, now_secs, holders.iter().copied())
        };
        assert_eq!(free(&[], 0), Some(1));
        let both = [holder(1, 0, false), holder(2, 1, false)];
        assert_eq!(
            [0, 59, 60, 61].map(|now_secs| free(&both, now_secs)),
            [None, None, Some(1), Some(1)]
        );
        // The first slot was given away; one of its two participants has finished it.
        for finished in [0, 2] {
            let mut holders = [both[0], both[1], holder(1, 60, false)];
            assert_eq!(free(&holders, 61), Some(2));
            holders[finished].is_complete = true;
            assert_eq!(free(&holders, 1000), Some(2));
        }
        assert_eq!(free(&both.map(|both| holder(both.slot, 0, true)), 1000), None);
        assert_eq!(
            free(&both[1..], 2),
            Some(1),
            "a participant whose data are deleted has no slot"
        );
    }
}
