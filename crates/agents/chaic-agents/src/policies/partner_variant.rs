//! Partners that deviate from the published rules, to test helpers that model these rules.

use chaic_core::rng::RngStream;
use chaic_core::task::SceneKind;
use chaic_core::{AgentError, Briefing, Frame};

use super::partner_habits::{FetchOrder, HabitsError, PartnerHabits};
use super::rule_policy::RulePolicy;
use crate::belief::scene_of;
use crate::decision::{Context, HandState, Plan, Policy, Subject};
use crate::rules::RuleProfile;

/// Table entry of a partner that deviates from the rules.
#[derive(Clone, Copy, Debug)]
pub struct PartnerVariant {
    /// Name in commands and files.
    pub name: &'static str,
    /// Description in a few words, for lists.
    pub about: &'static str,
    /// Deviation from the rules.
    pub habits: PartnerHabits,
}

/// All partners that deviate from the rules by one habit. They have the grants of the rule-based
/// partner.
pub static PARTNER_VARIANTS: [PartnerVariant; 7] = [
    PartnerVariant {
        name: "farthest",
        about: "fetches the farthest wanted object first",
        habits: PartnerHabits { order: FetchOrder::Farthest, ..PartnerHabits::RULES },
    },
    PartnerVariant {
        name: "shuffled",
        about: "fetches wanted objects in random order",
        habits: PartnerHabits { order: FetchOrder::Random, ..PartnerHabits::RULES },
    },
    PartnerVariant {
        name: "noisy",
        about: "fetches a random possible target in one of five cases",
        habits: PartnerHabits { noise_percent: 20, ..PartnerHabits::RULES },
    },
    PartnerVariant {
        name: "slow",
        about: "pauses for 90 frames before each plan",
        habits: PartnerHabits::SLOW,
    },
    PartnerVariant {
        name: "no_containers",
        about: "takes no containers",
        habits: PartnerHabits { takes_containers: false, ..PartnerHabits::RULES },
    },
    PartnerVariant {
        name: "forgetful",
        about: "forgets objects that it has not seen for 150 frames",
        habits: PartnerHabits { memory_frames: Some(150), ..PartnerHabits::RULES },
    },
    PartnerVariant {
        name: "one_by_one",
        about: "delivers each object before it fetches the next",
        habits: PartnerHabits { max_load: Some(1), ..PartnerHabits::RULES },
    },
];

impl PartnerVariant {
    /// Returns the variant of this name.
    pub fn find(name: &str) -> Option<&'static PartnerVariant> {
        PARTNER_VARIANTS.iter().find(|variant| variant.name == name)
    }
}

/// Returns the habits of a partner: of a table entry, `habits:...` or `drawn:SEED`.
///
/// # Errors
/// [`HabitsError`] if there is no such partner, or its parameters are wrong.
pub fn partner_habits(name: &str) -> Result<PartnerHabits, HabitsError> {
    match PartnerVariant::find(name) {
        Some(variant) => Ok(variant.habits),
        None => PartnerHabits::from_name(name),
    }
}

/// Returns the name that a run records: `drawn:SEED` and `habits:...` as all parameters that differ
/// from the rules, and any other name unchanged. Recorded partners therefore depend neither on the
/// distribution of drawn habits nor on the order of the parameters.
pub fn recorded_partner_name(name: &str) -> String {
    PartnerHabits::from_name(name).map_or_else(|_| name.to_owned(), |habits| habits.to_string())
}

/// Policy of a partner whose habits deviate from the rules.
#[derive(Clone, Debug)]
pub struct PartnerVariantPolicy {
    rules: RulePolicy,
    habits: PartnerHabits,
    rng: RngStream,
    /// Object that the partner fetches until it has it, or until it is no valid choice.
    target: Option<Subject>,
}

