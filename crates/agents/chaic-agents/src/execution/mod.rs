//! Carrying out plans, one action at a time.

pub mod carry;
pub mod navigate;

pub mod explore;
pub mod follow;
pub mod interact;
pub mod lattice;
pub mod recover;
pub mod sample;
pub(crate) mod walking;

use chaic_core::briefing::Relation;
use chaic_core::geom::xz;
use chaic_core::rng::Stream;
use chaic_core::{Action, Briefing, FailureReason, Frame, Hand, Outcome, Role, Vec2};

use crate::decision::{HandState, Plan};
use crate::memory::Memory;
use crate::rules::{Exploration, PlaceChoice, PlanLimits, PlannerRules};
use crate::track::{Intent, TrackId};
use explore::{Explorer, Found};
use follow::{Follow, Follower};
use interact::{Interaction, Step};
use navigate::Navigator;
use recover::Recovery;
use sample::Sampler;
use walking::style;

/// What the executor says of the plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Do this next.
    Act(Intent),
    /// The plan is carried out.
    Done,
    /// The plan can't be carried out.
    Failed,
}

/// What carrying out a plan needs to know.
#[derive(Debug)]
pub struct Situation<'a> {
    /// What the mind remembers.
    pub memory: &'a mut Memory,
    /// What the mind was told.
    pub briefing: &'a Briefing,
}

/// Carries out one plan after the other.
#[derive(Clone, Debug)]
pub struct Executor {
    navigator: Navigator,
    recovery: Recovery,
    explorer: Explorer,
    sampler: Sampler,
    follower: Follower,
    interaction: Option<Interaction>,
    /// What could not be done from where, and when.
    bad_places: Vec<(TrackId, Vec2, Frame)>,
    rng: Stream,
    since: Frame,
    n_turns: u32,
    n_lifts: u32,
    near_since: Option<Frame>,
    place: Option<TrackId>,
    /// Whether the last action was the interaction that the plan is for.
    has_acted: bool,
}

impl Executor {
    /// Ready to carry out plans of this episode.
    pub fn new(briefing: &Briefing) -> Executor {
        Executor {
            navigator: Navigator::default(),
            recovery: Recovery::default(),
            explorer: Explorer::new(briefing.bounds),
            sampler: Sampler::new(briefing),
            follower: Follower::default(),
            interaction: None,
            bad_places: Vec::new(),
            rng: Stream::new(briefing.seed, "execution", 0),
            since: 0,
            n_turns: 0,
            n_lifts: 0,
            near_since: None,
            place: None,
            has_acted: false,
        }
    }

    /// Whether everything that can be got to has been explored.
    pub fn is_explored(&self) -> bool {
        self.explorer.is_exhausted()
    }

    /// When the present plan began.
    pub fn since(&self) -> Frame {
        self.since
    }

    /// Begins a plan.
    pub fn begin(&mut self, now: Frame, rules: &PlannerRules) {
        self.navigator.reset();
        self.recovery.reset();
        self.follower = Follower::default();
        self.sampler.begin();
        self.interaction = None;
        let kept_frames = rules.failures.bad_place_frames;
        self.bad_places.retain(|(_, _, since)| since + kept_frames > now);
        self.since = now;
        (self.n_turns, self.n_lifts) = (0, 0);
        (self.near_since, self.place, self.has_acted) = (None, None, false);
    }

