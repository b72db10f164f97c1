//! States of a replay at regular intervals.

use chaic_core::Frame;

/// Initial interval between stored states, frames; longer in long episodes.
const INTERVAL: Frame = 100;
/// Maximum number of stored states, an even number: it bounds the memory of long episodes.
const MAX_STATES: usize = 256;

/// States at multiples of an interval. Any frame is at most one interval after a state. If the
/// number of states reaches the maximum, the interval doubles.
pub struct Keyframes<T> {
    interval: Frame,
    states: Vec<T>,
}

impl<T: Clone> Keyframes<T> {
    /// Stores the state of frame 0.
    pub fn new(start: T) -> Keyframes<T> {
        Keyframes { interval: INTERVAL, states: vec![start] }
    }

    /// Stores the state of a frame if it is due. Call it for each frame in ascending order.
    pub fn add(&mut self, frame: Frame, state: &T) {
        if !frame.is_multiple_of(self.interval) {
            return;
        }
        if self.states.len() == MAX_STATES {
            let mut is_kept = false;
            self.states.retain(|_| {
                is_kept = !is_kept;
                is_kept
            });
            self.interval *= 2;
        }
        self.states.push(state.clone());
    }

    /// Returns the stored state from which to reach a frame; `None` to start from the current state, at frame `now`.
    pub fn start_for(&self, frame: Frame, now: Frame) -> Option<&T> {
        let (wanted, current) = (frame / self.interval, now / self.interval);
        let is_reached_from_now = frame >= now && wanted <= current;
        if is_reached_from_now {
            return None;
        }
        self.states.get(wanted as usize).or(self.states.last())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the keyframes of an episode in which the state is the frame.
    fn keyframes(last: Frame) -> Keyframes<Frame> {
        let mut keyframes = Keyframes::new(0);
        (1..=last).for_each(|frame| keyframes.add(frame, &frame));
        keyframes
    }

    #[test]
    fn a_frame_is_reached_from_the_nearest_state_before_it() {
        let keyframes = keyframes(450);
        assert_eq!(keyframes.start_for(337, 0), Some(&300));
        assert_eq!(keyframes.start_for(337, 450), Some(&300));
        assert_eq!(keyframes.start_for(337, 310), None);
        assert_eq!(keyframes.start_for(337, 337), None);
        assert_eq!(keyframes.start_for(310, 337), Some(&300));
    }

    #[test]
    fn long_episodes_store_fewer_states() {
        for last in [25_500, 25_600, 60_000, 1_000_000] {
            let keyframes = keyframes(last);
            assert!(keyframes.states.len() <= MAX_STATES, "{last}");
            assert!(keyframes.states.len() > MAX_STATES / 2, "{last}");
            for frame in [0, 99, 12_345, last - 1, last] {
                let found = keyframes.start_for(frame, Frame::MAX);
                let start = *found.expect("the current frame is another one");
                assert!(start <= frame && frame - start < keyframes.interval, "{last} {frame}");
            }
        }
    }
}
