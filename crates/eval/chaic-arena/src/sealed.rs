//! Episodes that follow from a secret, and the public commitment to them.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use chaic_core::TaskId;
use chaic_env::partner_suite::{MAX_PARTNERS, PartnerSuite, SuitePartner};
use chaic_episodes::{
    Episode, GenerateError, GeneratorSeeds, SeedRange, Settings, generate_episode,
};
use chaic_files::{create_folders, entries, write_atomically};
use hkdf::Hkdf;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::error::ArenaError;
use crate::partners::PartnersDigest;
use crate::secret::{Secret, to_hex};

/// Format of [`Commitment`].
const FORMAT: &str = "chaic-sealed-split";
/// Version of the format and of the derivation of seeds.
const VERSION: u32 = 1;
/// Separates the uses of the secret from each other, and from those of other programs.
const DOMAIN: &[u8] = b"chaic sealed split 1";
/// Maximum number of episodes per task.
const MAX_PER_TASK: usize = 10_000;

/// Public description of a sealed split, `commitment.json`. It discloses nothing about the episodes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Commitment {
    format: String,
    version: u32,
    /// Version of chaic that generated the episodes.
    chaic: String,
    /// Tasks of the split.
    tasks: Vec<TaskId>,
    /// Episodes of each task.
    n_episodes: usize,
    /// SHA-256 of the domain and the secret.
    secret_sha256: String,
    /// SHA-256 of all episodes, each as one line of JSON, in the order of tasks and numbers.
    episodes_sha256: String,
    /// Partners; absent without any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    partners: Option<PartnersDigest>,
}

impl Commitment {
    /// Reads `commitment.json`.
    ///
    /// # Errors
    /// [`ArenaError::Format`] with the problem.
    pub fn parse(bytes: &[u8]) -> Result<Commitment, ArenaError> {
        let problem = |problem: String| Err(ArenaError::Format(problem));
        let commitment: Commitment = match serde_json::from_slice(bytes) {
            Ok(commitment) => commitment,
            Err(error) => return problem(error.to_string()),
        };
        let Commitment { format, version, tasks, n_episodes, .. } = &commitment;
        let has_duplicates = (1..tasks.len()).any(|k| tasks[..k].contains(&tasks[k]));
        if format != FORMAT || *version != VERSION {
            return problem(format!("`{format}` {version}, expected `{FORMAT}` {VERSION}"));
        }
        if tasks.is_empty() || has_duplicates || !(1..=MAX_PER_TASK).contains(n_episodes) {
            return problem(format!(
                "`tasks` must differ, and `n_episodes` must be from 1 to {MAX_PER_TASK}"
            ));
        }
        if commitment.partners.as_ref().is_some_and(|p| !(1..=MAX_PARTNERS).contains(&p.n)) {
            return problem(format!("`partners.n` must be from 1 to {MAX_PARTNERS}"));
        }
        Ok(commitment)
    }

