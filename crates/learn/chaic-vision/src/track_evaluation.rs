//! Evaluation of tracks over whole episodes: the objects that a helper detects and remembers,
//! compared with ground-truth ids.
//!
//! The rule-based planner acts on the evaluated perception. Ids reach the evaluation only. Evaluated
//! objects are movable objects and goal places. Objects that the helper has held are excluded from
//! what it should remember.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use chaic_agents::behavior::{BehaviorLog, BehaviorModel};
use chaic_agents::helpers::rhp;
use chaic_agents::memory::Memory;
use chaic_agents::perception::{Detection, GroundTruthIds, Perception, Percepts};
use chaic_agents::perception_factory::PerceptionFactory;
use chaic_agents::track::{Hands, Intent, TrackId};
use chaic_core::geom::horizontal_distance;
use chaic_core::observation::{Grants, SensorConfig};
use chaic_core::{
    AgentError, AgentId, Briefing, ClassId, EntityId, Observation, Outcome, Target, TaskId, Vec3,
};
use chaic_env::helper_registry::Helper;
use chaic_env::rules::{RuleSet, RuleSetName};
use chaic_env::{AdvanceOutcome, Env, EpisodeConfig, seeded_by_episode};
use chaic_episodes::{SeedRange, find_episode};
use serde::Serialize;

use crate::calibration::calibration_error;
use crate::evaluate::MIN_AREA_PX;
use crate::parallel::map_in_order;
use crate::views::DatasetSplit;

/// Upper bounds of the distance ranges, meters. Objects are measured up to 10 m (facts A1.8).
const RANGES_M: [u32; 4] = [2, 4, 7, 10];
/// Maximum number of episodes of an evaluation: half of the seeds, so that the other half can replace
/// those without a valid episode.
pub const MAX_EPISODES: u32 = 5000;
/// Number of seeds that are tried for an episode. It is at most the number of tasks, so no episode
/// can occur twice.
const MAX_ATTEMPTS: u64 = 8;
/// A remembered object may be this far from the true position, plus half of its largest horizontal
/// extent, meters.
const MAX_ERROR_M: f32 = 0.5;

/// Ratio of counts with the half width of its 95 % interval over episodes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RateEstimate {
    /// Ratio of the sums; `None` if the denominators are 0.
    pub value: Option<f64>,
    /// Half width of the interval (linearized variance of a ratio of sums over episodes); `None` unless
    /// two episodes have a denominator above 0.
    pub interval: Option<f64>,
    /// Sum of the denominators.
    pub n: usize,
}

impl RateEstimate {
    /// Computes the ratio from the numerator and denominator of each episode.
    pub(crate) fn new(counts: impl Iterator<Item = [usize; 2]> + Clone) -> RateEstimate {
        let sum = |k: usize| counts.clone().map(|c| c[k]).sum::<usize>();
        let (n, n_episodes) = (sum(1), counts.clone().count() as f64);
        let value = (n > 0).then(|| sum(0) as f64 / n as f64);
        let has_interval = counts.clone().filter(|c| c[1] > 0).count() > 1;
        let half_width = |value: f64| {
            let residuals = counts.clone().map(|[a, b]| a as f64 - value * b as f64);
            let squares: f64 = residuals.map(|residual| residual * residual).sum();
            1.96 * (n_episodes / (n_episodes - 1.0) * squares).sqrt() / n as f64
        };
        RateEstimate { value, interval: value.filter(|_| has_interval).map(half_width), n }
    }
}

