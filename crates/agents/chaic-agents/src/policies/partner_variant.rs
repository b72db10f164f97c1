//! Partners that deviate from the published rules, to test helpers that model these rules.

use chaic_core::rng::RngStream;
use chaic_core::task::SceneKind;
use chaic_core::{AgentError, Briefing, Frame};

use super::rule_policy::RulePolicy;
use crate::belief::scene_of;
use crate::decision::{Context, Plan, Policy, Subject};
use crate::rules::RuleProfile;

/// Pause of a slow partner before each plan, frames: about the duration of a pick-up.
const PAUSE_FRAMES: Frame = 90;
/// Probability that a noisy partner fetches a random possible target instead of a wanted one.
const NOISE: f32 = 0.2;

/// Deviation of a partner from the rules.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deviation {
    /// Fetches the farthest wanted object instead of the nearest.
    FarthestFirst,
    /// Fetches wanted objects in random order.
    RandomOrder,
    /// Fetches a random possible target instead of a wanted one with probability 0.2.
    Noisy,
    /// Pauses for 90 frames before each plan.
    Slow,
    /// Takes no containers.
    NoContainers,
}

/// Table entry of a partner that deviates from the rules.
#[derive(Clone, Copy, Debug)]
pub struct PartnerVariant {
    /// Name in commands and files.
    pub name: &'static str,
    /// Description in a few words, for lists.
    pub about: &'static str,
    /// Deviation from the rules.
    pub deviation: Deviation,
}

/// All partners that deviate from the rules. They have the grants of the rule-based partner.
pub static PARTNER_VARIANTS: [PartnerVariant; 5] = [
    PartnerVariant {
        name: "farthest",
        about: "fetches the farthest wanted object first",
        deviation: Deviation::FarthestFirst,
    },
    PartnerVariant {
        name: "shuffled",
        about: "fetches wanted objects in random order",
        deviation: Deviation::RandomOrder,
    },
    PartnerVariant {
        name: "noisy",
        about: "fetches a random possible target in one of five cases",
        deviation: Deviation::Noisy,
    },
    PartnerVariant {
        name: "slow",
        about: "pauses for 90 frames before each plan",
        deviation: Deviation::Slow,
    },
    PartnerVariant {
        name: "no_containers",
        about: "takes no containers",
        deviation: Deviation::NoContainers,
    },
];

impl PartnerVariant {
    /// Returns the variant of this name.
    pub fn find(name: &str) -> Option<&'static PartnerVariant> {
        PARTNER_VARIANTS.iter().find(|variant| variant.name == name)
    }
}

/// The rules of a partner with one deviation.
#[derive(Clone, Debug)]
pub struct PartnerVariantPolicy {
    rules: RulePolicy,
    deviation: Deviation,
    rng: RngStream,
    /// Object that the partner fetches until it has it, or until it is no valid choice.
    target: Option<Subject>,
}

impl PartnerVariantPolicy {
    /// Creates the policy of a partner with this deviation.
    pub fn new(deviation: Deviation) -> PartnerVariantPolicy {
        PartnerVariantPolicy {
            rules: RulePolicy::new(RuleProfile::PARTNER),
            deviation,
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
        let choices = match self.deviation {
            Deviation::Slow | Deviation::NoContainers => return nearest,
            Deviation::Noisy => possible_targets(valid),
            Deviation::FarthestFirst | Deviation::RandomOrder => {
                self.rules.wanted_targets(context, valid)
            }
        };
        if let Some(target) = self.target.filter(|target| choices.contains(target)) {
            return target;
        }
        let other = match self.deviation {
            Deviation::FarthestFirst => choices.last(),
            Deviation::Noisy if !self.rng.chance(NOISE) => None,
            _ => self.rng.choose(&choices),
        };
        let target = other.copied().unwrap_or(nearest);
        self.target = Some(target);
        target
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
            ..PartnerVariantPolicy::new(self.deviation)
        };
    }

    fn choose(&mut self, context: &Context<'_>, valid: &[Plan]) -> Result<Plan, AgentError> {
        let leaves_containers = self.deviation == Deviation::NoContainers;
        let is_allowed =
            |plan: &&Plan| !(leaves_containers && matches!(plan, Plan::PickContainer(_)));
        let allowed: Vec<Plan> = valid.iter().filter(is_allowed).copied().collect();
        Ok(match self.rules.decide(context, &allowed) {
            Plan::PickUp(nearest) => Plan::PickUp(self.choose_target(context, &allowed, nearest)),
            plan => plan,
        })
    }

    fn reconsiders(&mut self, context: &Context<'_>, current: &Plan, has_changed: bool) -> bool {
        self.rules.reconsiders(context, current, has_changed)
    }

    fn thinking_frames(&self) -> Frame {
        if self.deviation == Deviation::Slow { PAUSE_FRAMES } else { 0 }
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
    fn choices(deviation: Deviation, n: usize, has_container: bool) -> Vec<u32> {
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
        let mut policy = PartnerVariantPolicy::new(deviation);
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

    #[test]
    fn orders_of_targets_are_those_of_the_descriptions() {
        assert_eq!(choices(Deviation::Slow, 1, false), [20]);
        assert_eq!(choices(Deviation::FarthestFirst, 1, false), [21]);
        let shuffled = choices(Deviation::RandomOrder, 1000, false);
        assert!((share(&shuffled, 20) - 0.5).abs() < 0.06, "{}", share(&shuffled, 20));
        assert_eq!(share(&shuffled, 22), 0.0, "bread is not wanted");
        let noisy = choices(Deviation::Noisy, 1000, false);
        assert!((share(&noisy, 22) - NOISE / 3.0).abs() < 0.03, "{}", share(&noisy, 22));
        assert!((share(&noisy, 20) - (1.0 - NOISE * 2.0 / 3.0)).abs() < 0.05);
    }

    #[test]
    fn only_one_variant_leaves_containers() {
        for variant in &PARTNER_VARIANTS {
            let expected = if variant.deviation == Deviation::NoContainers { 20 } else { 23 };
            assert_eq!(choices(variant.deviation, 1, true), [expected], "{}", variant.name);
        }
    }

    #[test]
    fn slow_partners_pause_before_each_plan() {
        assert_eq!(PartnerVariantPolicy::new(Deviation::Slow).thinking_frames(), PAUSE_FRAMES);
        assert_eq!(PartnerVariantPolicy::new(Deviation::Noisy).thinking_frames(), 0);
    }
}