    /// Returns the file content.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain fields") + "\n"
    }

    /// Returns the split of this commitment.
    ///
    /// # Errors
    /// [`ArenaError::OtherSecret`] if the secret is another one.
    pub fn split(&self, secret: Secret) -> Result<SealedSplit, ArenaError> {
        let (tasks, n_episodes) = (self.tasks.clone(), self.n_episodes);
        let n_partners = self.partners.as_ref().map_or(0, |partners| partners.n);
        let split = SealedSplit { secret, tasks, n_episodes, n_partners };
        let (expected, found) = (self.secret_sha256.clone(), split.secret_sha256());
        if expected == found { Ok(split) } else { Err(ArenaError::OtherSecret { expected, found }) }
    }

    /// Checks that these episodes are all those of the commitment, in any order.
    ///
    /// # Errors
    /// [`ArenaError::OtherEpisodes`] if they are not.
    pub fn check_played(&self, episodes: &[Episode]) -> Result<(), ArenaError> {
        let rank = |episode: &Episode| self.tasks.iter().position(|task| *task == episode.task());
        let mut sorted: Vec<&Episode> = episodes.iter().collect();
        // The numbers of more than 1,000 episodes differ in length.
        sorted.sort_by_key(|episode| (rank(episode), episode.id().len(), episode.id()));
        if episodes_sha256(sorted) == self.episodes_sha256 {
            return Ok(());
        }
        Err(ArenaError::OtherEpisodes { sealed_by: self.chaic.clone() })
    }

    /// Checks that a run with several partners played those of the commitment. The bundled suite is public,
    /// so a split without partners of its own can be played with it.
    ///
    /// # Errors
    /// [`ArenaError::OtherPlayedPartners`] if the partners differ, and [`ArenaError::UncommittedPartners`]
    /// if the commitment has none.
    pub fn check_played_partners(&self, suite: &PartnerSuite) -> Result<(), ArenaError> {
        let played = PartnersDigest::new(suite);
        match &self.partners {
            Some(committed) if *committed == played => Ok(()),
            Some(committed) => {
                Err(ArenaError::OtherPlayedPartners { played, committed: committed.clone() })
            }
            None if *suite == PartnerSuite::bundled() => Ok(()),
            None => Err(ArenaError::UncommittedPartners { played }),
        }
    }

    /// Checks that this is the commitment to the same partners and episodes.
    ///
    /// # Errors
    /// [`ArenaError::OtherPartners`] or [`ArenaError::OtherEpisodes`] if it is not.
    pub fn check_content(&self, opened: &Commitment) -> Result<(), ArenaError> {
        if self.partners != opened.partners {
            return Err(ArenaError::OtherPartners { sealed_by: self.chaic.clone() });
        }
        if self.episodes_sha256 == opened.episodes_sha256 {
            return Ok(());
        }
        Err(ArenaError::OtherEpisodes { sealed_by: self.chaic.clone() })
    }
}

/// Returns the SHA-256 of episodes, each as one line of JSON, hexadecimal.
pub(crate) fn episodes_sha256<'a>(episodes: impl IntoIterator<Item = &'a Episode>) -> String {
    let mut digest = Sha256::new();
    for episode in episodes {
        digest.update(episode.to_json_line());
        digest.update("\n");
    }
    to_hex(&digest.finalize())
}

/// Episodes of the standard split's kind, with seeds from a secret, and partners drawn from it.
#[derive(Clone, Debug)]
pub struct SealedSplit {
    secret: Secret,
    tasks: Vec<TaskId>,
    n_episodes: usize,
    n_partners: usize,
}

impl SealedSplit {
    /// Creates a split with `n_episodes` episodes (1 to 10,000) of each task and no partners. A task
    /// counts once.
    pub fn new(secret: Secret, tasks: &[TaskId], n_episodes: usize) -> SealedSplit {
        assert!((1..=MAX_PER_TASK).contains(&n_episodes), "{n_episodes} episodes");
        let is_first = |k: &usize| !tasks[..*k].contains(&tasks[*k]);
        let tasks = (0..tasks.len()).filter(is_first).map(|k| tasks[k]).collect();
        SealedSplit { secret, tasks, n_episodes, n_partners: 0 }
    }

    /// Adds this number of drawn partners, up to [`MAX_PARTNERS`].
    #[must_use]
    pub fn with_partners(self, n_partners: usize) -> SealedSplit {
        assert!(n_partners <= MAX_PARTNERS, "{n_partners} partners");
        SealedSplit { n_partners, ..self }
    }

    /// Returns the number of episodes of all tasks.
    pub fn n_total(&self) -> usize {
        self.tasks.len() * self.n_episodes
    }

    /// Returns the name of the split: `sealed-` and the first digits of the commitment.
    pub fn name(&self) -> String {
        format!("sealed-{}", &self.secret_sha256()[..8])
    }