/// Accuracy of tracks over whole episodes, serialized as JSON.
#[derive(Clone, Debug, Serialize)]
pub struct TrackReport {
    /// Number of evaluated episodes.
    pub episodes: usize,
    /// Episodes that failed. All other fields exclude them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<EpisodeFailure>,
    /// Number of processed images.
    pub images: usize,
    /// Fraction of detections in an image that show an object of their class.
    pub detection_precision: RateEstimate,
    /// Fraction of objects of [`MIN_AREA_PX`] pixels and more that are detected with their class, by
    /// upper end of the range of distance in meters.
    pub detection_recall_by_m: BTreeMap<u32, RateEstimate>,
    /// The same for all distances up to 10 m.
    pub detection_recall: RateEstimate,
    /// Fraction of objects in memory at the end that were seen at their place, by the smallest distance
    /// from which their track was detected in meters.
    pub memory_precision_by_m: BTreeMap<u32, RateEstimate>,
    /// The same for all distances, also those beyond 10 m.
    pub memory_precision: RateEstimate,
    /// Fraction of the objects seen with enough pixels that are in memory at the end, by the smallest
    /// distance from which they were seen in meters.
    pub memory_recall_by_m: BTreeMap<u32, RateEstimate>,
    /// The same for all distances up to 10 m.
    pub memory_recall: RateEstimate,
    /// Mean number of identity switches per object: changes of its track.
    pub identity_switches: RateEstimate,
    /// Fraction of detected people that are visible within 0.5 m of their detected position.
    pub person_precision: RateEstimate,
    /// Fraction of people of [`MIN_AREA_PX`] pixels and more that are detected within 0.5 m of their
    /// position.
    pub person_recall: RateEstimate,
    /// Expected calibration error of the confidences of detections; `None` without detections.
    pub calibration_error: Option<f64>,
    /// Counts by class name.
    pub classes: BTreeMap<&'static str, ClassCounts>,
}

/// Episode that failed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EpisodeFailure {
    /// Name of the episode.
    pub episode: String,
    /// Cause.
    pub problem: String,
}

/// Counts of the objects of one class, over all episodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ClassCounts {
    /// Objects seen with enough pixels, except for those that the helper has held.
    pub seen: usize,
    /// Seen objects that are in memory at the end.
    pub remembered: usize,
    /// Objects in memory that were not seen at their place.
    pub false_memories: usize,
    /// Changes of the track of an object.
    pub identity_switches: usize,
}

/// Returns the position of a seed in a range of `n_seeds`. Episode `k` has the `k`th one; if it is
/// invalid, further attempts replace it by seeds from the end of the range.
fn seed_position(k: u64, attempt: u64, n_seeds: u64) -> u64 {
    match attempt.checked_sub(1) {
        None => k,
        Some(n) => n_seeds - 1 - (k + n) % u64::from(MAX_EPISODES),
    }
}

/// Plays episodes of a split, at most [`MAX_EPISODES`], and evaluates the tracks. Tasks take turns.
/// `progress` is called after each episode. Returns `None` if `stop` is set meanwhile.
pub fn evaluate_tracks(
    perception: &dyn PerceptionFactory,
    split: DatasetSplit,
    n_episodes: usize,
    n_threads: usize,
    progress: &(dyn Fn() + Sync),
    stop: &AtomicBool,
) -> Option<TrackReport> {
    let tasks: Vec<TaskId> = TaskId::paper().collect();
    let seeds = SeedRange::perception(split);
    let play = |(): &mut (), k: usize| {
        // Some seeds have no valid episode.
        let seed = |attempt| seeds.first + seed_position(k as u64, attempt, seeds.count);
        let id = |attempt| format!("{}/gen-standard/{}", tasks[k % tasks.len()], seed(attempt));
        let found = (0..MAX_ATTEMPTS).find_map(|attempt| find_episode(&id(attempt)).ok());
        let episode = found.expect("one of several seeds has an episode");
        let rules = RuleSet::named(RuleSetName::Paper);
        let records = Arc::new(Mutex::new(EpisodeRecord::default()));
        let factory = RecorderFactory { perception, records: Arc::clone(&records) };
        let agent = Box::new(rhp(rules.planner, &factory));
        let grants = factory.grants(Grants::PLANNER);
        let config = EpisodeConfig { rules, ..EpisodeConfig::new(&episode, "rhp") };
        let helper = seeded_by_episode(Helper { agent, grants }, &config);
        let mut env = Env::new(config, Some(helper)).expect("the episode is valid");
        let played = env.run(stop, None, &mut |_| -> Result<(), AgentError> { Ok(()) });
        progress();
        let record = std::mem::take(&mut *lock(&records));
        evaluated(episode.id(), &played, record)
    };
    let played = map_in_order(0..n_episodes, n_threads, stop, || (), play)?;
    if stop.load(Ordering::Relaxed) {
        return None;
    }
    let (mut records, mut failures) = (Vec::new(), Vec::new());
    for result in played {
        match result {
            Ok(record) => records.push(record),
            Err(failure) => failures.push(failure),
        }
    }
    Some(TrackReport { failures, ..TrackReport::new(&records) })
}

