//! Secrets of a partner, and changes to them.

use chaic_core::ClassId;
use chaic_core::briefing::Goal;
use chaic_core::capability::Capability;
use chaic_world::Setup;

/// Hidden property of the partner that a helper learns only if it is granted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HiddenProperty {
    /// Goal of the partner.
    Goal,
    /// Capability of the partner.
    Constraint,
}

impl HiddenProperty {
    /// All secrets.
    pub const ALL: [HiddenProperty; 2] = [HiddenProperty::Goal, HiddenProperty::Constraint];

    /// Changes the secret in a setup, and nothing that is visible.
    pub fn change(self, setup: &mut Setup) {
        match self {
            HiddenProperty::Goal => change_goal(setup),
            HiddenProperty::Constraint => change_constraint(setup),
        }
    }
}

/// Sets another goal with the same objects: one class that was not wanted.
fn change_goal(setup: &mut Setup) {
    let is_present = |c: ClassId| setup.things.iter().any(|t| t.class == c && !t.fixed);
    let unwanted = ClassId::all()
        .find(|c| c.info().is_possible_target() && is_present(*c) && setup.goal.count(*c) == 0);
    match unwanted {
        Some(class) => setup.goal = Goal { targets: vec![(class, 1)] },
        // Moving house wants all objects: remove one.
        None => setup.goal.targets.truncate(setup.goal.targets.len().saturating_sub(1)),
    }
}

/// Changes reach, strength and speed of the partner, but not its appearance.
fn change_constraint(setup: &mut Setup) {
    let Some(partner) = setup.people.first_mut() else { return };
    let capability = partner.capability();
    partner.capability = Some(Capability {
        pick_range_m: [0.0, 3.0],
        put_range_m: [0.0, 3.0],
        strength_kg: 600.0,
        speed_m_per_frame: 0.04,
        approach_speed_m_per_frame: 0.04,
        docking_frames: 7,
        breaks_fragile: !capability.breaks_fragile,
        ..capability
    });
}
