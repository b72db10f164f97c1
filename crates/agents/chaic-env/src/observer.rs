//! Rendering of observations, and resolution of the pixels in actions.

use std::collections::VecDeque;
use std::sync::Arc;

use chaic_core::observation::{FrameHistorySpec, HistoryFrame, Images, Observation, SensorConfig};
use chaic_core::{Action, AgentId, EntityId, ResolvedAction, Target};
use chaic_render::{Channels, ImagesMut, Scene, View};
use chaic_world::World;

use crate::agent_slot::AgentSlot;

/// Renders the observations of all agents of an episode.
#[derive(Clone)]
pub struct ObservationRenderer {
    scene: Arc<Scene>,
}

/// An observation, with the ids of its image that only the environment has.
#[derive(Clone, Debug)]
pub struct RenderedObservation {
    /// Observation for the agent.
    pub observation: Observation,
    /// Instance ids of its image, u16, shape [height, width], if the observation lacks them. They resolve
    /// the pixels in actions.
    pub(crate) hidden_ids: Option<Vec<u16>>,
    /// True if actions may name entities, which needs the grant of ids.
    may_name_entities: bool,
}

impl RenderedObservation {
    /// Returns the images, to reuse their buffers.
    pub(crate) fn into_images(self) -> Images {
        let mut images = self.observation.images;
        images.ids = images.ids.or(self.hidden_ids);
        images
    }

    /// Resolves the target of an action: a pixel to the entity that it shows, an entity to itself if ids
    /// are granted, anything else to [`EntityId::NOTHING`].
    pub fn resolve(&self, action: Action) -> ResolvedAction {
        resolve(action, self.may_name_entities, |column, row| self.at_pixel(column, row))
    }

    fn at_pixel(&self, column: u32, row: u32) -> EntityId {
        let ids = self.hidden_ids.as_ref().or(self.observation.images.ids.as_ref());
        let (width, height) = (self.observation.camera.width, self.observation.camera.height);
        let is_inside = column < width && row < height;
        let index = || row as usize * width as usize + column as usize;
        let shown = ids.filter(|_| is_inside).and_then(|ids| ids.get(index()));
        shown.map_or(EntityId::NOTHING, |id| EntityId(*id))
    }
}

/// Resolves the action of an agent without a rendered observation; pixels resolve to nothing.
pub(crate) fn resolve_unseen(slot: &AgentSlot, action: Action) -> ResolvedAction {
    resolve(action, slot.grants.ids, |_, _| EntityId::NOTHING)
}

fn resolve(
    action: Action,
    may_name_entities: bool,
    at_pixel: impl Fn(u32, u32) -> EntityId,
) -> ResolvedAction {
    action.map(|target| match target {
        Target::Entity(entity) if may_name_entities => entity,
        Target::Entity(_) => EntityId::NOTHING,
        Target::Pixel { column, row } => at_pixel(column, row),
    })
}

impl ObservationRenderer {
    /// Creates a renderer of a scene.
    pub fn new(scene: Arc<Scene>) -> ObservationRenderer {
        ObservationRenderer { scene }
    }

    /// Returns the rendered scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Renders the observations of agents in one batch. Only requested images are rendered; buffers of
    /// `spare` images are reused.
    pub fn observe(
        &self,
        world: &World,
        agents: &[(AgentId, &AgentSlot)],
        spare: &mut Vec<Images>,
    ) -> Vec<RenderedObservation> {
        let with_image = agents.iter().filter(|(_, slot)| slot.sensors.wants_image());
        let views: Vec<View> =
            with_image.map(|(agent, slot)| view(world, *agent, slot.sensors)).collect();
        let mut images = spare.split_off(spare.len().saturating_sub(views.len()));
        if !views.is_empty() {
            self.scene.render_into(world, &views, &mut images);
        }
        let mut images = images.into_iter();
        agents
            .iter()
            .map(|(agent, slot)| {
                let images = if slot.sensors.wants_image() { images.next() } else { None }
                    .unwrap_or_default();
                rendered_observation(world, *agent, slot, images)
            })
            .collect()
    }

    /// Appends the current image to an agent's frame history, if its schedule has this frame. Drops the
    /// oldest image of a full history.
    pub(crate) fn record_history(
        &self,
        world: &World,
        agent: AgentId,
        spec: FrameHistorySpec,
        history: &mut VecDeque<HistoryFrame>,
    ) {
        let frame = world.state().frame;
        if spec.max_len == 0 || spec.every_frames == 0 || !frame.is_multiple_of(spec.every_frames) {
            return;
        }
        let channels = Channels { rgb: true, depth: true, ids: false };
        let view = View::from_agent(world, agent, spec.image_size, channels);
        let mut images = vec![Images::default()];
        if history.len() >= spec.max_len as usize {
            images.extend(history.pop_front().map(|old| old.images));
            images.swap_remove(0);
        }
        self.scene.render_into(world, &[view], &mut images);
        let camera = world.camera(agent, spec.image_size);
        history.extend(images.pop().map(|images| HistoryFrame { frame, camera, images }));
    }

    /// Renders the color image of an agent.
    pub(crate) fn render_color(&self, world: &World, agent: AgentId, image_size: u32) -> Vec<u8> {
        let channels = Channels { rgb: true, depth: false, ids: false };
        let view = View::from_agent(world, agent, image_size, channels);
        let mut rgb = vec![0; 3 * view.camera.width as usize * view.camera.height as usize];
        let images = ImagesMut { rgb: Some(&mut rgb), ..ImagesMut::default() };
        self.scene.render_view_into(world, &view, images);
        rgb
    }

