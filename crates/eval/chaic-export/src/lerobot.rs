//! Export to version 3 of the LeRobot data set format: a table of frames and a video per episode,
//! and tables of episodes and tasks.

mod description;

use std::path::{Path, PathBuf};

use chaic_core::geom::math;
use chaic_core::{Action, AgentId, EntityId, Frame, Hand, ResolvedAction};
use chaic_env::Playback;
use chaic_env::trace::{Decision, Header, Trace};
use chaic_episodes::Episode;
use chaic_files::{create_folders, write_atomically};
use chaic_render::{Channels, Scene, View};
use chaic_video::VideoWriter;
use chaic_world::World;
use image::RgbImage;
use serde_json::{Value, json};

use crate::card::Creator;
use crate::error::ExportError;
use crate::folder::{NewFolder, write_description};
use crate::table::{self, Column};
use description::People;

/// Frames per second of the export, as in replays: 30 frames are one second of walking.
pub const FRAMES_PER_S: u32 = 30;
/// Key of the video in tables.
const VIDEO_KEY: &str = "observation.images.ego";
/// Number of files in a folder of data or videos.
const CHUNK: usize = 1000;

/// Components of the state vector.
pub const STATE: [&str; 9] = [
    "x_m",
    "z_m",
    "heading_sin",
    "heading_cos",
    "left_hand_class",
    "right_hand_class",
    "n_in_left",
    "n_in_right",
    "time",
];

/// Components of the action vector.
pub const ACTION: [&str; 3] = ["kind", "hand", "class"];

/// Names of action kinds, indexed by the first component of the action vector.
pub const KINDS: [&str; 8] = [
    "move_forward",
    "turn_left",
    "turn_right",
    "pick_up",
    "put_in",
    "put_on",
    "remove_obstacle",
    "wait",
];

/// Options of the export.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LeRobotOptions {
    /// Agent whose observations and actions are exported.
    pub agent: AgentId,
    /// Sampling interval in frames, a divisor of [`FRAMES_PER_S`].
    pub every: u32,
    /// Side of images, pixels.
    pub image_size: u32,
}

impl LeRobotOptions {
    /// Checks the options.
    ///
    /// # Errors
    /// [`ExportError::Rate`] or [`ExportError::Size`].
    pub fn check(&self) -> Result<(), ExportError> {
        let LeRobotOptions { every, image_size, .. } = *self;
        if every == 0 || !FRAMES_PER_S.is_multiple_of(every) {
            return Err(ExportError::Rate { every, frames_per_s: FRAMES_PER_S });
        }
        // Videos have whole blocks of two by two pixels.
        if image_size.is_multiple_of(2) { Ok(()) } else { Err(ExportError::Size(image_size)) }
    }
}

/// Writer of a data set, which is removed if it is not finished.
pub struct LeRobotWriter {
    folder: NewFolder,
    options: LeRobotOptions,
    creators: Vec<Creator>,
    tasks: Vec<String>,
    episodes: Vec<EpisodeEntry>,
    n_frames: usize,
    statistics: [ColumnStatistics; 5],
    colors: [ColumnStatistics; 3],
}

/// Index entry of an exported episode.
struct EpisodeEntry {
    task: usize,
    first: usize,
    n_frames: usize,
    people: People,
}

/// Running minimum, maximum, sum and sum of squares of each column of a feature.
#[derive(Clone, Debug, Default)]
struct ColumnStatistics {
    n: f64,
    columns: Vec<[f64; 4]>,
}

impl ColumnStatistics {
    fn add(&mut self, row: &[f64]) {
        if self.columns.is_empty() {
            self.columns = vec![[f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0]; row.len()];
        }
        self.n += 1.0;
        for ([min, max, sum, squares], x) in self.columns.iter_mut().zip(row) {
            (*min, *max) = (min.min(*x), max.max(*x));
            (*sum, *squares) = (*sum + x, *squares + x * x);
        }
    }