/// Returns the record of an episode that ended, or the reason for which it is left out.
fn evaluated(
    episode: &str,
    played: &Result<AdvanceOutcome, AgentError>,
    record: EpisodeRecord,
) -> Result<EpisodeRecord, EpisodeFailure> {
    let problem = match played {
        Ok(AdvanceOutcome::Ended) => return Ok(record),
        Ok(_) => "it did not reach its end".to_owned(),
        Err(error) => error.to_string(),
    };
    Err(EpisodeFailure { episode: episode.to_owned(), problem })
}

/// Object as it was last seen.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sighting {
    class: ClassId,
    position_in_world: Vec3,
}

/// Object in memory at the end.
#[derive(Clone, Copy, Debug, PartialEq)]
struct RememberedObject {
    sighting: Sighting,
    /// Smallest distance from which its track was detected; infinite if it never was.
    nearest_m: f32,
}

/// Sightings of an object with known id.
#[derive(Clone, Copy, Debug)]
struct TrueObject {
    last: Sighting,
    /// Smallest distance from which it was seen with enough pixels; infinite if it never was.
    nearest_m: f32,
    /// Track of its last detection.
    track: Option<TrackId>,
    n_switches: usize,
}

/// Counts of visible and of detected people in images.
#[derive(Clone, Copy, Debug, Default)]
struct PersonCounts {
    detected: usize,
    /// Detected near their true position.
    correct: usize,
    /// Visible with enough pixels.
    visible: usize,
    /// Visible with enough pixels and detected near their true position.
    found: usize,
}

impl PersonCounts {
    /// Adds one image.
    fn add(&mut self, detections: &[Detection], truths: &[Detection]) {
        let is_near = |a: &Detection, b: &Detection| {
            let distance_m = horizontal_distance(a.position_in_world, b.position_in_world);
            a.person == b.person && distance_m < MAX_ERROR_M
        };
        let people = |detections: &[Detection]| -> Vec<Detection> {
            detections.iter().filter(|d| d.person.is_some()).cloned().collect()
        };
        let (detected, truths) = (people(detections), people(truths));
        self.detected += detected.len();
        self.correct += detected.iter().filter(|d| truths.iter().any(|t| is_near(d, t))).count();
        let visible = truths.iter().filter(|t| t.n_pixels >= MIN_AREA_PX);
        for truth in visible {
            self.visible += 1;
            self.found += usize::from(detected.iter().any(|d| is_near(d, truth)));
        }
    }
}

/// Counts of one episode.
#[derive(Clone, Debug, Default)]
struct EpisodeRecord {
    goal_places: Vec<ClassId>,
    n_images: usize,
    /// Confidence and correctness of each detection.
    detections: Vec<(f32, bool)>,
    /// Distance of each visible object, and whether it is detected with its class.
    visible: Vec<(f32, bool)>,
    people: PersonCounts,
    objects: BTreeMap<EntityId, TrueObject>,
    /// Objects that the helper has held: their ids, and their tracks.
    held: BTreeSet<EntityId>,
    held_tracks: BTreeSet<TrackId>,
    /// Smallest distance of the detections of each track, meters.
    detected_m: BTreeMap<TrackId, f32>,
    /// Evaluated objects in memory, at the end.
    memory: Vec<RememberedObject>,
}

impl EpisodeRecord {
    fn is_evaluated(&self, class: ClassId) -> bool {
        class.info().is_movable() || self.goal_places.contains(&class)
    }

