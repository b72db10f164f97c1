//! Pictures of one moment: what an agent sees, as files for people and programs.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;
use std::path::Path;

use chaic_core::{AgentId, ClassId, EntityId, Frame};
use chaic_env::minds::{self, Helpers};
use chaic_env::rules::RuleSet;
use chaic_env::{Env, EnvError, EpisodeConfig};
use chaic_episodes::Episode;
use chaic_files::write_whole;
use chaic_render::{Appearance, Channels, Scene, View, floor_plan, image_out};
use chaic_world::{Rules, World};
use image::{DynamicImage, ImageError, ImageFormat};

use crate::error::{EvalError, Result};

/// A plan smaller than this can't be read, pixels.
const PLAN_MIN_PX: u32 = 960;

/// Which moment of which episode, and whose eyes.
#[derive(Clone, Copy, Debug)]
pub struct FrameExport<'a> {
    /// The episode.
    pub episode: &'a Episode,
    /// Name of the helper that takes part.
    pub helper: &'a str,
    /// Which seed.
    pub seed: u32,
    /// By which rules it is played.
    pub rules: RuleSet,
    /// Whose eyes.
    pub agent: AgentId,
    /// The moment; if nobody decides in this frame, the first one after it in which somebody does.
    pub frame: Frame,
    /// Side of the images, pixels.
    pub size: u32,
    /// How it is lit and colored.
    pub appearance: Appearance,
}

/// Plays an episode up to a moment and writes `rgb.png`, `depth.png` (16 bit, millimetres),
/// `ids.png` (16 bit), `ids.json` (id to class), `classes.png` (8 bit, see
/// [`chaic_render::Labels`]), `classes.json` (index to class), `normals.png` (in the world, see
/// [`image_out::normals_view`]) and `plan.png` (everything from above) into `out`. Returns the frame
/// that is shown.
///
/// # Errors
/// If there is no such agent or helper, or the file system refuses.
pub fn write(still: &FrameExport<'_>, helpers: &dyn Helpers, out: &Path) -> Result<Frame> {
    let FrameExport { episode, helper, seed, rules, agent, frame, size, appearance } = *still;
    let (partner, image_size) = (None, None);
    let config = EpisodeConfig { episode, seed, rules, helper, partner, image_size, appearance };
    let mut env = Env::new(config, minds::find(helpers, helper, rules.planner)?)?;
    if agent.index() >= env.world().setup().people.len() {
        let text = format!("{} has no {agent} when the helper is {helper}", episode.id());
        return Err(EvalError::Options(text));
    }
    env.advance(Some(frame))?;
    let world = env.world();
    let view = View::of_agent(world, agent, size, Channels::ALL);
    let images = env.observer().scene().render(world, &[view]).pop().unwrap_or_default();
    std::fs::create_dir_all(out).map_err(EvalError::io("make the folder", out))?;
    let no_picture = || EvalError::Picture(format!("{size} is no size of a picture"));
    let rgb = images.rgb.as_deref().and_then(|b| image_out::rgb(b, size, size));
    save(rgb.ok_or_else(no_picture)?.into(), &out.join("rgb.png"))?;
    let depth = images.depth_m.as_deref().and_then(|b| image_out::depth_mm(b, size, size));
    save(depth.ok_or_else(no_picture)?.into(), &out.join("depth.png"))?;
    let ids = images.ids.unwrap_or_default();
    let present: BTreeSet<u16> = ids.iter().copied().collect();
    let picture = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(size, size, ids);
    save(picture.ok_or_else(no_picture)?.into(), &out.join("ids.png"))?;
    let classes = world.classes();
    let names: BTreeMap<u16, &str> =
        present.into_iter().map(|id| (id, EntityId(id).class_name(&classes))).collect();
    save_names(&names, &out.join("ids.json"))?;
    let labels = env.observer().scene().label(world, &view);
    let present: BTreeSet<u8> = labels.classes.iter().copied().collect();
    let classes = ClassId::all().map(|class| (class.index() as u16, class.name()));
    let names = classes.filter(|(k, _)| present.contains(&(*k as u8))).collect();
    save_names(&names, &out.join("classes.json"))?;
    let picture = image::GrayImage::from_raw(size, size, labels.classes);
    save(picture.ok_or_else(no_picture)?.into(), &out.join("classes.png"))?;
    let normals = image_out::normals_view(&labels.normals, size, size);
    save(normals.ok_or_else(no_picture)?.into(), &out.join("normals.png"))?;
    let from_above =
        floor_plan::draw_scene_plan(env.observer().scene(), world, size.max(PLAN_MIN_PX));
    save(from_above.into(), &out.join("plan.png"))?;
    Ok(world.state().frame)
}

/// Draws the map of how an episode begins.
///
/// # Errors
/// If the setup makes no world, or the file system refuses.
pub fn write_plan(episode: &Episode, width_px: u32, path: &Path) -> Result<()> {
    let refused = |problem| EnvError::Setup { id: episode.id().to_owned(), problem };
    let world = World::new(episode.setup().clone(), Rules::paper()).map_err(refused)?;
    let scene = Scene::new(episode.setup());
    save(floor_plan::draw_scene_plan(&scene, &world, width_px).into(), path)
}

fn save_names(names: &BTreeMap<u16, &str>, path: &Path) -> Result<()> {
    let json = serde_json::to_string_pretty(names).expect("numbers and names") + "\n";
    Ok(write_whole(path, json.as_bytes())?)
}

/// Writes a picture as a whole or not at all; the extension picks the format.
pub fn save(picture: DynamicImage, path: &Path) -> Result<()> {
    let refused =
        |e: ImageError| EvalError::Picture(format!("can't write {}: {e}", path.display()));
    let mut bytes = Cursor::new(Vec::new());
    let format = ImageFormat::from_path(path).map_err(refused)?;
    picture.write_to(&mut bytes, format).map_err(refused)?;
    Ok(write_whole(path, bytes.get_ref())?)
}
