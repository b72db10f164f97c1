//! What is hidden of a partner, and how to change it.

use chaic_core::ClassId;
use chaic_core::briefing::Goal;
use chaic_core::capability::Capability;
use chaic_world::Setup;

/// Something that no helper is told unless it is granted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Secret {
    /// What the partner wants.
    Goal,
    /// What the partner can do.
    Constraint,
}

impl Secret {
    /// Both.
    pub const ALL: [Secret; 2] = [Secret::Goal, Secret::Constraint];

    /// Makes it another one, and leaves all that can be seen as it is.
    pub fn change(self, setup: &mut Setup) {
        match self {
            Secret::Goal => other_goal(setup),
            Secret::Constraint => other_constraint(setup),
        }
    }
}

/// Another goal on the same things: one class that isn't wanted.
fn other_goal(setup: &mut Setup) {
    let is_there = |c: ClassId| setup.things.iter().any(|t| t.class == c && !t.fixed);
    let unwanted = ClassId::all()
        .find(|c| c.info().is_possible_target() && is_there(*c) && setup.goal.wanted(*c) == 0);
    match unwanted {
        Some(class) => setup.goal = Goal { targets: vec![(class, 1)] },
        // Moving house wants all there is: one less.
        None => setup.goal.targets.truncate(setup.goal.targets.len().saturating_sub(1)),
    }
}

/// Somebody who looks the same, and reaches, lifts and walks differently.
fn other_constraint(setup: &mut Setup) {
    let Some(partner) = setup.people.first_mut() else { return };
    let own = partner.capability();
    partner.capability = Some(Capability {
        pick_range_m: [0.0, 3.0],
        put_range_m: [0.0, 3.0],
        strength_kg: 600.0,
        speed_m_per_frame: 0.04,
        approach_speed_m_per_frame: 0.04,
        docking_frames: 7,
        breaks_fragile: !own.breaks_fragile,
        ..own
    });
}