    /// The next action of `plan`.
    pub fn step(&mut self, plan: &Plan, s: &mut Situation<'_>) -> Progress {
        let elapsed = s.memory.frame.saturating_sub(self.since);
        if elapsed > time_limit(plan, &s.memory.rules.limits) {
            self.give_up(plan, s);
            return Progress::Failed;
        }
        if *plan == Plan::FollowChild {
            // The time runs only while the child is lost; or, for who doesn't trust it, while it
            // is where it belongs.
            let child = s.memory.companion(s.briefing, Relation::Child);
            let is_needed = match s.memory.rules.trusts_child {
                true => child.is_some_and(|c| c.is_in_view),
                false => s.memory.child_is_away(s.briefing),
            };
            self.since = if is_needed { s.memory.frame } else { self.since };
        }
        let is_standing = matches!(plan, Plan::PutIn | Plan::TurnAround | Plan::Wait);
        if is_standing || self.has_acted {
            self.recovery.stand();
        }
        // Two who carry get free by planning for both.
        let is_pair = s.memory.other_end.is_some();
        if !is_standing && !is_pair && style(s.memory.rules.walking).recovers() {
            if let Some(action) = self.recovery.step(s.memory, s.memory.last, &mut self.rng) {
                return Progress::Act(action);
            }
            if self.recovery.is_hopeless() {
                self.recovery = Recovery::default();
                self.give_up(plan, s);
                return Progress::Failed;
            }
        }
        match *plan {
            Plan::Explore => {
                let found = match s.memory.rules.exploration {
                    Exploration::Frontier => self.explorer.step(s.memory, &mut self.navigator),
                    Exploration::Sampled => self.sampler.step(s.memory, &mut self.navigator),
                };
                match found {
                    Found::Act(action) => Progress::Act(action),
                    Found::Resolved => Progress::Done,
                }
            }
            Plan::PickUp(subject) | Plan::PickContainer(subject) => {
                self.pick(subject.track, s, false)
            }
            Plan::LiftWith(subject) => self.pick(subject.track, s, true),
            Plan::RemoveObstacle(subject) => self.remove(subject.track, s),
            Plan::PutIn => self.put_in(s),
            Plan::Deliver => self.deliver(s),
            Plan::FollowPartner => {
                self.follow(Relation::Partner, s.memory.rules.people.partner_within_m, s)
            }
            Plan::FollowChild => {
                self.follow(Relation::Child, s.memory.rules.people.child_within_m, s)
            }
            Plan::TurnAround => {
                self.n_turns += 1;
                let has_found = s.memory.rules.stops_turning_when_found && has_found_both(s);
                let is_done = self.n_turns > s.memory.rules.around_turns || has_found;
                if is_done { Progress::Done } else { Progress::Act(Action::TurnLeft) }
            }
            Plan::Wait => {
                self.n_turns += 1;
                let action = Action::Wait { frames: s.memory.rules.limits.wait_frames };
                if self.n_turns > 1 { Progress::Done } else { Progress::Act(action) }
            }
        }
    }

    /// After a timeout, or being stuck for good: does not try the same again at once.
    fn give_up(&mut self, plan: &Plan, s: &mut Situation<'_>) {
        match plan {
            Plan::Explore => self.explorer.give_up(s.memory.frame),
            Plan::PickUp(subject)
            | Plan::PickContainer(subject)
            | Plan::LiftWith(subject)
            | Plan::RemoveObstacle(subject) => {
                let until = s.memory.frame + s.memory.rules.failures.ignore_frames;
                s.memory.things.ignore(subject.track, until);
            }
            _ => {}
        }
    }

    /// Whether the interaction of the plan was just done, and how it ended.
    fn interaction_done(&mut self, s: &Situation<'_>, subject: TrackId) -> Option<Outcome> {
        let (action, outcome) = s.memory.last?;
        let mine = std::mem::take(&mut self.has_acted) && action.subject() == Some(subject);
        if mine
            && let Outcome::Failure(FailureReason::Blocked | FailureReason::OutOfReach) = outcome
        {
            let here = s.memory.here();
            self.bad_places.push((subject, here, s.memory.frame));
            if let Some(interaction) = &mut self.interaction {
                interaction.note_bad_place(here);
            }
            self.navigator.reset();
        }
        mine.then_some(outcome)
    }

    fn pick(&mut self, track: TrackId, s: &mut Situation<'_>, together: bool) -> Progress {
        match self.interaction_done(s, track) {
            Some(Outcome::Success) => return Progress::Done,
            Some(Outcome::Failure(_)) => self.n_lifts += 1,
            None => {}
        }
        if s.memory.hands.holds(track) {
            return Progress::Done;
        }
        let hands = HandState::of(&s.memory.hands, s.briefing);
        let now = s.memory.frame;
        let Some(thing) = s.memory.things.get(track) else { return Progress::Failed };
        let is_heavy = thing.class.info().role == Role::HeavyTarget;
        let ignored = !together && now < thing.ignore_until;
        if !thing.is_present || thing.is_gone || now < thing.held_until || ignored {
            return Progress::Failed;
        }
        let Some(hand) = hands.free_hand else { return Progress::Failed };
        let partner = s.memory.companion(s.briefing, Relation::Partner);
        let lifting = s.memory.rules.lifting;
        let partner_left = partner.is_some_and(|p| {
            p.is_in_view && thing.distance_from(xz(p.position_in_world)) > lifting.left_piece_m
        });
        if together && (partner_left || self.n_lifts >= lifting.tries_together) {
            return Progress::Failed;
        }
        let hand = if is_heavy { Hand::Left } else { hand };
        let act = Action::PickUp { object: track, hand };
        self.approach(track, s.memory.rules.pick_within_m, act, s)
    }

