//! Conditions on measured numbers, and choices for conditions that rounding leaves open.
//!
//! The world computes with 32-bit numbers, the reference with 64-bit ones. A distance within
//! [`TOLERANCE`] of a limit decides nothing. The reference then follows both answers, and
//! the comparison drops the one that differs from the world.

/// Largest difference between two computations of one length, meters.
pub(crate) const TOLERANCE: f64 = 1e-4;

/// Answer to a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// The condition holds.
    Yes,
    /// The condition does not hold.
    No,
    /// The numbers do not decide.
    Open,
}

impl Verdict {
    /// Returns whether a number is at most a limit.
    pub(crate) fn at_most(value: f64, limit: f64) -> Verdict {
        if value <= limit - TOLERANCE {
            Verdict::Yes
        } else if value >= limit + TOLERANCE {
            Verdict::No
        } else {
            Verdict::Open
        }
    }

    /// Returns whether both conditions hold.
    pub(crate) fn and(self, other: Verdict) -> Verdict {
        match (self, other) {
            (Verdict::No, _) | (_, Verdict::No) => Verdict::No,
            (Verdict::Yes, Verdict::Yes) => Verdict::Yes,
            _ => Verdict::Open,
        }
    }

    /// Returns whether one of the conditions holds.
    pub(crate) fn or(self, other: Verdict) -> Verdict {
        self.not().and(other.not()).not()
    }

    /// Returns the opposite.
    pub(crate) fn not(self) -> Verdict {
        match self {
            Verdict::Yes => Verdict::No,
            Verdict::No => Verdict::Yes,
            Verdict::Open => Verdict::Open,
        }
    }

    /// Returns the verdict of a condition that needs no tolerance.
    pub(crate) fn sure(holds: bool) -> Verdict {
        if holds { Verdict::Yes } else { Verdict::No }
    }
}

/// Answers to the open conditions of one frame, in the order in which they occur.
#[derive(Clone, Debug, Default)]
pub(crate) struct Choices {
    answers: Vec<bool>,
    n_used: usize,
}

impl Choices {
    /// Returns the answer to a condition; for an open one, the next of the answers.
    pub(crate) fn decide(&mut self, verdict: Verdict) -> bool {
        match verdict {
            Verdict::Yes => true,
            Verdict::No => false,
            Verdict::Open => {
                if self.n_used == self.answers.len() {
                    self.answers.push(false);
                }
                self.n_used += 1;
                self.answers[self.n_used - 1]
            }
        }
    }

    /// Returns the number of open conditions so far.
    pub(crate) fn n_open(&self) -> usize {
        self.n_used
    }

    /// Moves to the next combination of answers; returns false after the last one.
    pub(crate) fn advance(&mut self) -> bool {
        self.answers.truncate(self.n_used);
        self.n_used = 0;
        while let Some(answer) = self.answers.pop() {
            if !answer {
                self.answers.push(true);
                return true;
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_combinations_of_open_answers_are_tried_once() {
        let mut choices = Choices::default();
        let mut seen = Vec::new();
        loop {
            let first = choices.decide(Verdict::Open);
            assert!(choices.decide(Verdict::Yes) && !choices.decide(Verdict::No));
            // The second question is asked after a "no" only.
            let second = if first { None } else { Some(choices.decide(Verdict::Open)) };
            seen.push((first, second));
            if !choices.advance() {
                break;
            }
        }
        assert_eq!(seen, [(false, Some(false)), (false, Some(true)), (true, None)]);
    }
}