    fn min_max_mean_std(&self) -> [Vec<f64>; 4] {
        let mean = |c: &[f64; 4]| c[2] / self.n.max(1.0);
        let std = |c: &[f64; 4]| (c[3] / self.n.max(1.0) - mean(c) * mean(c)).max(0.0).sqrt();
        let per_column = |f: &dyn Fn(&[f64; 4]) -> f64| self.columns.iter().map(f).collect();
        [per_column(&|c| c[0]), per_column(&|c| c[1]), per_column(&mean), per_column(&std)]
    }
}

/// Numeric features, in the order of the statistics.
const NUMERIC_FEATURES: [&str; 5] =
    ["observation.state", "action", "next.reward", "timestamp", "frame_index"];

/// One sampled frame.
struct SampledFrame {
    state: [f32; STATE.len()],
    action: [f32; ACTION.len()],
    plan: String,
    done: f64,
}

impl LeRobotWriter {
    /// Creates a data set in an empty folder.
    ///
    /// # Errors
    /// If the folder is not empty or cannot be created, or the options are invalid.
    pub fn create(folder: &Path, options: LeRobotOptions) -> Result<LeRobotWriter, ExportError> {
        options.check()?;
        Ok(LeRobotWriter {
            folder: NewFolder::create(folder)?,
            options,
            creators: Vec::new(),
            tasks: Vec::new(),
            episodes: Vec::new(),
            n_frames: 0,
            statistics: Default::default(),
            colors: Default::default(),
        })
    }

    /// States who created the data set. Without a statement, card and metadata name no creator: chaic does
    /// not know who played or collected the episodes.
    pub fn with_creators(self, creators: Vec<Creator>) -> LeRobotWriter {
        LeRobotWriter { creators, ..self }
    }

    /// Returns the number of images per second.
    fn fps(&self) -> u32 {
        FRAMES_PER_S / self.options.every
    }

    /// Returns the path of an episode's file, and creates its folders.
    fn file(&self, kind: &str, episode: usize, extension: &str) -> Result<PathBuf, ExportError> {
        let (chunk, file) = (episode / CHUNK, episode % CHUNK);
        let folder = self.folder.path().join(kind).join(format!("chunk-{chunk:03}"));
        create_folders(&folder)?;
        Ok(folder.join(format!("file-{file:03}.{extension}")))
    }

    /// Adds an episode. `should_continue` is called before each image; if it returns false, the
    /// episode is discarded and the result is `false`.
    ///
    /// # Errors
    /// If the trace does not match the episode, the episode has no such agent, or a file cannot be
    /// written.
    pub fn add(
        &mut self,
        trace: &Trace,
        episode: &Episode,
        should_continue: &mut dyn FnMut() -> bool,
    ) -> Result<bool, ExportError> {
        let LeRobotOptions { agent, every, image_size } = self.options;
        let index = self.episodes.len();
        let video_path = self.file(&format!("videos/{VIDEO_KEY}"), index, "mp4")?;
        let mut video = VideoWriter::create(&video_path, image_size, image_size, self.fps())?;
        let mut playback = Playback::new(trace, episode)?;
        if agent.index() >= playback.world().setup().people.len() {
            return Err(ExportError::NoAgent(trace.header.episode.clone(), agent));
        }
        let setup = playback.world().setup();
        let scene = Scene::with_appearance(setup, trace.header.appearance);
        let decisions: Vec<&Decision> = trace.decisions().filter(|d| d.agent == agent).collect();
        let end = trace.end().map_or(Frame::MAX, |end| end.frame);
        let mut samples = Vec::new();
        // The images of a discarded episode do not count.
        let mut colors = self.colors.clone();
        loop {
            let frame = playback.world().state().frame;
            // No action follows the last frame.
            let is_sampled = frame.is_multiple_of(every) && frame < end;
            if is_sampled {
                if !should_continue() {
                    drop(video);
                    return Ok(false);
                }
                let image = render_view(&scene, playback.world(), agent, image_size);
                add_colors(&mut colors, &image);
                video.push(&image)?;
            }
            let world = playback.world();
            let state = is_sampled.then(|| (encode_state(world, agent), fraction_done(world)));
            let has_more = playback.step()?.is_some();
            if let Some((state, done)) = state {
                let current = decisions.iter().rev().find(|d| d.frame <= frame);
                let action = current.map(|d| d.action);
                let plan = playback.thoughts().get(agent.index()).map(|t| t.plan.clone());
                let action = encode_action(playback.world(), action);
                samples.push(SampledFrame { state, action, plan: plan.unwrap_or_default(), done });
            }
            if !has_more {
                break;
            }
        }
        video.finish()?;
        self.colors = colors;
        let done = fraction_done(playback.world());
        self.write_episode(&trace.header, &samples, done)?;
        Ok(true)
    }

