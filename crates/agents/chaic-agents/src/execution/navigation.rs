//! Interfaces of navigation: to a destination, and to an object for an interaction.

use std::fmt::Debug;

use chaic_core::Vec2;

use super::destination::Destination;
use crate::memory::Memory;
use crate::track::{Intent, TrackId};

/// Result of one navigation step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NavigationStep {
    /// Take this action next.
    Act(Intent),
    /// The destination is reached.
    Arrived,
    /// No path is known.
    Unreachable,
}

/// Assessment of a path, by which exploration ends or waits (facts A1.6).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PathState {
    /// The path is worth following.
    #[default]
    Open,
    /// The path costs too much to be worth exploring.
    TooCostly,
    /// The path passes an obstacle, and the agent waits for another to remove it.
    Blocked,
}

/// Navigates to destinations. Keeps its state between decisions, such as the path.
pub trait Navigator: Debug + Send + Sync {
    /// Returns the next action towards `destination`.
    fn step(&mut self, memory: &mut Memory, destination: &Destination) -> NavigationStep;

    /// Returns the assessment of the path at the last step. Only the original's navigation assesses
    /// paths.
    fn path_state(&self) -> PathState {
        PathState::Open
    }

    /// Returns the cells of the current path from the agent on; empty without a path.
    fn path(&self) -> &[usize] {
        &[]
    }

    /// Drops the current path.
    fn reset(&mut self);

    /// Returns whether the agent needs stuck recovery with this kind of navigation.
    fn needs_recovery(&self) -> bool;

    /// Creates an approach with this kind of navigation.
    fn new_approach(&self) -> Box<dyn Approach>;

    /// Returns a copy that continues identically.
    fn fork(&self) -> Box<dyn Navigator>;
}

/// Approaches one object until an interaction with it is possible.
pub trait Approach: Debug + Send + Sync {
    /// Returns the next step to within `within_m` of an object, in meters. Avoids the positions of
    /// failed attempts.
    fn step(
        &mut self,
        memory: &mut Memory,
        navigator: &mut dyn Navigator,
        track: TrackId,
        within_m: f32,
        failed_positions: &[Vec2],
    ) -> NavigationStep;

    /// Returns a copy that continues identically.
    fn fork(&self) -> Box<dyn Approach>;
}

impl Clone for Box<dyn Navigator> {
    fn clone(&self) -> Box<dyn Navigator> {
        (**self).fork()
    }
}

impl Clone for Box<dyn Approach> {
    fn clone(&self) -> Box<dyn Approach> {
        (**self).fork()
    }
}
