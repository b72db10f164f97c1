//! Episodes that participants play while the simulator runs on the server. The module is independent of
//! HTTP, and time is a parameter.
//!
//! A participant has at most one open episode. Its turns have numbers, so that a repeated turn changes nothing.
//! An episode that is not open, for example after a restart of the server, is opened again from its stored trace.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};
use std::thread;

use axum::body::Bytes;
use chaic_core::{AgentId, Frame, Target};
use chaic_env::helper_registry::HelperRegistry;
use chaic_study::{Input, SEED, Seat, StudyPlan, Trial, WorldPace};
use chaic_web::{InputLevel, LiveConfig, LiveInput, LiveSession, LiveStatus};
use serde::Deserialize;
use serde_json::json;

use crate::access::TokenDigest;
use crate::limits::{
    MAX_SESSIONS, MAX_TURN_FRAMES, RECORD_FRAMES, SESSION_IDLE_SECS, TURN_RATE, VIEW_PX,
};
use crate::picture::to_png;
use crate::refusal::Refusal;
use crate::store::{Store, lock};
use crate::token_bucket::TokenBucket;

/// Request of the page for the next picture: `advance` in `web/src/messages.ts`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdvanceRequest {
    /// Number of frames by which the world advances, unless the person must decide before.
    pub frames: Frame,
    /// Side of the picture, pixels.
    pub view_px: u32,
    /// Decision of the person.
    #[serde(default)]
    pub input: Option<LiveInput>,
}

impl AdvanceRequest {
    /// Parses and checks a turn.
    ///
    /// # Errors
    /// [`Refusal::Input`].
    pub fn parse(text: &str) -> Result<AdvanceRequest, Refusal> {
        let turn: AdvanceRequest =
            serde_json::from_str(text).map_err(|error| Refusal::Input(error.to_string()))?;
        let [largest, step] = VIEW_PX;
        let problem = if turn.frames > MAX_TURN_FRAMES {
            format!("`frames` must be at most {MAX_TURN_FRAMES}, not {}", turn.frames)
        } else if turn.view_px == 0 || turn.view_px > largest || !turn.view_px.is_multiple_of(step)
        {
            format!("`view_px` must be a multiple of {step} up to {largest}, not {}", turn.view_px)
        } else if turn.names_object() {
            "an action names a pixel of the picture, not an object".to_owned()
        } else {
            return Ok(turn);
        };
        Err(Refusal::Input(problem))
    }

    /// Returns whether an action names an object by its id. A person who sees only the picture
    /// knows no ids.
    fn names_object(&self) -> bool {
        match &self.input {
            Some(LiveInput::Action(action)) => {
                matches!(action.subject(), Some(Target::Entity(_)))
            }
            _ => false,
        }
    }
}

/// Open episodes by participant.
pub struct Sessions {
    helpers: &'static dyn HelperRegistry,
    open: Mutex<BTreeMap<String, Arc<OpenSession>>>,
}

/// Episode of a participant.
struct OpenSession {
    trial: usize,
    last_used_secs: AtomicU64,
    bucket: Mutex<TokenBucket>,
    /// `None` until the episode is simulated.
    game: Mutex<Option<Game>>,
}

/// State of an open episode.
struct Game {
    session: LiveSession,
    /// Number of the next turn.
    next: u64,
    /// Number of the turn that has advanced the world, but whose trace may not be stored yet.
    advanced: Option<u64>,
    /// Answer to the last turn.
    answer: Option<Bytes>,
    /// Number of lines of the trace that are stored, and the frame at that time.
    stored: (usize, Frame),
    /// True if the trace is stored before the next answer.
    is_due: bool,
}

impl Sessions {
    /// Creates a set without open episodes. The registry creates the helpers of the conditions.
    pub fn new(helpers: &'static dyn HelperRegistry) -> Sessions {
        Sessions { helpers, open: Mutex::default() }
    }

    /// Opens an episode of a participant, from its stored trace if it has begun, and returns its facts and the
    /// number of the next turn (JSON). An open episode stays as it is.
    ///
    /// # Errors
    /// The [`Refusal`].
    pub fn open(
        &self,
        store: &Store,
        code: &str,
        token: &TokenDigest,
        trial: usize,
        now_secs: u64,
    ) -> Result<String, Refusal> {
        let running = store.running_trial(code, token, trial, now_secs)?;
        let open = self.entry(code, trial, now_secs)?;
        let mut game = try_lock(&open.game)?;
        if game.is_none() {
            let simulated = Game::new(store.plan(), running.trial, &running.trace, self.helpers);
            *game = Some(simulated.inspect_err(|_| self.close(code))?);
        }
        let Some(game) = &*game else { return Err(Refusal::Closed) };
        let mut info = game.session.info();
        // The episodes of the benchmark are public, with their goals.
        info.episode.clear();
        Ok(json!({ "info": info, "next": game.next }).to_string())
    }