    fn write_episode(
        &mut self,
        header: &Header,
        samples: &[SampledFrame],
        done: f64,
    ) -> Result<(), ExportError> {
        let task = header.task.info().title.to_lowercase();
        let known = self.tasks.iter().position(|t| *t == task);
        let task_index = known.unwrap_or_else(|| {
            self.tasks.push(task);
            self.tasks.len() - 1
        });
        let (index, first, n) = (self.episodes.len(), self.n_frames, samples.len());
        let fps = f64::from(self.fps());
        let next_done = samples.iter().skip(1).map(|s| s.done).chain([done]);
        let rewards: Vec<f32> =
            samples.iter().zip(next_done).map(|(s, next)| (next - s.done) as f32).collect();
        for (k, (sample, reward)) in samples.iter().zip(&rewards).enumerate() {
            let to_f64 = |row: &[f32]| row.iter().map(|x| f64::from(*x)).collect::<Vec<f64>>();
            self.statistics[0].add(&to_f64(&sample.state));
            self.statistics[1].add(&to_f64(&sample.action));
            self.statistics[2].add(&[f64::from(*reward)]);
            self.statistics[3].add(&[k as f64 / fps]);
            self.statistics[4].add(&[k as f64]);
        }
        let rows = |width: usize, vector: &dyn Fn(&SampledFrame) -> Vec<f32>| Column::F32Rows {
            width,
            elements: samples.iter().flat_map(vector).collect(),
        };
        let each = |value: &dyn Fn(usize) -> i64| Column::I64((0..n).map(value).collect());
        let columns = [
            ("observation.state", rows(STATE.len(), &|s| s.state.to_vec())),
            ("action", rows(ACTION.len(), &|s| s.action.to_vec())),
            ("plan", Column::Text(samples.iter().map(|s| s.plan.clone()).collect())),
            ("next.reward", Column::F32(rewards)),
            ("next.done", Column::Bool((0..n).map(|k| k + 1 == n).collect())),
            ("timestamp", Column::F32((0..n).map(|k| (k as f64 / fps) as f32).collect())),
            ("frame_index", each(&|k| k as i64)),
            ("episode_index", each(&|_| index as i64)),
            ("index", each(&|k| (first + k) as i64)),
            ("task_index", each(&|_| task_index as i64)),
        ];
        let path = self.file("data", index, "parquet")?;
        write_table(&path, &columns, &[])?;
        let people = People::of(header);
        self.episodes.push(EpisodeEntry { task: task_index, first, n_frames: n, people });
        self.n_frames += n;
        Ok(())
    }