    /// Renders the ids of an agent's view, which resolve pixels in actions.
    pub(crate) fn render_ids(&self, world: &World, agent: AgentId, image_size: u32) -> Vec<u16> {
        let channels = Channels { rgb: false, depth: false, ids: true };
        let view = View::from_agent(world, agent, image_size, channels);
        let mut ids = vec![0; view.camera.width as usize * view.camera.height as usize];
        let images = ImagesMut { ids: Some(&mut ids), ..ImagesMut::default() };
        self.scene.render_view_into(world, &view, images);
        ids
    }

    /// Renders the observation of one agent with its images in the caller's buffers. The buffer `ids`
    /// becomes the id image that resolves pixels in actions.
    pub(crate) fn observe_into(
        &self,
        world: &World,
        agent: AgentId,
        slot: &AgentSlot,
        images: ImagesMut<'_>,
        mut ids: Vec<u16>,
    ) -> RenderedObservation {
        let view = view(world, agent, slot.sensors);
        let ImagesMut { rgb, depth_m, ids: ids_out } = images;
        if slot.sensors.wants_image() {
            ids.resize(view.camera.width as usize * view.camera.height as usize, 0);
            let images = ImagesMut { rgb, depth_m, ids: Some(&mut ids) };
            self.scene.render_view_into(world, &view, images);
        } else {
            // The ids of an action at a pixel may be left from an earlier turn.
            ids.clear();
        }
        if let Some(out) = ids_out {
            out.copy_from_slice(&ids);
        }
        let in_view = visible_entities(&ids);
        RenderedObservation {
            observation: observation(world, agent, slot, &in_view, Images::default()),
            hidden_ids: Some(ids),
            may_name_entities: slot.grants.ids,
        }
    }
}

/// Returns the view of an agent's camera. Ids are always rendered: they resolve pixels in actions and
/// determine the visible entities.
fn view(world: &World, agent: AgentId, sensors: SensorConfig) -> View {
    let channels = Channels { ids: true, ..Channels::from(sensors) };
    View::from_agent(world, agent, sensors.image_size, channels)
}

fn rendered_observation(
    world: &World,
    agent: AgentId,
    slot: &AgentSlot,
    mut images: Images,
) -> RenderedObservation {
    let in_view = images.ids.as_deref().map_or(Vec::new(), visible_entities);
    let hidden_ids = strip(&mut images, slot.sensors, slot.grants.ids);
    let observation = observation(world, agent, slot, &in_view, images);
    RenderedObservation { observation, hidden_ids, may_name_entities: slot.grants.ids }
}

fn observation(
    world: &World,
    agent: AgentId,
    slot: &AgentSlot,
    in_view: &[EntityId],
    images: Images,
) -> Observation {
    Observation {
        frame: world.state().frame,
        proprioception: world.proprioception(agent, slot.grants, last_action(world, agent, slot)),
        camera: world.camera(agent, slot.sensors.image_size),
        images,
        frame_history: Vec::new(),
        granted: world.granted(agent, slot.grants, in_view),
    }
}

/// Returns the last action of an agent as the agent submitted it, with its outcome.
fn last_action(
    world: &World,
    agent: AgentId,
    slot: &AgentSlot,
) -> Option<(Action, chaic_core::Outcome)> {
    let (done, outcome) = world.last_action(agent)?;
    let submitted =
        slot.submitted.filter(|(_, resolved)| *resolved == done).map(|(action, _)| action);
    let resolved = || slot.grants.ids.then(|| done.map(Target::Entity));
    Some((submitted.or_else(resolved)?, outcome))
}

/// Returns the objects and people in an id image, in the order of ids.
fn visible_entities(ids: &[u16]) -> Vec<EntityId> {
    let mut is_present = [0_u64; 1 << 10];
    pulp::Arch::new().dispatch(MarkPresent { ids, is_present: &mut is_present });
    let ids_of = |(word, bits): (usize, &u64)| {
        let bits = *bits;
        let set = (0..64_u16).filter(move |k| bits >> k & 1 == 1);
        set.map(move |k| EntityId(64 * word as u16 + k))
    };
    let is_object_or_agent = |e: &EntityId| e.is_object() || e.agent().is_some();
    is_present
        .iter()
        .enumerate()
        .filter(|(_, bits)| **bits != 0)
        .flat_map(ids_of)
        .filter(is_object_or_agent)
        .collect()
}

/// Sets the bit of each id of an image; compiled for each SIMD width.
struct MarkPresent<'a> {
    ids: &'a [u16],
    is_present: &'a mut [u64; 1 << 10],
}

impl pulp::NullaryFnOnce for MarkPresent<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let MarkPresent { ids, is_present } = self;
        let (chunks, remainder) = ids.as_chunks::<32>();
        let mut mark = |ids: &[u16]| {
            ids.iter().for_each(|id| is_present[usize::from(id >> 6)] |= 1 << (id & 63));
        };
        let mut last = EntityId::NOTHING.0;
        for chunk in chunks {
            // Neighboring pixels mostly show the same entity.
            if chunk.iter().fold(false, |differs, id| differs | (*id != last)) {
                mark(chunk);
                last = chunk[31];
            }
        }
        mark(remainder);
    }
}

/// Removes images that are not requested or not granted; returns the removed ids.
fn strip(images: &mut Images, sensors: SensorConfig, may_have_ids: bool) -> Option<Vec<u16>> {
    if !sensors.rgb {
        images.rgb = None;
    }
    if !sensors.depth {
        images.depth_m = None;
    }
    if sensors.ids && may_have_ids { None } else { images.ids.take() }
}

#[cfg(test)]
mod tests;