    /// Counts a turn against the rate of the participant, before any work.
    ///
    /// # Errors
    /// The [`Refusal`].
    pub fn take_token(&self, code: &str, trial: usize, now_secs: u64) -> Result<(), Refusal> {
        let open = self.find(code, trial)?;
        open.last_used_secs.store(now_secs, Ordering::Relaxed);
        if lock(&open.bucket).take(now_secs) { Ok(()) } else { Err(Refusal::Rate) }
    }

    /// Performs the turn with a number and returns the state as a line of JSON and the picture (PNG). If the last
    /// turn is repeated, the answer is the same.
    ///
    /// # Errors
    /// The [`Refusal`]. A turn of which the trace cannot be stored can be repeated.
    pub fn turn(
        &self,
        store: &Store,
        code: &str,
        trial: usize,
        number: u64,
        turn: &AdvanceRequest,
    ) -> Result<Bytes, Refusal> {
        let open = self.find(code, trial)?;
        let mut game = try_lock(&open.game)?;
        let game = game.as_mut().ok_or(Refusal::Closed)?;
        if let Some(answer) =
            game.answer.as_ref().filter(|_| number.checked_add(1) == Some(game.next))
        {
            return Ok(answer.clone());
        }
        let done = game.turn(store, code, trial, number, turn);
        if matches!(
            done,
            Err(Refusal::Over | Refusal::Unknown | Refusal::Simulator(_) | Refusal::Ending)
        ) {
            self.close(code);
        }
        done
    }

    /// Closes the episode of a participant if the stored data show that it does not run.
    pub fn close_ended(&self, store: &Store, code: &str) {
        let open = lock(&self.open).get(code).cloned();
        if open.is_some_and(|open| !store.is_running(code, open.trial)) {
            self.close(code);
        }
    }

    /// Closes the episode of a participant.
    pub fn close(&self, code: &str) {
        let closed = lock(&self.open).remove(code);
        drop_later(closed);
    }

    /// Closes the episodes that have had no turn for [`SESSION_IDLE_SECS`].
    pub fn close_idle(&self, now_secs: u64) {
        let closed = take_idle(&mut lock(&self.open), now_secs);
        drop_later(closed);
    }

    fn find(&self, code: &str, trial: usize) -> Result<Arc<OpenSession>, Refusal> {
        let found = lock(&self.open).get(code).cloned();
        found.filter(|open| open.trial == trial).ok_or(Refusal::Closed)
    }

    /// Returns the open episode of a participant, or a new one if there is memory for it.
    fn entry(&self, code: &str, trial: usize, now_secs: u64) -> Result<Arc<OpenSession>, Refusal> {
        let mut open = lock(&self.open);
        if let Some(known) = open.get(code).filter(|known| known.trial == trial) {
            known.last_used_secs.store(now_secs, Ordering::Relaxed);
            return Ok(Arc::clone(known));
        }
        let mut closed: Vec<Arc<OpenSession>> = open.remove(code).into_iter().collect();
        closed.extend(take_idle(&mut open, now_secs));
        drop_later(closed);
        if open.len() >= MAX_SESSIONS {
            return Err(Refusal::Busy);
        }
        let created = Arc::new(OpenSession {
            trial,
            last_used_secs: AtomicU64::new(now_secs),
            bucket: Mutex::new(TokenBucket::new(TURN_RATE, now_secs)),
            game: Mutex::new(None),
        });
        open.insert(code.to_owned(), Arc::clone(&created));
        Ok(created)
    }
}

/// Removes the episodes that have had no turn for [`SESSION_IDLE_SECS`] and have no turn in
/// progress.
fn take_idle(
    open: &mut BTreeMap<String, Arc<OpenSession>>,
    now_secs: u64,
) -> Vec<Arc<OpenSession>> {
    let is_idle = |known: &OpenSession| {
        let last_used_secs = known.last_used_secs.load(Ordering::Relaxed);
        // A turn in progress stores its part of the trace later. Another session would have the same part.
        now_secs.saturating_sub(last_used_secs) >= SESSION_IDLE_SECS
            && try_lock(&known.game).is_ok()
    };
    open.extract_if(.., |_, known| is_idle(known)).map(|(_, known)| known).collect()
}

/// Drops episodes in a new thread, because the end of a helper's process can take seconds.
fn drop_later(closed: impl IntoIterator<Item = Arc<OpenSession>>) {
    let closed: Vec<Arc<OpenSession>> = closed.into_iter().collect();
    if !closed.is_empty() {
        thread::spawn(move || drop(closed));
    }
}

/// Locks a mutex unless it is locked already.
fn try_lock<T>(mutex: &Mutex<T>) -> Result<MutexGuard<'_, T>, Refusal> {
    match mutex.try_lock() {
        Ok(guard) => Ok(guard),
        Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
        Err(TryLockError::WouldBlock) => Err(Refusal::InProgress),
    }
}