    /// Writes the metadata of all episodes so far; returns the number of frames.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn finish(self) -> Result<usize, ExportError> {
        let meta = self.folder.path().join("meta");
        create_folders(&meta)?;
        // Readers use the names of tasks as the table's index.
        let pandas = json!({
            "index_columns": ["task"],
            "column_indexes": [],
            "columns": [
                {"name": "task_index", "field_name": "task_index", "pandas_type": "int64",
                 "numpy_type": "int64", "metadata": null},
                {"name": "task", "field_name": "task", "pandas_type": "unicode",
                 "numpy_type": "object", "metadata": null},
            ],
            "creator": {"library": "chaic", "version": env!("CARGO_PKG_VERSION")},
        });
        let tasks = [
            ("task_index", Column::I64((0..self.tasks.len() as i64).collect())),
            ("task", Column::Text(self.tasks.clone())),
        ];
        write_table(&meta.join("tasks.parquet"), &tasks, &[("pandas", pandas.to_string())])?;
        self.write_episodes()?;
        let json = |name: &str, value: &Value| {
            let text =
                serde_json::to_string_pretty(value).expect("the value has string keys") + "\n";
            write_atomically(&meta.join(name), text.as_bytes())
        };
        json("stats.json", &self.stats())?;
        write_description(self.folder.path(), "chaic-lerobot", &self.description())?;
        // The last file: after a crash, a folder without it is no data set.
        json("info.json", &self.info())?;
        self.folder.finish();
        Ok(self.n_frames)
    }

    fn write_episodes(&self) -> Result<(), ExportError> {
        let fps = f64::from(self.fps());
        let n = self.episodes.len();
        let each = |value: &dyn Fn(usize, &EpisodeEntry) -> i64| {
            Column::I64(self.episodes.iter().enumerate().map(|(k, e)| value(k, e)).collect())
        };
        let seconds = |value: &dyn Fn(&EpisodeEntry) -> f64| {
            Column::F32(self.episodes.iter().map(|e| value(e) as f32).collect())
        };
        let task = |e: &EpisodeEntry| vec![self.tasks[e.task].clone()];
        let name = |column: &str| format!("videos/{VIDEO_KEY}/{column}");
        let [chunk, file, from, to] =
            ["chunk_index", "file_index", "from_timestamp", "to_timestamp"].map(name);
        let columns = [
            ("episode_index", each(&|k, _| k as i64)),
            ("tasks", Column::TextRows(self.episodes.iter().map(task).collect())),
            ("length", each(&|_, e| e.n_frames as i64)),
            ("data/chunk_index", each(&|k, _| (k / CHUNK) as i64)),
            ("data/file_index", each(&|k, _| (k % CHUNK) as i64)),
            ("dataset_from_index", each(&|_, e| e.first as i64)),
            ("dataset_to_index", each(&|_, e| (e.first + e.n_frames) as i64)),
            (&chunk, each(&|k, _| (k / CHUNK) as i64)),
            (&file, each(&|k, _| (k % CHUNK) as i64)),
            (&from, seconds(&|_| 0.0)),
            (&to, seconds(&|e| e.n_frames as f64 / fps)),
            ("meta/episodes/chunk_index", Column::I64(vec![0; n])),
            ("meta/episodes/file_index", Column::I64(vec![0; n])),
        ];
        let path = self.file("meta/episodes", 0, "parquet")?;
        write_table(&path, &columns, &[])
    }

    fn stats(&self) -> Value {
        let to_json = |summary: &ColumnStatistics| {
            let [min, max, mean, std] = summary.min_max_mean_std();
            json!({"min": min, "max": max, "mean": mean, "std": std, "count": [summary.n]})
        };
        let named = NUMERIC_FEATURES
            .iter()
            .zip(&self.statistics)
            .map(|(name, s)| ((*name).to_owned(), to_json(s)));
        let mut stats: serde_json::Map<String, Value> = named.collect();
        let statistic = |k: usize| {
            let channels = self.colors.iter().map(|s| json!([s.min_max_mean_std()[k]]));
            Value::Array(channels.collect())
        };
        let [min, max, mean, std] = [0, 1, 2, 3].map(statistic);
        let count = [self.colors[0].n];
        let video_stats = json!({"min": min, "max": max, "mean": mean, "std": std, "count": count});
        stats.insert(VIDEO_KEY.to_owned(), video_stats);
        Value::Object(stats)
    }

    fn info(&self) -> Value {
        let (size, fps) = (self.options.image_size, self.fps());
        let number = |dtype: &str| json!({"dtype": dtype, "shape": [1], "names": null});
        json!({
            "codebase_version": "v3.0",
            "robot_type": "chaic",
            "total_episodes": self.episodes.len(),
            "total_frames": self.n_frames,
            "total_tasks": self.tasks.len(),
            "chunks_size": CHUNK,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 500,
            "fps": fps,
            "splits": {"train": format!("0:{}", self.episodes.len())},
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
            "video_path": "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4",
            "features": {
                (VIDEO_KEY): {
                    "dtype": "video",
                    "shape": [size, size, 3],
                    "names": ["height", "width", "channels"],
                    "info": {
                        "video.height": size,
                        "video.width": size,
                        "video.codec": "h264",
                        "video.pix_fmt": "yuv420p",
                        "video.is_depth_map": false,
                        "video.fps": fps,
                        "video.channels": 3,
                        "has_audio": false,
                    },
                },
                "observation.state": {"dtype": "float32", "shape": [STATE.len()], "names": STATE},
                "action": {"dtype": "float32", "shape": [ACTION.len()], "names": ACTION},
                "plan": number("string"),
                "next.reward": number("float32"),
                "next.done": number("bool"),
                "timestamp": number("float32"),
                "frame_index": number("int64"),
                "episode_index": number("int64"),
                "index": number("int64"),
                "task_index": number("int64"),
            },
        })
    }
}