impl PartnerVariantPolicy {
    /// Creates the policy of a partner with these habits.
    pub fn new(habits: PartnerHabits) -> PartnerVariantPolicy {
        PartnerVariantPolicy {
            rules: RulePolicy::new(RuleProfile::PARTNER),
            habits,
            rng: RngStream::new(0, "partner variant", 0),
            target: None,
        }
    }

    /// Returns the object to fetch instead of the nearest wanted one.
    fn choose_target(
        &mut self,
        context: &Context<'_>,
        valid: &[Plan],
        nearest: Subject,
    ) -> Subject {
        let PartnerHabits { order, noise_percent, .. } = self.habits;
        let is_noisy = noise_percent > 0;
        if !is_noisy && order == FetchOrder::Nearest {
            return nearest;
        }
        let possible = possible_targets(valid);
        let wanted = self.rules.wanted_targets(context, valid);
        let choices = if is_noisy { &possible } else { &wanted };
        if let Some(target) = self.target.filter(|target| choices.contains(target)) {
            return target;
        }
        let other = if is_noisy && self.rng.chance(f32::from(noise_percent) / 100.0) {
            self.rng.choose(&possible)
        } else {
            match order {
                FetchOrder::Nearest => None,
                FetchOrder::Farthest => wanted.last(),
                FetchOrder::Random => self.rng.choose(&wanted),
            }
        };
        let target = other.copied().unwrap_or(nearest);
        self.target = Some(target);
        target
    }

    /// Returns whether the partner carries its habitual number of targets.
    fn is_loaded(&self, context: &Context<'_>) -> bool {
        let Some(max) = self.habits.max_load else { return false };
        HandState::new(&context.memory.hands, context.briefing).targets.len() >= usize::from(max)
    }
}

fn possible_targets(valid: &[Plan]) -> Vec<Subject> {
    let pick_ups = valid.iter().filter(|plan| matches!(plan, Plan::PickUp(_)));
    pick_ups.filter_map(Plan::subject).collect()
}

impl Policy for PartnerVariantPolicy {
    fn reset(&mut self, briefing: &Briefing) {
        let is_street = scene_of(&briefing.possible_targets) == Some(SceneKind::Street);
        let profile = if is_street { RuleProfile::RIDER } else { RuleProfile::PARTNER };
        *self = PartnerVariantPolicy {
            rules: RulePolicy::new(profile),
            rng: RngStream::new(briefing.seed, "partner variant", 0),
            ..PartnerVariantPolicy::new(self.habits)
        };
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let takes_containers = self.habits.takes_containers;
        let is_loaded = self.is_loaded(context);
        let is_allowed = |plan: &&Plan| match plan {
            Plan::PickContainer(_) => takes_containers && !is_loaded,
            Plan::PickUp(_) => !is_loaded,
            _ => true,
        };
        let allowed: Vec<Plan> = valid.iter().filter(is_allowed).copied().collect();
        Ok(match self.rules.decide(context, &allowed) {
            // Without a known goal place, it explores to find one.
            Plan::Explore if is_loaded && allowed.contains(&Plan::Deliver) => Plan::Deliver,
            Plan::PickUp(nearest) => Plan::PickUp(self.choose_target(context, &allowed, nearest)),
            plan => plan,
        })
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, has_changed: bool) -> bool {
        self.rules.reconsiders(context, current, has_changed)
    }

    fn thinking_frames(&self) -> Frame {
        self.habits.pause_frames
    }

    fn memory_frames(&self) -> Option<Frame> {
        self.habits.memory_frames
    }

