//! How one gets about: with care, or as the original does. What differs between the two is here.

use super::interact::{Interaction, Step};
use super::lattice;
use super::navigate::{Destination, Nav, Navigator};
use crate::memory::Memory;
use crate::rules::Walking;
use crate::track::TrackId;

/// A way of walking.
pub(crate) trait WalkingStyle: Sync {
    /// The next action on the way to `destination`.
    fn walk(
        &self,
        navigator: &mut Navigator,
        memory: &mut Memory,
        destination: &Destination,
    ) -> Nav;

    /// The next step towards a thing that something is to be done with, within this distance in
    /// metres.
    fn approach(
        &self,
        interaction: &mut Interaction,
        memory: &mut Memory,
        navigator: &mut Navigator,
        track: TrackId,
        within_m: f32,
    ) -> Step;

    /// Whether one notices that one is stuck, and gets free.
    fn recovers(&self) -> bool;
}

/// The style of that name.
pub(crate) fn style(walking: Walking) -> &'static dyn WalkingStyle {
    match walking {
        Walking::Careful => &Careful,
        Walking::Lattice => &Lattice,
    }
}

/// [`Walking::Careful`].
struct Careful;

impl WalkingStyle for Careful {
    fn walk(
        &self,
        navigator: &mut Navigator,
        memory: &mut Memory,
        destination: &Destination,
    ) -> Nav {
        navigator.walk_with_care(memory, destination)
    }

    fn approach(
        &self,
        interaction: &mut Interaction,
        memory: &mut Memory,
        navigator: &mut Navigator,
        track: TrackId,
        within_m: f32,
    ) -> Step {
        interaction.approach_with_care(memory, navigator, track, within_m)
    }

    fn recovers(&self) -> bool {
        true
    }
}

/// [`Walking::Lattice`].
struct Lattice;

impl WalkingStyle for Lattice {
    fn walk(
        &self,
        navigator: &mut Navigator,
        memory: &mut Memory,
        destination: &Destination,
    ) -> Nav {
        lattice::step(memory, destination, &mut navigator.steady)
    }

    fn approach(
        &self,
        interaction: &mut Interaction,
        memory: &mut Memory,
        navigator: &mut Navigator,
        track: TrackId,
        within_m: f32,
    ) -> Step {
        interaction.approach_on_lattice(memory, navigator, track, within_m)
    }

    fn recovers(&self) -> bool {
        false
    }
}