    /// Adds one image with its detections. Reused detections do not count.
    fn add_image(&mut self, observation: &Observation, percepts: &Percepts) {
        let held = observation.proprioception.held().filter_map(|held| held.identity.as_ref());
        self.held.extend(held.flat_map(|held| {
            std::iter::once(held.entity).chain(held.contents.iter().map(|(entity, _)| *entity))
        }));
        let Some(ids) = &observation.images.ids else { return };
        self.n_images += 1;
        let width = observation.camera.width as usize;
        let eye = observation.camera.eye_in_world;
        let mut track_of: BTreeMap<EntityId, TrackId> = BTreeMap::new();
        for detection in &percepts.detections {
            let nearest_m = self.detected_m.entry(detection.track).or_insert(f32::INFINITY);
            *nearest_m = nearest_m.min(eye.distance(detection.position_in_world));
            if detection.person.is_some() || !self.is_evaluated(detection.class) {
                continue;
            }
            let [column, row] = detection.pixel.map(|x| x as usize);
            let entity = ids.get(row * width + column).map(|id| EntityId(*id));
            let entity = entity
                .filter(|entity| observation.granted.class_of(*entity) == Some(detection.class));
            if !percepts.is_reused {
                self.detections.push((detection.confidence, entity.is_some()));
            }
            if let Some(entity) = entity {
                track_of.insert(entity, detection.track);
            }
        }
        let truths = GroundTruthIds.perceive(observation).detections;
        if !percepts.is_reused {
            self.people.add(&percepts.detections, &truths);
        }
        for truth in truths {
            let entity = u16::try_from(truth.track.0).map(EntityId);
            let Ok(entity) = entity else { continue };
            if truth.person.is_some() || !self.is_evaluated(truth.class) {
                continue;
            }
            let position_in_world = truth.position_in_world;
            let last = Sighting { class: truth.class, position_in_world };
            let distance_m = eye.distance(position_in_world);
            let track = track_of.get(&entity).copied();
            let unseen = TrueObject { last, nearest_m: f32::INFINITY, track: None, n_switches: 0 };
            let object = self.objects.entry(entity).or_insert(unseen);
            object.last = last;
            if truth.n_pixels >= MIN_AREA_PX {
                object.nearest_m = object.nearest_m.min(distance_m);
                if !percepts.is_reused {
                    self.visible.push((distance_m, track.is_some()));
                }
            }
            if let Some(track) = track {
                object.n_switches += usize::from(object.track.is_some_and(|old| old != track));
                object.track = Some(track);
            }
        }
    }