    fn secret_sha256(&self) -> String {
        to_hex(&Sha256::new().chain_update(DOMAIN).chain_update(self.secret.key()).finalize())
    }

    /// Returns eight bytes that follow from the secret: HKDF (RFC 5869) with SHA-256.
    fn derive(&self, info: &str) -> u64 {
        let derivation = Hkdf::<Sha256>::new(Some(DOMAIN), self.secret.key());
        let mut bytes = [0; 8];
        derivation.expand(info.as_bytes(), &mut bytes).expect("8 bytes are few enough");
        u64::from_le_bytes(bytes)
    }

    /// Returns the seed of an episode.
    fn seed(&self, task: TaskId, k: usize) -> u64 {
        // The range has a power of two as size.
        SeedRange::SEALED.first + self.derive(&format!("{task}/{k}")) % SeedRange::SEALED.count
    }

    /// Returns the drawn partners; `None` if the split has none.
    pub fn partners(&self) -> Option<PartnerSuite> {
        let partner = |k: usize| {
            SuitePartner::drawn(format!("sealed-{k:03}"), self.derive(&format!("partner/{k}")))
        };
        let partners: Vec<SuitePartner> = (0..self.n_partners).map(partner).collect();
        (!partners.is_empty()).then(|| PartnerSuite::new(partners).expect("drawn ones are valid"))
    }

    /// Generates the `k`-th episode of a task.
    ///
    /// # Errors
    /// [`GenerateError`] if its seed has no episode, which is a defect of the generator.
    pub fn episode(&self, task: TaskId, k: usize) -> Result<Episode, GenerateError> {
        let seed = self.seed(task, k);
        let (id, split) = (format!("{task}/{}/{k:03}", self.name()), self.name());
        let seeds = GeneratorSeeds { place: seed, episode: seed };
        generate_episode(id, split, task, seeds, Settings::STANDARD)
    }

    /// Returns the name of the file of an episode.
    fn file_name(task: TaskId, k: usize) -> String {
        format!("{task}-{k:03}.json")
    }

    /// Refuses an existing folder with episodes that do not belong to the split, such as those of a larger
    /// one. They would be played with it.
    ///
    /// # Errors
    /// [`ArenaError::UnknownFiles`], or if the folder cannot be read.
    pub fn check_folder(&self, folder: &Path) -> Result<(), ArenaError> {
        let of_task = |task: &TaskId| {
            let task = *task;
            (0..self.n_episodes).map(move |k| SealedSplit::file_name(task, k))
        };
        let expected: HashSet<String> = self.tasks.iter().flat_map(of_task).collect();
        let is_other = |path: &PathBuf| {
            path.extension().is_some_and(|extension| extension == "json")
                && path
                    .file_name()
                    .and_then(|name| name.to_str())
                    .is_none_or(|name| !expected.contains(name))
        };
        match entries(folder)?.iter().any(is_other) {
            true => Err(ArenaError::UnknownFiles(folder.to_owned())),
            false => Ok(()),
        }
    }

    /// Writes each episode to a file `TASK-NNN.json` of a folder, and returns the commitment. Returns
    /// `None` if `stop` is raised. `progress` is called after each episode.
    ///
    /// # Errors
    /// [`ArenaError`] if an episode cannot be generated or written.
    pub fn write(
        &self,
        folder: &Path,
        stop: &AtomicBool,
        progress: &mut dyn FnMut(),
    ) -> Result<Option<Commitment>, ArenaError> {
        create_folders(folder)?;
        self.check_folder(folder)?;
        self.generate(stop, &mut |task, k, episode| {
            let path = folder.join(SealedSplit::file_name(task, k));
            write_atomically(&path, episode.to_json().as_bytes())?;
            progress();
            Ok(())
        })
    }

