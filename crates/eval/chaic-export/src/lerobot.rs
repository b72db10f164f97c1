//! Version 3 of LeRobot's data sets: a table of frames and a film for each episode, and tables of episodes and tasks.

use std::fs;
use std::path::{Path, PathBuf};

use chaic_core::{Action, AgentId, EntityId, Frame, Hand, ResolvedAction};
use chaic_env::trace::{Decision, Trace};
use chaic_env::{EnvError, Playback};
use chaic_episodes::Episode;
use chaic_files::{FileError, write_whole};
use chaic_render::{Channels, Scene, View};
use chaic_video::{VideoError, VideoWriter};
use chaic_world::World;
use image::RgbImage;
use parquet::errors::ParquetError;
use serde_json::{Value, json};

use crate::table::{self, Column};

/// Frames of an episode that count as a second: the usual rate of replays. The world itself knows no seconds.
pub const FRAMES_PER_S: u32 = 30;
/// The name of the film in tables.
const FILM: &str = "observation.images.ego";
/// Files in a folder of data or films.
const CHUNK: usize = 1000;

/// What the numbers of a state are.
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

/// What the numbers of an action are.
pub const ACTION: [&str; 3] = ["kind", "hand", "class"];

/// What kinds of actions are called, by the first number of an action.
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

/// Why a data set can't be written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The trace doesn't fit its episode.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// The file system refuses.
    #[error(transparent)]
    File(#[from] FileError),
    /// A table can't be written.
    #[error("{path}: {problem}")]
    Table {
        /// Where.
        path: PathBuf,
        /// What is wrong.
        problem: ParquetError,
    },
    /// A film can't be written.
    #[error(transparent)]
    Film(#[from] VideoError),
    /// There is something already.
    #[error("{0} isn't empty; choose another --out")]
    NotEmpty(PathBuf),
    /// Frames don't make a whole number of pictures a second.
    #[error("every {0} frames is no whole number of times a second; {FRAMES_PER_S} frames are one")]
    Rate(u32),
    /// Nobody of this kind was there.
    #[error("{0} has no {1}")]
    Nobody(String, AgentId),
}

/// What is written of each episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LeRobotOptions {
    /// Whose eyes and actions.
    pub agent: AgentId,
    /// Every how many frames, a divisor of [`FRAMES_PER_S`].
    pub every: u32,
    /// Side of pictures, pixels.
    pub image_size: u32,
}

/// A data set that is being written.
pub struct LeRobotWriter {
    folder: PathBuf,
    options: LeRobotOptions,
    tasks: Vec<String>,
    episodes: Vec<Written>,
    n_frames: usize,
    numbers: [Summary; 5],
    colors: [Summary; 3],
}

/// An episode that was written.
struct Written {
    task: usize,
    first: usize,
    n_frames: usize,
}

/// The smallest, the largest, the mean and the spread of numbers, of each column of a feature.
#[derive(Clone, Debug, Default)]
struct Summary {
    n: f64,
    columns: Vec<[f64; 4]>,
}

impl Summary {
    fn add(&mut self, row: &[f64]) {
        if self.columns.is_empty() {
            self.columns = vec![[f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0]; row.len()];
        }
        self.n += 1.0;
        for ([least, most, sum, squares], x) in self.columns.iter_mut().zip(row) {
            (*least, *most) = (least.min(*x), most.max(*x));
            (*sum, *squares) = (*sum + x, *squares + x * x);
        }
    }

    fn figures(&self) -> [Vec<f64>; 4] {
        let mean = |c: &[f64; 4]| c[2] / self.n.max(1.0);
        let spread = |c: &[f64; 4]| (c[3] / self.n.max(1.0) - mean(c) * mean(c)).max(0.0).sqrt();
        let of = |f: &dyn Fn(&[f64; 4]) -> f64| self.columns.iter().map(f).collect();
        [of(&|c| c[0]), of(&|c| c[1]), of(&mean), of(&spread)]
    }
}

/// The features that have numbers, with how many.
const NUMBERS: [(&str, usize); 5] = [
    ("observation.state", STATE.len()),
    ("action", ACTION.len()),
    ("next.reward", 1),
    ("timestamp", 1),
    ("frame_index", 1),
];

/// One moment.
struct Moment {
    state: [f32; STATE.len()],
    action: [f32; ACTION.len()],
    plan: String,
    done: f64,
}