    fn remove(&mut self, track: TrackId, s: &mut Situation<'_>) -> Progress {
        match self.interaction_done(s, track) {
            Some(Outcome::Success) => return Progress::Done,
            Some(Outcome::Failure(_)) | None => {}
        }
        let now = s.memory.frame;
        let there = s.memory.things.get(track).is_some_and(|t| t.is_available(now));
        let (true, Some(hand)) = (there, HandState::of(&s.memory.hands, s.briefing).free_hand)
        else {
            return Progress::Failed;
        };
        let act = Action::RemoveObstacle { obstacle: track, hand };
        self.approach(track, s.memory.rules.pick_within_m, act, s)
    }

    fn approach(
        &mut self,
        track: TrackId,
        within_m: f32,
        act: Intent,
        s: &mut Situation<'_>,
    ) -> Progress {
        let tried = || self.bad_places.iter().filter(|(e, ..)| *e == track).map(|(_, p, _)| *p);
        let interaction =
            self.interaction.get_or_insert_with(|| Interaction::knowing(tried().collect()));
        match interaction.step(s.memory, &mut self.navigator, track, within_m) {
            Step::Walk(action) => Progress::Act(action),
            Step::There => {
                self.has_acted = true;
                Progress::Act(act)
            }
            Step::GiveUp => Progress::Failed,
        }
    }

    fn put_in(&mut self, s: &mut Situation<'_>) -> Progress {
        if std::mem::replace(&mut self.has_acted, true) {
            let is_done = matches!(s.memory.last, Some((Action::PutIn, o)) if o.is_success());
            return if is_done { Progress::Done } else { Progress::Failed };
        }
        let can = HandState::of(&s.memory.hands, s.briefing).can_put_in;
        if can { Progress::Act(Action::PutIn) } else { Progress::Failed }
    }

    fn deliver(&mut self, s: &mut Situation<'_>) -> Progress {
        let Some(hand) = HandState::of(&s.memory.hands, s.briefing).to_deliver else {
            return Progress::Done;
        };
        if let Some(place) = self.place
            && let Some(Outcome::Failure(FailureReason::Impossible)) =
                self.interaction_done(s, place)
        {
            return Progress::Failed;
        }
        if self.place.is_none_or(|p| s.memory.things.get(p).is_none_or(|t| !t.is_present)) {
            s.memory.refresh();
            let places = s.memory.goal_places();
            let chosen = match s.memory.rules.place_choice {
                PlaceChoice::Nearest => places.first(),
                PlaceChoice::Random => self.rng.choose(&places),
            };
            self.place = chosen.map(|(t, _)| t.track);
        }
        let Some(place) = self.place else { return Progress::Failed };
        let within_m = s.memory.rules.put_within_m;
        self.approach(place, within_m, Action::PutOn { place, hand }, s)
    }

    fn follow(&mut self, relation: Relation, keep_m: f32, s: &mut Situation<'_>) -> Progress {
        let Some(agent) = s.briefing.companion(relation) else { return Progress::Failed };
        match self.follower.step(s.memory, &mut self.navigator, agent, keep_m) {
            Follow::Act(action) => Progress::Act(action),
            Follow::Near(action) => {
                self.recovery.stand();
                let since = *self.near_since.get_or_insert(s.memory.frame);
                let stood = s.memory.frame.saturating_sub(since);
                let rules = s.memory.rules;
                let is_enough = rules.trusts_child && stood > rules.people.child_stand_frames;
                if relation == Relation::Child && is_enough {
                    return Progress::Done;
                }
                Progress::Act(action)
            }
            Follow::Lost => Progress::Failed,
        }
    }
}

/// Whether partner and child were both seen a moment ago (facts A2.1).
fn has_found_both(s: &Situation<'_>) -> bool {
    let fresh_frames = s.memory.rules.people.fresh_frames;
    [Relation::Partner, Relation::Child].into_iter().all(|relation| {
        let person = s.memory.companion(s.briefing, relation);
        person.is_some_and(|p| p.frame + fresh_frames > s.memory.frame)
    })
}

fn time_limit(plan: &Plan, limits: &PlanLimits) -> Frame {
    match plan {
        Plan::Explore => limits.explore_frames,
        Plan::FollowPartner => limits.follow_partner_frames,
        Plan::FollowChild => limits.follow_child_frames,
        _ => limits.interact_frames,
    }
}