    /// Matches the objects in memory to true ones, the nearest pairs first. Returns, for each object
    /// in memory, its true object.
    fn matches(&self) -> Vec<Option<EntityId>> {
        let mut pairs: Vec<(f32, usize, EntityId)> = Vec::new();
        for (k, RememberedObject { sighting: remembered, .. }) in self.memory.iter().enumerate() {
            for (entity, truth) in &self.objects {
                let distance_m =
                    horizontal_distance(remembered.position_in_world, truth.last.position_in_world);
                let [x, _, z] = truth.last.class.info().size_m;
                let is_near = distance_m < MAX_ERROR_M + 0.5 * x.max(z);
                if is_near && remembered.class == truth.last.class {
                    pairs.push((distance_m, k, *entity));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut matches = vec![None; self.memory.len()];
        for (_, k, entity) in pairs {
            if matches[k].is_none() && !matches.contains(&Some(entity)) {
                matches[k] = Some(entity);
            }
        }
        matches
    }

    /// Numbers of objects in memory that were seen at their place, and of all in memory, within a range
    /// of distance.
    fn memory_precision(&self, range_m: [f32; 2]) -> [usize; 2] {
        let matches = self.matches();
        let remembered = self.memory.iter().zip(&matches);
        let in_range =
            remembered.filter(|(object, _)| (range_m[0]..range_m[1]).contains(&object.nearest_m));
        in_range
            .fold([0, 0], |[seen, n], (_, entity)| [seen + usize::from(entity.is_some()), n + 1])
    }

    /// Numbers of remembered objects, and of all objects seen with enough pixels, within a range of
    /// distance, without those that the helper has held.
    fn memory_recall(&self, range_m: [f32; 2]) -> [usize; 2] {
        let matches = self.matches();
        let seen = self.objects.iter().filter(|(entity, object)| {
            let is_in_range = (range_m[0]..range_m[1]).contains(&object.nearest_m);
            is_in_range && !self.held.contains(entity)
        });
        let seen: Vec<EntityId> = seen.map(|(entity, _)| *entity).collect();
        [seen.iter().filter(|entity| matches.contains(&Some(**entity))).count(), seen.len()]
    }

    /// Adds the counts by class.
    fn count_classes(&self, classes: &mut BTreeMap<&'static str, ClassCounts>) {
        let matches = self.matches();
        for (entity, object) in &self.objects {
            let counts = classes.entry(object.last.class.name()).or_default();
            counts.identity_switches += object.n_switches;
            if object.nearest_m.is_finite() && !self.held.contains(entity) {
                counts.seen += 1;
                counts.remembered += usize::from(matches.contains(&Some(*entity)));
            }
        }
        let unmatched = self.memory.iter().zip(&matches).filter(|(_, entity)| entity.is_none());
        for (remembered, _) in unmatched {
            classes.entry(remembered.sighting.class.name()).or_default().false_memories += 1;
        }
    }

    fn detection_recall(&self, range_m: [f32; 2]) -> [usize; 2] {
        let visible = self.visible.iter().filter(|(m, _)| (range_m[0]..range_m[1]).contains(m));
        visible.fold([0, 0], |[found, n], (_, is_found)| [found + usize::from(*is_found), n + 1])
    }
}

impl TrackReport {
    fn new(records: &[EpisodeRecord]) -> TrackReport {
        let lower = std::iter::once(0).chain(RANGES_M);
        let ranges = || lower.clone().zip(RANGES_M).map(|(low, high)| [low as f32, high as f32]);
        let by_m = |count: &dyn Fn(&EpisodeRecord, [f32; 2]) -> [usize; 2]| {
            let rates =
                ranges().map(|range| RateEstimate::new(records.iter().map(|r| count(r, range))));
            RANGES_M.into_iter().zip(rates).collect::<BTreeMap<u32, RateEstimate>>()
        };
        let all = [0.0, RANGES_M[RANGES_M.len() - 1] as f32];
        let scored: Vec<(f32, bool)> =
            records.iter().flat_map(|r| r.detections.iter().copied()).collect();
        let n_correct =
            |r: &EpisodeRecord| r.detections.iter().filter(|(_, is_correct)| *is_correct).count();
        let switches = |r: &EpisodeRecord| {
            let tracked = || r.objects.values().filter(|object| object.track.is_some());
            [tracked().map(|object| object.n_switches).sum(), tracked().count()]
        };
        let mut classes = BTreeMap::new();
        records.iter().for_each(|record| record.count_classes(&mut classes));
        TrackReport {
            episodes: records.len(),
            failures: Vec::new(),
            images: records.iter().map(|r| r.n_images).sum(),
            detection_precision: RateEstimate::new(
                records.iter().map(|r| [n_correct(r), r.detections.len()]),
            ),
            detection_recall_by_m: by_m(&EpisodeRecord::detection_recall),
            detection_recall: RateEstimate::new(records.iter().map(|r| r.detection_recall(all))),
            memory_precision_by_m: by_m(&EpisodeRecord::memory_precision),
            memory_precision: RateEstimate::new(records.iter().map(|r| {
                let matches = r.matches();
                [matches.iter().flatten().count(), matches.len()]
            })),
            memory_recall_by_m: by_m(&EpisodeRecord::memory_recall),
            memory_recall: RateEstimate::new(records.iter().map(|r| r.memory_recall(all))),
            identity_switches: RateEstimate::new(records.iter().map(switches)),
            person_precision: RateEstimate::new(
                records.iter().map(|r| [r.people.correct, r.people.detected]),
            ),
            person_recall: RateEstimate::new(
                records.iter().map(|r| [r.people.found, r.people.visible]),
            ),
            calibration_error: (!scored.is_empty()).then(|| calibration_error(&scored)),
            classes,
        }
    }
}

fn lock(records: &Mutex<EpisodeRecord>) -> MutexGuard<'_, EpisodeRecord> {
    records.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Factory that wraps a perception, so that its detections are recorded.
struct RecorderFactory<'a> {
    perception: &'a dyn PerceptionFactory,
    records: Arc<Mutex<EpisodeRecord>>,
}

impl PerceptionFactory for RecorderFactory<'_> {
    fn name(&self) -> Option<String> {
        self.perception.name()
    }

    fn sensors(&self) -> SensorConfig {
        SensorConfig { ids: true, ..self.perception.sensors() }
    }

    fn grants(&self, requested: Grants) -> Grants {
        Grants { ids: true, ..self.perception.grants(requested) }
    }

    fn perception(&self) -> Box<dyn Perception> {
        Box::new(RecordedPerception {
            perception: self.perception.perception(),
            needs_ids: self.perception.grants(Grants::IDS).ids,
            records: Arc::clone(&self.records),
        })
    }

    fn behavior(&self, _: AgentId) -> Option<Box<dyn BehaviorModel>> {
        let records = Arc::clone(&self.records);
        Some(Box::new(MemoryRecorder { records, log: BehaviorLog::default() }))
    }
}

/// Perception whose detections are compared with ids.
struct RecordedPerception {
    perception: Box<dyn Perception>,
    /// False if the perception sees no ids.
    needs_ids: bool,
    records: Arc<Mutex<EpisodeRecord>>,
}

impl Perception for RecordedPerception {
    fn reset(&mut self, briefing: &Briefing) {
        lock(&self.records).goal_places.clone_from(&briefing.goal_places);
        self.perception.reset(briefing);
    }

