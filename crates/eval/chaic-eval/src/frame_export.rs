//! Images of one frame: an agent's view as files.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;
use std::path::Path;

use chaic_core::{AgentId, ClassId, EntityId, Frame};
use chaic_env::helper_registry::{self, HelperRegistry};
use chaic_env::rules::RuleSet;
use chaic_env::{Env, EnvError, EpisodeConfig};
use chaic_episodes::Episode;
use chaic_files::{create_folders, write_atomically};
use chaic_render::{Appearance, Channels, Scene, View, floor_plan, image_out};
use chaic_world::{Rules, World};
use image::{DynamicImage, ImageError, ImageFormat};

use crate::error::{EvalError, Result};

/// Minimum size of the floor plan, pixels; a smaller one is illegible.
const PLAN_MIN_PX: u32 = 960;

/// Episode, frame and agent of an export.
#[derive(Clone, Copy, Debug)]
pub struct FrameExport<'a> {
    /// The episode.
    pub episode: &'a Episode,
    /// Name of the helper.
    pub helper: &'a str,
    /// Index of the seed.
    pub seed: u32,
    /// Rules of the episode.
    pub rules: RuleSet,
    /// Agent whose view is rendered.
    pub agent: AgentId,
    /// Frame to export; if no agent decides in this frame, the next one in which an agent decides.
    pub frame: Frame,
    /// Side of the images, pixels.
    pub size: u32,
    /// Light and colors of the scene.
    pub appearance: Appearance,
}

/// Plays an episode up to a frame and writes its images into `out`; returns the exported frame.
///
/// The files are `rgb.png`, `depth.png` (16 bit, millimeters), `ids.png` (16 bit), `ids.json` (id
/// to class), `classes.png` (8 bit, see [`chaic_render::Labels`]), `classes.json` (index to class),
/// `normals.png` (in world space, see [`image_out::normals_view`]) and `plan.png` (floor plan).
///
/// # Errors
/// If the agent or helper does not exist, or a file can't be written.
pub fn write(export: &FrameExport<'_>, helpers: &dyn HelperRegistry, out: &Path) -> Result<Frame> {
    let FrameExport { episode, helper, seed, rules, agent, frame, size, appearance } = *export;
    let config = EpisodeConfig { seed, rules, appearance, ..EpisodeConfig::new(episode, helper) };
    let mut env = Env::new(config, helper_registry::find(helpers, helper, rules.planner)?)?;
    if agent.index() >= env.world().setup().people.len() {
        let text = format!("{} has no {agent} when the helper is {helper}", episode.id());
        return Err(EvalError::Options(text));
    }
    env.advance(Some(frame))?;
    let world = env.world();
    let view = View::from_agent(world, agent, size, Channels::ALL);
    let images = env.renderer().scene().render(world, &[view]).pop().unwrap_or_default();
    create_folders(out)?;
    let invalid_size = || EvalError::Image(format!("{size} is not a valid image size"));
    let rgb = images.rgb.as_deref().and_then(|b| image_out::rgb(b, size, size));
    save(rgb.ok_or_else(invalid_size)?.into(), &out.join("rgb.png"))?;
    let depth = images.depth_m.as_deref().and_then(|b| image_out::depth_mm(b, size, size));
    save(depth.ok_or_else(invalid_size)?.into(), &out.join("depth.png"))?;
    let ids = images.ids.unwrap_or_default();
    let present: BTreeSet<u16> = ids.iter().copied().collect();
    let image = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(size, size, ids);
    save(image.ok_or_else(invalid_size)?.into(), &out.join("ids.png"))?;
    let classes = world.classes();
    let names: BTreeMap<u16, &str> =
        present.into_iter().map(|id| (id, EntityId(id).class_name(&classes))).collect();
    save_names(&names, &out.join("ids.json"))?;
    let labels = env.renderer().scene().label(world, &view);
    let present: BTreeSet<u8> = labels.classes.iter().copied().collect();
    let classes = ClassId::all().map(|class| (class.index() as u16, class.name()));
    let names = classes.filter(|(k, _)| present.contains(&(*k as u8))).collect();
    save_names(&names, &out.join("classes.json"))?;
    let image = image::GrayImage::from_raw(size, size, labels.classes);
    save(image.ok_or_else(invalid_size)?.into(), &out.join("classes.png"))?;
    let normals = image_out::normals_view(&labels.normals, size, size);
    save(normals.ok_or_else(invalid_size)?.into(), &out.join("normals.png"))?;
    let plan = floor_plan::draw_scene_plan(env.renderer().scene(), world, size.max(PLAN_MIN_PX));
    save(plan.into(), &out.join("plan.png"))?;
    Ok(world.state().frame)
}

/// Draws the floor plan of an episode's start.
///
/// # Errors
/// If the setup is invalid, or the file can't be written.
pub fn write_plan(episode: &Episode, width_px: u32, path: &Path) -> Result<()> {
    let convert = |problem| EnvError::Setup { id: episode.id().to_owned(), problem };
    let world = World::new(episode.setup().clone(), Rules::paper()).map_err(convert)?;
    let scene = Scene::new(episode.setup());
    save(floor_plan::draw_scene_plan(&scene, &world, width_px).into(), path)
}

fn save_names(names: &BTreeMap<u16, &str>, path: &Path) -> Result<()> {
    let json = serde_json::to_string_pretty(names).expect("numbers and names") + "\n";
    Ok(write_atomically(path, json.as_bytes())?)
}

/// Writes an image atomically; the extension selects the format.
///
/// # Errors
/// If the image can't be encoded, or the file can't be written.
pub fn save(image: DynamicImage, path: &Path) -> Result<()> {
    let convert = |e: ImageError| EvalError::Image(format!("can't write {}: {e}", path.display()));
    let mut bytes = Cursor::new(Vec::new());
    let format = ImageFormat::from_path(path).map_err(convert)?;
    image.write_to(&mut bytes, format).map_err(convert)?;
    Ok(write_atomically(path, bytes.get_ref())?)
}