impl Game {
    /// Starts an episode, or continues its stored trace.
    fn new(
        plan: &StudyPlan,
        trial: Trial,
        trace: &str,
        helpers: &dyn HelperRegistry,
    ) -> Result<Game, Refusal> {
        let episode = plan.episodes()[trial.episode].to_json_line();
        let config = live_config(plan, trial);
        let session = if trace.is_empty() {
            LiveSession::start(episode.as_bytes(), &config, helpers)?
        } else {
            LiveSession::resume(trace.as_bytes(), episode.as_bytes(), &config, helpers)?
        };
        let stored = (trace.lines().count(), session.frame());
        Ok(Game { session, next: 0, advanced: None, answer: None, stored, is_due: false })
    }

    fn turn(
        &mut self,
        store: &Store,
        code: &str,
        trial: usize,
        number: u64,
        turn: &AdvanceRequest,
    ) -> Result<Bytes, Refusal> {
        if number != self.next {
            return Err(Refusal::Turn { next: self.next });
        }
        if self.advanced != Some(number) {
            if self.session.status() == LiveStatus::Ended && self.answer.is_some() {
                return Err(Refusal::Over);
            }
            self.advance(turn)?;
            self.advanced = Some(number);
        }
        self.store(store, code, trial)?;
        let state = serde_json::to_string(&self.session.state());
        let mut answer = state.expect("a state has string keys").into_bytes();
        answer.push(b'\n');
        let rgb = self.session.draw_view_rgb(turn.view_px);
        answer.extend(to_png(&rgb, turn.view_px).expect("the size is that of the drawn view"));
        let answer = Bytes::from(answer);
        self.answer = Some(answer.clone());
        self.next += 1;
        Ok(answer)
    }

    fn advance(&mut self, turn: &AdvanceRequest) -> Result<(), Refusal> {
        let was_waiting = self.session.status() == LiveStatus::Waiting;
        let has_decided = turn.input.as_ref().is_some_and(|input| self.session.decide(input));
        let status = self.session.advance(turn.frames)?;
        self.is_due |= match status {
            LiveStatus::Waiting => has_decided || !was_waiting,
            LiveStatus::Running => has_decided,
            LiveStatus::Ended => true,
        };
        Ok(())
    }

    /// Stores the new lines of the trace if they are due: at decisions, at the end, and after some time.
    fn store(&mut self, store: &Store, code: &str, trial: usize) -> Result<(), Refusal> {
        let frame = self.session.frame();
        let (n_lines, stored_frame) = self.stored;
        if self.is_due || frame >= stored_frame + RECORD_FRAMES {
            let has_ended = self.session.status() == LiveStatus::Ended;
            store.append_trace(code, trial, self.session.trace_after(n_lines), has_ended)?;
            self.stored = (self.session.n_lines(), frame);
            self.is_due = false;
        }
        Ok(())
    }
}

/// Returns the configuration with which the page plays a trial.
fn live_config(plan: &StudyPlan, trial: Trial) -> LiveConfig {
    let condition = &plan.conditions()[trial.condition];
    LiveConfig {
        seed: SEED,
        seat: match condition.seat {
            Seat::Partner => AgentId::PARTNER,
            Seat::Helper => AgentId::HELPER,
        },
        level: match condition.input {
            Input::Plans => InputLevel::Plans,
            Input::Steps => InputLevel::Steps,
        },
        helper: plan.helper(trial).to_owned(),
        is_live: plan.study().play.world == WorldPace::RealTime,
    }
}

#[cfg(test)]
mod tests {
    use chaic_env::helper_registry::BuiltInHelpers;

    use super::*;

    #[test]
    fn the_number_of_open_episodes_is_bounded_and_idle_ones_make_room() {
        let sessions = Sessions::new(&BuiltInHelpers);
        for n in 0..MAX_SESSIONS {
            sessions.entry(&n.to_string(), 0, n as u64 / 2).expect("there is memory");
        }
        let now_secs = MAX_SESSIONS as u64 / 2;
        assert!(matches!(sessions.entry("new", 0, now_secs), Err(Refusal::Busy)));
        // A participant who plays the next episode still has only one open episode.
        sessions.entry("0", 1, now_secs).expect("its own place");
        assert!(sessions.find("0", 0).is_err() && sessions.find("0", 1).is_ok());
        sessions.entry("new", 0, SESSION_IDLE_SECS).expect("the place of an idle participant");
        assert!(sessions.find("1", 0).is_err() && sessions.find("9", 0).is_ok());
        sessions.close("9");
        assert!(sessions.find("9", 0).is_err());
    }

    #[test]
    fn an_episode_with_a_turn_in_progress_is_not_idle() {
        let sessions = Sessions::new(&BuiltInHelpers);
        let open = sessions.entry("1", 0, 0).expect("there is memory");
        let turn = lock(&open.game);
        sessions.close_idle(SESSION_IDLE_SECS);
        assert!(sessions.find("1", 0).is_ok());
        drop(turn);
        sessions.close_idle(SESSION_IDLE_SECS);
        assert!(sessions.find("1", 0).is_err());
    }
}
