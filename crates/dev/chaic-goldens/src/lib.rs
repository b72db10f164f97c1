//! Reference results that every machine must reproduce bit by bit.
//!
//! **What it is**: a scripted run of each task ([`script`]), and a [`table`] with size and digest
//! of world states during the run, and of the helper's first and last image.
//!
//! **What it is not**: a benchmark or an agent; the script reads the state of the world.
//!
//! **Invariants**
//! - The table depends on the version of the program only.
//! - It uses no files, clock, threads or C code, so that it builds for all of Rust's targets.

pub mod script;

use std::fmt::Write as _;

use chaic_core::observation::Images;
use chaic_core::{AgentId, TaskId};
use chaic_episodes::{Split, SplitError, episodes};
use chaic_render::{Channels, Scene, View};
use chaic_world::{Rules, SetupError, World};
use xxhash_rust::xxh3::xxh3_64;

use crate::script::Script;

/// The committed table.
pub const GOLDENS: &str = include_str!("../goldens.txt");
/// Frames at which states are compared: early frames locate the start of a difference. Moving house
/// ends before the last frame.
const FRAMES: [u32; 3] = [100, 300, 2900];
/// Side of images, pixels; odd, so that rows end within a block of the widest vectors.
const SIDE_PX: u32 = 203;

/// Error when the table is computed.
#[derive(Debug, thiserror::Error)]
pub enum GoldenError {
    /// A task has no test episode.
    #[error("{0} has no test episode")]
    NoEpisode(TaskId),
    /// The bundled episodes cannot be read.
    #[error(transparent)]
    Split(#[from] SplitError),
    /// An episode is not a valid world.
    #[error("{0} cannot be played: {1}")]
    Setup(String, SetupError),
}

/// Computes the table: for each task a line for each frame of `FRAMES` and for two images.
///
/// # Errors
/// If a task's first test episode cannot be played.
pub fn table() -> Result<String, GoldenError> {
    let mut table = String::new();
    for task in TaskId::paper() {
        let episode = episodes(&Split::Test, task).next();
        let episode = episode.ok_or(GoldenError::NoEpisode(task))??;
        let id = episode.id().to_owned();
        let mut world = World::new(episode.into_setup(), Rules::paper())
            .map_err(|problem| GoldenError::Setup(id, problem))?;
        let mut script = Script::new(&world);
        let scene = Scene::new(world.setup());
        for frame in [0].into_iter().chain(FRAMES) {
            script.play(&mut world, frame);
            if frame > 0 {
                let bytes = world.snapshot().0;
                let (size, digest) = (bytes.len(), xxh3_64(&bytes));
                let _ = writeln!(table, "{task} frame {frame}: {size} bytes {digest:016x}");
            }
            if frame == 0 || frame == FRAMES[FRAMES.len() - 1] {
                let _ = writeln!(table, "{task} frame {frame}: {}", image(&scene, &world));
            }
        }
        let _ = writeln!(table, "{task} did: {}", script.counts_text());
    }
    Ok(table)
}

/// Returns digests of the helper's image.
fn image(scene: &Scene, world: &World) -> String {
    let camera = world.camera(AgentId::HELPER, SIDE_PX);
    let view = View::from_eye(AgentId::HELPER, camera, Channels::ALL);
    let images = scene.render(world, &[view]).into_iter().next().unwrap_or_default();
    let Images { rgb, depth_m, ids } = images;
    let depth: Vec<u8> = depth_m.iter().flatten().flat_map(|d| d.to_bits().to_le_bytes()).collect();
    let ids: Vec<u8> = ids.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
    let [rgb, depth, ids] = [&rgb.unwrap_or_default(), &depth, &ids].map(|b| xxh3_64(b));
    format!("{SIDE_PX} px rgb {rgb:016x} depth {depth:016x} ids {ids:016x}")
}

/// Returns the first pair of lines in which two tables differ.
pub fn first_difference<'a>(found: &'a str, expected: &'a str) -> Option<[&'a str; 2]> {
    let (mut a, mut b) = (found.lines(), expected.lines());
    loop {
        match (a.next(), b.next()) {
            (None, None) => return None,
            (x, y) if x == y => {}
            (x, y) => return Some([x.unwrap_or("(ends)"), y.unwrap_or("(ends)")]),
        }
    }
}