fn write_table(
    path: &Path,
    columns: &[(&str, Column)],
    entries: &[(&str, String)],
) -> Result<(), ExportError> {
    let convert = |problem| ExportError::Table { path: path.to_owned(), problem };
    table::write(path, columns, entries).map_err(convert)
}

/// Adds an image to the color statistics: every fourth pixel of every fourth row.
fn add_colors(colors: &mut [ColumnStatistics; 3], image: &RgbImage) {
    for (x, y, pixel) in image.enumerate_pixels() {
        if x % 4 == 0 && y % 4 == 0 {
            for (summary, value) in colors.iter_mut().zip(pixel.0) {
                summary.add(&[f64::from(value) / 255.0]);
            }
        }
    }
}

/// Renders the view of an agent.
fn render_view(scene: &Scene, world: &World, agent: AgentId, size: u32) -> RgbImage {
    let view = View::from_agent(world, agent, size, Channels::RGB);
    let rgb = scene.render(world, &[view]).pop().and_then(|images| images.rgb);
    let rgb = rgb.expect("color was requested");
    RgbImage::from_raw(size, size, rgb).expect("as many pixels as were requested")
}

/// Returns the index of an object's class in the catalogue; -1 for none.
fn class_index(world: &World, entity: Option<EntityId>) -> f32 {
    let setup = world.setup();
    let index = entity.and_then(|entity| setup.object_index(entity));
    index.map_or(-1.0, |k| setup.things[k].class.index() as f32)
}

fn encode_state(world: &World, agent: AgentId) -> [f32; STATE.len()] {
    let (setup, state) = (world.setup(), world.state());
    let person = &state.agents[agent.index()];
    let [left, right] = person.hands;
    let n_in = |held: Option<EntityId>| {
        let inside = state.objects.iter().filter(|object| match object.location {
            chaic_world::ObjectLocation::Inside { container, .. } => Some(container) == held,
            _ => false,
        });
        inside.count() as f32
    };
    let yaw_rad = person.pose.yaw_rad;
    let time = state.frame as f32 / setup.horizon.max(1) as f32;
    let at = person.pose.position;
    [
        at.x,
        at.z,
        math::sin(yaw_rad),
        math::cos(yaw_rad),
        class_index(world, left),
        class_index(world, right),
        n_in(left),
        n_in(right),
        time,
    ]
}

/// Encodes an action: its kind, the hand (0 left, 1 right, -1 none) and the class of its object.
fn encode_action(world: &World, action: Option<ResolvedAction>) -> [f32; ACTION.len()] {
    let Some(action) = action else { return [7.0, -1.0, -1.0] };
    let (kind, hand) = match action {
        Action::MoveForward => (0.0, None),
        Action::TurnLeft => (1.0, None),
        Action::TurnRight => (2.0, None),
        Action::PickUp { hand, .. } => (3.0, Some(hand)),
        Action::PutIn => (4.0, None),
        Action::PutOn { hand, .. } => (5.0, Some(hand)),
        Action::RemoveObstacle { hand, .. } => (6.0, Some(hand)),
        Action::Wait { .. } => (7.0, None),
    };
    let hand = hand.map_or(-1.0, |hand: Hand| hand.index() as f32);
    [kind, hand, class_index(world, action.subject())]
}

fn fraction_done(world: &World) -> f64 {
    let (done, total) = world.progress();
    if total > 0.0 { done / total } else { 0.0 }
}