    /// Returns the commitment, and writes nothing. Returns `None` if `stop` is raised. `progress` is
    /// called after each episode.
    ///
    /// # Errors
    /// [`ArenaError`] if an episode cannot be generated.
    pub fn commitment(
        &self,
        stop: &AtomicBool,
        progress: &mut dyn FnMut(),
    ) -> Result<Option<Commitment>, ArenaError> {
        self.generate(stop, &mut |_, _, _| {
            progress();
            Ok(())
        })
    }

    /// Passes each episode to a function with its task and number, and returns the commitment.
    fn generate(
        &self,
        stop: &AtomicBool,
        keep: &mut dyn FnMut(TaskId, usize, &Episode) -> Result<(), ArenaError>,
    ) -> Result<Option<Commitment>, ArenaError> {
        let mut digest = Sha256::new();
        for task in &self.tasks {
            for k in 0..self.n_episodes {
                if stop.load(Ordering::Relaxed) {
                    return Ok(None);
                }
                let episode = self.episode(*task, k)?;
                digest.update(episode.to_json_line());
                digest.update("\n");
                keep(*task, k, &episode)?;
            }
        }
        Ok(Some(Commitment {
            format: FORMAT.to_owned(),
            version: VERSION,
            chaic: env!("CARGO_PKG_VERSION").to_owned(),
            tasks: self.tasks.clone(),
            n_episodes: self.n_episodes,
            secret_sha256: self.secret_sha256(),
            episodes_sha256: to_hex(&digest.finalize()),
            partners: self.partners().as_ref().map(PartnersDigest::new),
        }))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use chaic_episodes::{Split, episodes};

    use super::*;

    fn split(digit: char) -> SealedSplit {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("secret");
        std::fs::write(&path, digit.to_string().repeat(64)).expect("a file");
        let secret = Secret::read(&path).expect("64 digits");
        // A task that is named twice counts once.
        let tasks: Vec<TaskId> = TaskId::paper().chain(TaskId::paper()).collect();
        SealedSplit::new(secret, &tasks, 2)
    }

    fn write(split: &SealedSplit) -> (tempfile::TempDir, Commitment) {
        let folder = tempfile::tempdir().expect("a folder");
        let mut n = 0;
        let commitment = split.write(folder.path(), &AtomicBool::new(false), &mut || n += 1);
        assert_eq!(n, split.n_total());
        assert_eq!(split.n_total(), split.tasks.len() * split.n_episodes);
        (folder, commitment.expect("episodes").expect("it was not stopped"))
    }

    /// The derivation must not change: an organizer may open a split years later.
    #[test]
    fn seeds_follow_from_the_secret_alone() {
        let split = split('0');
        assert_eq!(split.name(), "sealed-92f4e7f3");
        let obstacle: TaskId = "obstacle".parse().expect("a task");
        // Computed with Python's `hmac` and `hashlib`.
        let seeds = [0, 1].map(|k| split.seed(obstacle, k));
        assert_eq!(seeds, [6_501_053_554_782_317, 7_645_185_919_311_213]);
    }

    #[test]
    fn seeds_are_unique() {
        let split = SealedSplit { n_episodes: 500, ..split('1') };
        let seeds: BTreeSet<u64> = TaskId::paper()
            .flat_map(|t| (0..500).map(move |k| (t, k)))
            .map(|(t, k)| split.seed(t, k))
            .collect();
        assert_eq!(seeds.len(), split.n_total());
        assert!(seeds.iter().all(|seed| SeedRange::SEALED.seeds().contains(seed)));
    }

    #[test]
    fn the_same_secret_opens_a_commitment_and_no_other_does() {
        let (folder, commitment) = write(&split('2'));
        let read = Commitment::parse(commitment.to_json().as_bytes()).expect("its own format");
        assert_eq!(read, commitment);
        let opened = read.split(split('2').secret).expect("the committed secret");
        let (other_folder, again) = write(&opened);
        let mut episodes: Vec<Episode> = opened
            .tasks
            .iter()
            .flat_map(|task| [0, 1].map(|k| opened.episode(*task, k).expect("an episode")))
            .collect();
        episodes.reverse();
        read.check_played(&episodes).expect("the same episodes in another order");
        episodes.pop();
        assert!(matches!(read.check_played(&episodes), Err(ArenaError::OtherEpisodes { .. })));
        read.check_content(&again).expect("the same episodes");
        for task in TaskId::paper() {
            let name = format!("{task}-001.json");
            let bytes = [&folder, &other_folder].map(|f| std::fs::read(f.path().join(&name)));
            let [a, b] = bytes.map(|bytes| bytes.expect("the file"));
            assert!(a == b, "{name} differs");
            let episode = Episode::parse(&a, &name).expect("a valid episode");
            assert_eq!(episode.id(), format!("{task}/{}/001", opened.name()));
        }
        assert!(matches!(read.split(split('3').secret), Err(ArenaError::OtherSecret { .. })));
        let (_, other) = write(&split('3'));
        assert!(matches!(read.check_content(&other), Err(ArenaError::OtherEpisodes { .. })));
    }

    fn partners_of(split: &SealedSplit) -> PartnerSuite {
        split.partners().expect("the split has partners")
    }

    #[test]
    fn partners_follow_from_the_secret_alone() {
        let split = |digit| SealedSplit { n_episodes: 1, ..split(digit) }.with_partners(5);
        // Computed with Python's `hmac` and `hashlib`. The derivation must not change.
        let seeds = [0, 1].map(|k| split('0').derive(&format!("partner/{k}")));
        assert_eq!(seeds, [18_257_468_226_817_487_265, 17_273_243_677_269_565_876]);
        let partners = split('0').partners().expect("five partners");
        assert_eq!(partners.partners().len(), 5);
        assert_eq!(split('0').partners(), Some(partners.clone()));
        assert_ne!(split('1').partners(), Some(partners));

        let tasks: Vec<TaskId> = TaskId::paper().take(1).collect();
        let (_, committed) = write(&SealedSplit { tasks: tasks.clone(), ..split('2') });
        let read = Commitment::parse(committed.to_json().as_bytes()).expect("its own format");
        let (_, opened) = write(&read.split(split('2').secret).expect("the committed secret"));
        read.check_content(&opened).expect("the same partners");
        let (_, fewer) = write(&SealedSplit { tasks, ..split('2').with_partners(4) });
        assert!(matches!(read.check_content(&fewer), Err(ArenaError::OtherPartners { .. })));
        read.check_played_partners(&partners_of(&split('2'))).expect("the committed partners");
        let problem = |commitment: &Commitment, played: &PartnerSuite| {
            commitment.check_played_partners(played).expect_err("other partners").to_string()
        };
        for other in [partners_of(&split('3')), PartnerSuite::bundled()] {
            let problem = problem(&read, &other);
            assert!(problem.contains("but the commitment has 5 partners (SHA-256 "), "{problem}");
        }
        let without = Commitment { partners: None, ..read.clone() };
        without.check_played_partners(&PartnerSuite::bundled()).expect("the public suite");
        let problem = problem(&without, &partners_of(&split('2')));
        assert!(problem.contains("but the commitment has none"), "{problem}");
        let forged = committed.to_json().replace("\"n\": 5", "\"n\": 101");
        assert!(matches!(Commitment::parse(forged.as_bytes()), Err(ArenaError::Format(_))));
    }

    #[test]
    fn damaged_commitments_are_refused() {
        let (_, commitment) = write(&SealedSplit { n_episodes: 1, ..split('4') });
        let text = commitment.to_json();
        let damaged = [
            "{".to_owned(),
            text[..text.len() / 2].to_owned(),
            text.replace(FORMAT, "chaic-episode"),
            text.replace("\"version\": 1", "\"version\": 2"),
            text.replace("\"n_episodes\": 1", "\"n_episodes\": 10001"),
            text.replace("obstacle", "shopping"),
        ];
        for text in damaged {
            let result = Commitment::parse(text.as_bytes());
            assert!(matches!(result, Err(ArenaError::Format(_))), "{text}");
        }
    }

    /// Measures of the difficulty of an episode.
    const MEASURES: [&str; 5] = [
        "number of objects",
        "area, square meters",
        "required objects",
        "goal places",
        "mean distance of wanted objects to the nearest goal place, meters",
    ];

    /// Returns the values of [`MEASURES`].
    fn measures(episode: &Episode) -> [f64; MEASURES.len()] {
        let setup = episode.setup();
        let point = |k: usize| {
            let position = setup.things[k].position;
            [f64::from(position.x), f64::from(position.z)]
        };
        let index = |id| setup.object_index(id).expect("goal places are objects");
        let places: Vec<[f64; 2]> = setup.goal_places.iter().map(|id| point(index(*id))).collect();
        let distance_m = |[ax, az]: [f64; 2], [bx, bz]: [f64; 2]| {
            ((ax - bx) * (ax - bx) + (az - bz) * (az - bz)).sqrt()
        };
        let to_goal_m = |k: usize| {
            places.iter().map(|place| distance_m(point(k), *place)).fold(f64::INFINITY, f64::min)
        };
        let is_wanted = |k: &usize| setup.goal.count(setup.things[*k].class) > 0;
        let distances_m: Vec<f64> =
            (0..setup.things.len()).filter(is_wanted).map(to_goal_m).collect();
        let size_m = setup.bounds.size();
        [
            setup.things.len() as f64,
            f64::from(size_m.x) * f64::from(size_m.y),
            f64::from(setup.goal.total()),
            places.len() as f64,
            distances_m.iter().sum::<f64>() / distances_m.len() as f64,
        ]
    }

    /// Returns the mean of a sample and the square of its standard error.
    fn mean_and_squared_error(sample: &[f64]) -> (f64, f64) {
        let n = sample.len() as f64;
        let mean = sample.iter().sum::<f64>() / n;
        let squares: f64 = sample.iter().map(|value| (value - mean) * (value - mean)).sum();
        (mean, squares / (n - 1.0) / n)
    }

    #[test]
    fn statistics_of_a_sealed_split_equal_the_standard_splits_within_stated_bounds() {
        /// Episodes of each task and split.
        const N: usize = 16;
        /// Largest difference of two means, in standard errors of the difference.
        const MAX_ERRORS: f64 = 4.0;
        /// Tolerance for rounding.
        const ROUNDING: f64 = 1e-3;
        let split = SealedSplit { n_episodes: N, ..split('6') };
        for task in TaskId::paper() {
            let sealed: Vec<[f64; MEASURES.len()]> =
                (0..N).map(|k| measures(&split.episode(task, k).expect("an episode"))).collect();
            let standard: Vec<[f64; MEASURES.len()]> = episodes(&Split::Standard, task)
                .take(N)
                .map(|episode| measures(&episode.expect("an episode")))
                .collect();
            assert_eq!(standard.len(), N);
            for (k, name) in MEASURES.into_iter().enumerate() {
                let [sealed, standard] = [&sealed, &standard].map(|episodes| {
                    let sample: Vec<f64> = episodes.iter().map(|values| values[k]).collect();
                    mean_and_squared_error(&sample)
                });
                let bound = MAX_ERRORS * (sealed.1 + standard.1).sqrt() + ROUNDING;
                let difference = (sealed.0 - standard.0).abs();
                assert!(
                    difference <= bound,
                    "{task}, {name}: {} sealed, {} standard; they differ by more than {bound}",
                    sealed.0,
                    standard.0
                );
            }
        }
    }

    #[test]
    fn a_stopped_split_has_no_commitment() {
        let folder = tempfile::tempdir().expect("a folder");
        let written = split('5').write(folder.path(), &AtomicBool::new(true), &mut || ());
        assert!(written.expect("a folder").is_none());
    }
}
