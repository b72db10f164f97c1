//! Parameters in which the rule-based people and helpers differ.

/// Filter of the objects that an agent picks up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TargetFilter {
    /// Objects that the goal asks for and that are neither delivered nor in hand.
    ByGoal,
    /// All possible targets.
    AnyPossible,
}

/// Order in which targets are picked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TargetOrder {
    /// Nearest first.
    Nearest,
    /// The heaviest that the agent can lift alone, then by distance.
    HeaviestLiftable,
}

/// Parameters in which rule-based agents differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RuleProfile {
    /// Filter of targets.
    pub target_filter: TargetFilter,
    /// Order of targets.
    pub target_order: TargetOrder,
    /// True if it removes the obstacles that its body can lift.
    pub removes_obstacles: bool,
    /// True if it takes care of the child.
    pub supervises_child: bool,
    /// True if it helps the partner lift objects that are too heavy for one.
    pub lifts_together: bool,
    /// True if its own pick-ups count under the original's bookkeeping.
    pub counts_picks: bool,
    /// Fraction of time left above which a container is fetched first (facts A2.2).
    pub container_above: f32,
    /// Fraction of time left below which carried objects are delivered at once (facts A2.2).
    pub deliver_below: f32,
    /// The same while no goal place is known (facts A2.2).
    pub deliver_below_unknown: f32,
}

impl RuleProfile {
    /// The constrained partner (paper section 5.1.1).
    pub const PARTNER: RuleProfile = RuleProfile {
        target_filter: TargetFilter::ByGoal,
        target_order: TargetOrder::Nearest,
        removes_obstacles: false,
        supervises_child: false,
        lifts_together: false,
        counts_picks: true,
        container_above: 0.5,
        deliver_below: 0.25,
        deliver_below_unknown: 0.375,
    };
    /// The rider: delivers in the last 1000 of 3000 frames, or 1500 with an unknown goal place
    /// (facts A2.4).
    pub const RIDER: RuleProfile = RuleProfile {
        deliver_below: 1.0 / 3.0,
        deliver_below_unknown: 0.5,
        ..RuleProfile::PARTNER
    };
    /// The rule-based helper (paper, "Detailed Rules for RHP").
    pub const RHP: RuleProfile = RuleProfile {
        target_filter: TargetFilter::AnyPossible,
        removes_obstacles: true,
        supervises_child: true,
        lifts_together: true,
        counts_picks: false,
        ..RuleProfile::PARTNER
    };
    /// The oracle: knows the goal and the progress.
    pub const ORACLE: RuleProfile = RuleProfile {
        target_filter: TargetFilter::ByGoal,
        target_order: TargetOrder::HeaviestLiftable,
        ..RuleProfile::RHP
    };
}