impl LeRobotWriter {
    /// A new one in an empty folder.
    ///
    /// # Errors
    /// If the folder isn't empty or can't be made, or the options make no whole rate.
    pub fn create(folder: &Path, options: LeRobotOptions) -> Result<LeRobotWriter, ExportError> {
        if options.every == 0 || !FRAMES_PER_S.is_multiple_of(options.every) {
            return Err(ExportError::Rate(options.every));
        }
        if fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) {
            return Err(ExportError::NotEmpty(folder.to_owned()));
        }
        fs::create_dir_all(folder).map_err(FileError::of("can't make", folder))?;
        Ok(LeRobotWriter {
            folder: folder.to_owned(),
            options,
            tasks: Vec::new(),
            episodes: Vec::new(),
            n_frames: 0,
            numbers: Default::default(),
            colors: Default::default(),
        })
    }

    /// Pictures a second.
    fn fps(&self) -> u32 {
        FRAMES_PER_S / self.options.every
    }

    /// A file of an episode, in folders that are there.
    fn file(&self, of: &str, episode: usize, extension: &str) -> Result<PathBuf, ExportError> {
        let (chunk, file) = (episode / CHUNK, episode % CHUNK);
        let folder = self.folder.join(of).join(format!("chunk-{chunk:03}"));
        fs::create_dir_all(&folder).map_err(FileError::of("can't make", &folder))?;
        Ok(folder.join(format!("file-{file:03}.{extension}")))
    }

    /// Adds an episode; `false` if `go_on`, which is asked at each picture, said no: then it is left away.
    ///
    /// # Errors
    /// If the trace doesn't fit the episode, nobody is there whose eyes one could see by, or a file can't be
    /// written.
    pub fn add(
        &mut self,
        trace: &Trace,
        episode: &Episode,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<bool, ExportError> {
        let LeRobotOptions { agent, every, image_size } = self.options;
        let index = self.episodes.len();
        let film = self.file(&format!("videos/{FILM}"), index, "mp4")?;
        let mut video = VideoWriter::create(&film, image_size, image_size, self.fps())?;
        let mut playback = Playback::new(trace, episode)?;
        if agent.index() >= playback.world().setup().people.len() {
            return Err(ExportError::Nobody(trace.header.episode.clone(), agent));
        }
        let setup = playback.world().setup();
        let scene = Scene::with_appearance(setup, trace.header.appearance);
        let decisions: Vec<&Decision> = trace.decisions().filter(|d| d.agent == agent).collect();
        let end = trace.end().map_or(Frame::MAX, |end| end.frame);
        let mut moments = Vec::new();
        loop {
            let frame = playback.world().state().frame;
            // Nothing is done any more in the last one.
            let is_wanted = frame.is_multiple_of(every) && frame < end;
            if is_wanted {
                if !go_on() {
                    drop(video);
                    return Ok(false);
                }
                let picture = look(&scene, playback.world(), agent, image_size);
                self.take_colors(&picture);
                video.push(&picture)?;
            }
            let world = playback.world();
            let state = is_wanted.then(|| (state_of(world, agent), share_done(world)));
            let has_more = playback.step()?.is_some();
            if let Some((state, done)) = state {
                let under_way = decisions.iter().rev().find(|d| d.frame <= frame);
                let action = under_way.map(|d| d.action);
                let plan = playback.thoughts().get(agent.index()).map(|t| t.plan.clone());
                let action = action_of(playback.world(), action);
                moments.push(Moment { state, action, plan: plan.unwrap_or_default(), done });
            }
            if !has_more {
                break;
            }
        }
        video.finish()?;
        let done = share_done(playback.world());
        self.write_episode(&trace.header.task.info().title.to_lowercase(), &moments, done)?;
        Ok(true)
    }

    /// Takes a picture into the summary of colors: every fourth pixel of every fourth row.
    fn take_colors(&mut self, picture: &RgbImage) {
        for (x, y, pixel) in picture.enumerate_pixels() {
            if x % 4 == 0 && y % 4 == 0 {
                for (summary, value) in self.colors.iter_mut().zip(pixel.0) {
                    summary.add(&[f64::from(value) / 255.0]);
                }
            }
        }
    }

    fn write_episode(
        &mut self,
        task: &str,
        moments: &[Moment],
        done: f64,
    ) -> Result<(), ExportError> {
        let known = self.tasks.iter().position(|t| t == task);
        let task_index = known.unwrap_or_else(|| {
            self.tasks.push(task.to_owned());
            self.tasks.len() - 1
        });
        let (index, first, n) = (self.episodes.len(), self.n_frames, moments.len());
        let fps = f64::from(self.fps());
        let afterwards = moments.iter().skip(1).map(|m| m.done).chain([done]);
        let rewards: Vec<f32> =
            moments.iter().zip(afterwards).map(|(m, after)| (after - m.done) as f32).collect();
        for (k, (moment, reward)) in moments.iter().zip(&rewards).enumerate() {
            let wide = |row: &[f32]| row.iter().map(|x| f64::from(*x)).collect::<Vec<f64>>();
            self.numbers[0].add(&wide(&moment.state));
            self.numbers[1].add(&wide(&moment.action));
            self.numbers[2].add(&[f64::from(*reward)]);
            self.numbers[3].add(&[k as f64 / fps]);
            self.numbers[4].add(&[k as f64]);
        }
        let rows = |width: usize, of: &dyn Fn(&Moment) -> Vec<f32>| Column::F32Rows {
            width,
            numbers: moments.iter().flat_map(of).collect(),
        };
        let each = |of: &dyn Fn(usize) -> i64| Column::I64((0..n).map(of).collect());
        let columns = [
            ("observation.state", rows(STATE.len(), &|m| m.state.to_vec())),
            ("action", rows(ACTION.len(), &|m| m.action.to_vec())),
            ("plan", Column::Text(moments.iter().map(|m| m.plan.clone()).collect())),
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
        self.episodes.push(Written { task: task_index, first, n_frames: n });
        self.n_frames += n;
        Ok(())
    }

    /// Writes what makes a data set of the episodes so far; how many frames it has.
    ///
    /// # Errors
    /// If a file can't be written.
    pub fn finish(self) -> Result<usize, ExportError> {
        let meta = self.folder.join("meta");
        fs::create_dir_all(&meta).map_err(FileError::of("can't make", &meta))?;
        // Readers take the names of tasks for the table's index.
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
            let text = serde_json::to_string_pretty(value).expect("plain data") + "\n";
            write_whole(&meta.join(name), text.as_bytes())
        };
        json("stats.json", &self.stats())?;
        json("info.json", &self.info())?;
        Ok(self.n_frames)
    }

    fn write_episodes(&self) -> Result<(), ExportError> {
        let fps = f64::from(self.fps());
        let n = self.episodes.len();
        let each = |of: &dyn Fn(usize, &Written) -> i64| {
            Column::I64(self.episodes.iter().enumerate().map(|(k, e)| of(k, e)).collect())
        };
        let seconds = |of: &dyn Fn(&Written) -> f64| {
            Column::F32(self.episodes.iter().map(|e| of(e) as f32).collect())
        };
        let task = |e: &Written| vec![self.tasks[e.task].clone()];
        let name = |what: &str| format!("videos/{FILM}/{what}");
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
        let of = |summary: &Summary| {
            let [min, max, mean, std] = summary.figures();
            json!({"min": min, "max": max, "mean": mean, "std": std, "count": [summary.n]})
        };
        let named =
            NUMBERS.iter().zip(&self.numbers).map(|((name, _), s)| ((*name).to_owned(), of(s)));
        let mut stats: serde_json::Map<String, Value> = named.collect();
        let figure = |k: usize| {
            let channels = self.colors.iter().map(|s| json!([s.figures()[k]]));
            Value::Array(channels.collect())
        };
        let [min, max, mean, std] = [0, 1, 2, 3].map(figure);
        let count = [self.colors[0].n];
        let of_film = json!({"min": min, "max": max, "mean": mean, "std": std, "count": count});
        stats.insert(FILM.to_owned(), of_film);
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
                (FILM): {
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
    let wrong = |problem| ExportError::Table { path: path.to_owned(), problem };
    table::write(path, columns, entries).map_err(wrong)
}

/// What an agent sees.
fn look(scene: &Scene, world: &World, agent: AgentId, size: u32) -> RgbImage {
    let view = View::of_agent(world, agent, size, Channels::RGB);
    let rgb = scene.render(world, &[view]).pop().and_then(|images| images.rgb);
    let rgb = rgb.expect("color was asked for");
    RgbImage::from_raw(size, size, rgb).expect("as many pixels as were asked for")
}

/// The number of the class of a thing, by the catalogue's order; -1 for none.
fn class_of(world: &World, entity: Option<EntityId>) -> f32 {
    let setup = world.setup();
    let index = entity.and_then(|it| setup.thing_index(it));
    index.map_or(-1.0, |k| setup.things[k].class.index() as f32)
}

fn state_of(world: &World, agent: AgentId) -> [f32; STATE.len()] {
    let (setup, state) = (world.setup(), world.state());
    let person = &state.people[agent.index()];
    let [left, right] = person.hands;
    let n_in = |held: Option<EntityId>| {
        let inside = state.things.iter().filter(|thing| match thing.place {
            chaic_world::Place::Inside { container, .. } => Some(container) == held,
            _ => false,
        });
        inside.count() as f32
    };
    let heading = chaic_core::geom::forward(person.pose.yaw_rad);
    let time = state.frame as f32 / setup.horizon.max(1) as f32;
    let at = person.pose.position;
    [
        at.x,
        at.z,
        heading.x,
        heading.z,
        class_of(world, left),
        class_of(world, right),
        n_in(left),
        n_in(right),
        time,
    ]
}

/// An action as numbers: its kind, the hand (0 left, 1 right, -1 none) and the class of what it is about.
fn action_of(world: &World, action: Option<ResolvedAction>) -> [f32; ACTION.len()] {
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
    [kind, hand, class_of(world, action.subject())]
}

fn share_done(world: &World) -> f64 {
    let (done, total) = world.progress();
    if total > 0.0 { done / total } else { 0.0 }
}