    fn fork(&self) -> Option<PartnerVariantPolicy> {
        Some(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::behavior::BehaviorLog;
    use crate::memory::Memory;
    use crate::test_support::Toy;
    use crate::{PlannerRules, TrackId};
    use chaic_core::ClassId;
    use chaic_core::briefing::Goal;

    /// Lets a partner that wants three apples choose `n` times among two apples and a loaf of
    /// bread, sorted by distance, and a container if `has_container`. The partner forgets its
    /// target before each choice. Returns the tracks of the chosen objects.
    fn choices(habits: PartnerHabits, n: usize, has_container: bool) -> Vec<u32> {
        let mut briefing = Toy::room(6.0, 6.0).briefing();
        let [apple, bread, tray] = ["apple", "loaf_bread", "tea_tray"].map(ClassId::named);
        briefing.possible_targets = vec![apple, bread];
        briefing.goal = Some(Goal { targets: vec![(apple, 3)] });
        let memory = Memory::new(&briefing, PlannerRules::paper());
        let behavior = BehaviorLog::default();
        let context = Context {
            briefing: &briefing,
            memory: &memory,
            behavior: &behavior,
            is_explored: false,
        };
        let subject = |track, class| Subject { track: TrackId(track), class };
        let mut valid = vec![
            Plan::Explore,
            Plan::PickUp(subject(20, apple)),
            Plan::PickUp(subject(22, bread)),
            Plan::PickUp(subject(21, apple)),
        ];
        valid.extend(has_container.then(|| Plan::PickContainer(subject(23, tray))));
        let mut policy = PartnerVariantPolicy::new(habits);
        policy.reset(&briefing);
        policy.rules.skip_look_around();
        let chosen = (0..n).map(|_| {
            policy.target = None;
            policy.choose(&context, &valid).expect("a plan")
        });
        chosen.filter_map(|plan| plan.subject()).map(|subject| subject.track.0).collect()
    }

    fn share(tracks: &[u32], track: u32) -> f32 {
        tracks.iter().filter(|t| **t == track).count() as f32 / tracks.len() as f32
    }

    fn habits(name: &str) -> PartnerHabits {
        partner_habits(name).expect("a known partner")
    }

    #[test]
    fn orders_of_targets_are_those_of_the_descriptions() {
        const NOISE: f32 = 0.2;
        assert_eq!(choices(habits("slow"), 1, false), [20]);
        assert_eq!(choices(habits("farthest"), 1, false), [21]);
        let shuffled = choices(habits("shuffled"), 1000, false);
        assert!((share(&shuffled, 20) - 0.5).abs() < 0.06, "{}", share(&shuffled, 20));
        assert_eq!(share(&shuffled, 22), 0.0, "bread is not wanted");
        let noisy = choices(habits("noisy"), 1000, false);
        assert!((share(&noisy, 22) - NOISE / 3.0).abs() < 0.03, "{}", share(&noisy, 22));
        assert!((share(&noisy, 20) - (1.0 - NOISE * 2.0 / 3.0)).abs() < 0.05);
        let both = choices(habits("habits:order=farthest,noise=20"), 1000, false);
        assert!((share(&both, 22) - NOISE / 3.0).abs() < 0.03, "{}", share(&both, 22));
        assert!((share(&both, 21) - (1.0 - NOISE * 2.0 / 3.0)).abs() < 0.05);
    }

    #[test]
    fn only_one_variant_leaves_containers() {
        for variant in &PARTNER_VARIANTS {
            let expected = if variant.name == "no_containers" { 20 } else { 23 };
            assert_eq!(choices(variant.habits, 1, true), [expected], "{}", variant.name);
        }
    }

    #[test]
    fn slow_partners_pause_before_each_plan() {
        assert_eq!(PartnerVariantPolicy::new(habits("slow")).thinking_frames(), 90);
        assert_eq!(PartnerVariantPolicy::new(habits("noisy")).thinking_frames(), 0);
    }

    #[test]
    fn a_recorded_name_lists_the_parameters() {
        assert_eq!(recorded_partner_name("habits:load=1,pause=30"), "habits:pause=30,load=1");
        let drawn = recorded_partner_name("drawn:7");
        assert!(drawn.starts_with("habits:"), "{drawn}");
        assert_eq!(partner_habits(&drawn), Ok(PartnerHabits::draw(7)));
        for other in ["noisy", "llm", "habits:pause=x"] {
            assert_eq!(recorded_partner_name(other), other);
        }
    }
}