    fn update_hands(&mut self, hands: &Hands, last: Option<(Intent, Outcome)>) {
        lock(&self.records).held_tracks.extend(hands.all().map(|(track, _)| track));
        self.perception.update_hands(hands, last);
    }

    fn perceive(&mut self, observation: &Observation) -> Percepts {
        let percepts = match self.needs_ids {
            true => self.perception.perceive(observation),
            false => self.perception.perceive(&observation.without_ids(Grants::NONE)),
        };
        lock(&self.records).add_image(observation, &percepts);
        percepts
    }

    fn target(&self, track: TrackId) -> Option<Target> {
        self.perception.target(track)
    }

    fn uses_pixel_targets(&self) -> bool {
        self.perception.uses_pixel_targets()
    }

    fn hides_ids(&self) -> bool {
        !self.needs_ids || self.perception.hides_ids()
    }

    fn fork(&self) -> Box<dyn Perception> {
        Box::new(RecordedPerception {
            perception: self.perception.fork(),
            needs_ids: self.needs_ids,
            records: Arc::clone(&self.records),
        })
    }
}

/// Behavior model that copies the remembered objects after each image.
struct MemoryRecorder {
    records: Arc<Mutex<EpisodeRecord>>,
    log: BehaviorLog,
}

impl BehaviorModel for MemoryRecorder {
    fn reset(&mut self) {}

    fn observe(&mut self, _: &Observation, memory: &Memory) {
        let mut records = lock(&self.records);
        let remembered = memory.objects.iter().filter(|object| {
            let is_evaluated = records.is_evaluated(object.class);
            is_evaluated && object.is_present && !records.held_tracks.contains(&object.track)
        });
        let remembered = remembered.map(|object| RememberedObject {
            sighting: Sighting { class: object.class, position_in_world: object.position_in_world },
            nearest_m: records.detected_m.get(&object.track).copied().unwrap_or(f32::INFINITY),
        });
        let remembered: Vec<RememberedObject> = remembered.collect();
        records.memory = remembered;
    }

    fn log(&self) -> &BehaviorLog {
        &self.log
    }

    fn fork(&self) -> Box<dyn BehaviorModel> {
        let records = Arc::clone(&self.records);
        Box::new(MemoryRecorder { records, log: self.log.clone() })
    }
}

#[cfg(test)]
mod tests;
