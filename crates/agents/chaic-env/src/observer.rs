//! What agents perceive when they are about to decide, and what they mean when they answer.

use std::collections::VecDeque;
use std::sync::Arc;

use chaic_core::observation::{Film, FilmFrame, Images, Observation, Senses};
use chaic_core::{Action, AgentId, EntityId, ResolvedAction, Target};
use chaic_render::{Channels, ImagesMut, Scene, View};
use chaic_world::World;

use crate::seat::Seat;

/// The eyes of everybody in an episode.
#[derive(Clone)]
pub struct Observer {
    scene: Arc<Scene>,
}

/// What an agent perceives, with what only the environment knows of its image.
#[derive(Clone, Debug)]
pub struct Glimpse {
    /// What the agent is given.
    pub observation: Observation,
    /// Instance ids of its image, u16, shape [height, width], where the agent itself isn't given
    /// them; they resolve the pixels that it points at.
    pub(crate) hidden_ids: Option<Vec<u16>>,
    may_name_entities: bool,
}

impl Glimpse {
    /// Its images, for their memory.
    pub(crate) fn into_images(self) -> Images {
        let mut images = self.observation.images;
        images.ids = images.ids.or(self.hidden_ids);
        images
    }

    /// The action with its target resolved to what the pixel shows, or to the entity where ids are
    /// granted; anything else names [`EntityId::NOTHING`].
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

/// The action of an agent that has not looked: it can point at nothing.
pub(crate) fn resolve_unseen(seat: &Seat, action: Action) -> ResolvedAction {
    resolve(action, seat.grants.ids, |_, _| EntityId::NOTHING)
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

impl Observer {
    /// The eyes for a world with these shapes.
    pub fn new(scene: Arc<Scene>) -> Observer {
        Observer { scene }
    }

    /// The shapes that are seen.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What these agents perceive now: images are made for all of them at once, and only those
    /// that are wanted. Memory of `spare` images is used again.
    pub fn observe(
        &self,
        world: &World,
        who: &[(AgentId, &Seat)],
        spare: &mut Vec<Images>,
    ) -> Vec<Glimpse> {
        let looking = who.iter().filter(|(_, a)| a.senses.wants_image());
        let views: Vec<View> =
            looking.map(|(agent, seat)| view_of(world, *agent, seat.senses)).collect();
        let mut images = spare.split_off(spare.len().saturating_sub(views.len()));
        if !views.is_empty() {
            self.scene.render_into(world, &views, &mut images);
        }
        let mut images = images.into_iter();
        who.iter()
            .map(|(agent, seat)| {
                let images = if seat.senses.wants_image() { images.next() } else { None }
                    .unwrap_or_default();
                glimpse(world, *agent, seat, images)
            })
            .collect()
    }

    /// Adds to an agent's film what it sees now, if this is a frame to keep; drops the oldest.
    pub(crate) fn film(
        &self,
        world: &World,
        agent: AgentId,
        film: Film,
        frames: &mut VecDeque<FilmFrame>,
    ) {
        let frame = world.state().frame;
        if film.most == 0 || film.every_frames == 0 || !frame.is_multiple_of(film.every_frames) {
            return;
        }
        let channels = Channels { rgb: true, depth: true, ids: false };
        let view = View::of_agent(world, agent, film.image_size, channels);
        let mut images = vec![Images::default()];
        if frames.len() >= film.most as usize {
            images.extend(frames.pop_front().map(|old| old.images));
            images.swap_remove(0);
        }
        self.scene.render_into(world, &[view], &mut images);
        let camera = world.eye(agent, film.image_size);
        frames.extend(images.pop().map(|images| FilmFrame { frame, camera, images }));
    }

    /// What one agent perceives now, with the images in buffers of the caller's instead of the
    /// observation. `ids` are taken to keep the ids in, which resolve what the agent points at.
    pub(crate) fn observe_into(
        &self,
        world: &World,
        (agent, seat): (AgentId, &Seat),
        images: ImagesMut<'_>,
        mut ids: Vec<u16>,
    ) -> Glimpse {
        let view = view_of(world, agent, seat.senses);
        let ImagesMut { rgb, depth_m, ids: ids_out } = images;
        if seat.senses.wants_image() {
            ids.resize(view.camera.width as usize * view.camera.height as usize, 0);
            let images = ImagesMut { rgb, depth_m, ids: Some(&mut ids) };
            self.scene.render_view_into(world, &view, images);
        }
        if let Some(out) = ids_out {
            out.copy_from_slice(&ids);
        }
        let in_view = present(&ids);
        Glimpse {
            observation: observation(world, agent, seat, &in_view, Images::default()),
            hidden_ids: Some(ids),
            may_name_entities: seat.grants.ids,
        }
    }
}

/// The camera of an agent's eye. Ids are always made: they resolve what is pointed at, and tell what
/// is in view.
fn view_of(world: &World, agent: AgentId, senses: Senses) -> View {
    let channels = Channels { ids: true, ..Channels::from(senses) };
    View::of_agent(world, agent, senses.image_size, channels)
}

fn glimpse(world: &World, agent: AgentId, seat: &Seat, mut images: Images) -> Glimpse {
    let in_view = images.ids.as_deref().map_or(Vec::new(), present);
    let hidden_ids = strip(&mut images, seat.senses, seat.grants.ids);
    let observation = observation(world, agent, seat, &in_view, images);
    Glimpse { observation, hidden_ids, may_name_entities: seat.grants.ids }
}

fn observation(
    world: &World,
    agent: AgentId,
    seat: &Seat,
    in_view: &[EntityId],
    images: Images,
) -> Observation {
    Observation {
        frame: world.state().frame,
        own: world.own_state(agent, seat.grants, last_action(world, agent, seat)),
        camera: world.eye(agent, seat.senses.image_size),
        images,
        film: Vec::new(),
        granted: world.granted(agent, seat.grants, in_view),
    }
}

/// The last action of an agent with its outcome, in the agent's own words.
fn last_action(
    world: &World,
    agent: AgentId,
    seat: &Seat,
) -> Option<(Action, chaic_core::Outcome)> {
    let (done, outcome) = world.last_action(agent)?;
    let meant = seat.submitted.filter(|(_, resolved)| *resolved == done).map(|(meant, _)| meant);
    let told = || seat.grants.ids.then(|| done.map(Target::Entity));
    Some((meant.or_else(told)?, outcome))
}

/// The objects and people whose ids an image holds, in the order of ids.
fn present(ids: &[u16]) -> Vec<EntityId> {
    let mut is_there = [0_u64; 1 << 10];
    pulp::Arch::new().dispatch(MarkPresent { ids, is_there: &mut is_there });
    let ids_of = |(word, bits): (usize, &u64)| {
        let bits = *bits;
        let set = (0..64_u16).filter(move |k| bits >> k & 1 == 1);
        set.map(move |k| EntityId(64 * word as u16 + k))
    };
    let named = |e: &EntityId| e.is_object() || e.agent().is_some();
    is_there
        .iter()
        .enumerate()
        .filter(|(_, bits)| **bits != 0)
        .flat_map(ids_of)
        .filter(named)
        .collect()
}

/// Sets the bit of each id of an image, compiled for vectors of each width.
struct MarkPresent<'a> {
    ids: &'a [u16],
    is_there: &'a mut [u64; 1 << 10],
}

impl pulp::NullaryFnOnce for MarkPresent<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let MarkPresent { ids, is_there } = self;
        let (chunks, rest) = ids.as_chunks::<32>();
        let mut mark = |ids: &[u16]| {
            ids.iter().for_each(|id| is_there[usize::from(id >> 6)] |= 1 << (id & 63));
        };
        let mut last = EntityId::NOTHING.0;
        for chunk in chunks {
            // Neighboring pixels mostly show the same thing.
            if chunk.iter().fold(false, |is_news, id| is_news | (*id != last)) {
                mark(chunk);
                last = chunk[31];
            }
        }
        mark(rest);
    }
}

/// Takes away what wasn't asked for or isn't granted; ids that were taken away.
fn strip(images: &mut Images, senses: Senses, may_have_ids: bool) -> Option<Vec<u16>> {
    if !senses.rgb {
        images.rgb = None;
    }
    if !senses.depth {
        images.depth_m = None;
    }
    if senses.ids && may_have_ids { None } else { images.ids.take() }
}
