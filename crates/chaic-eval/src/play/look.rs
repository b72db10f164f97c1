//! What agents perceive when they are about to decide.

use std::sync::Arc;

use chaic_protocol::observation::{Images, Observation, Senses};
use chaic_protocol::{AgentId, ClassId, EntityId};
use chaic_render::{Channels, Scene, View};
use chaic_world::World;

use crate::play::cast::Actor;

/// The eyes of everybody in an episode.
#[derive(Clone)]
pub struct Eyes {
    scene: Arc<Scene>,
    classes: Arc<Vec<Option<ClassId>>>,
    goal_places: Vec<u16>,
}

/// What of an image decides over grants.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// A bit for each agent.
    agents: u8,
    goal_place: bool,
}

impl Eyes {
    /// Eyes for a world.
    pub fn new(scene: Arc<Scene>, world: &World) -> Eyes {
        let goal_places = world.setup().goal_places.iter().map(|e| e.0).collect();
        Eyes { scene, classes: world.classes(), goal_places }
    }

    /// The shapes that are seen.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What these agents perceive now: images are made for all of them at once, and only those
    /// that are wanted.
    pub fn observe(&self, world: &World, who: &[(AgentId, &Actor)]) -> Vec<Observation> {
        let looking: Vec<_> = who.iter().filter(|(_, a)| a.senses.wants_image()).collect();
        let view = |(agent, actor): &&(AgentId, &Actor)| {
            let camera = world.eye(*agent, actor.senses.image_size);
            // Ids are always made: they tell whether the goal place and the others are in view.
            let channels = Channels { ids: true, ..Channels::from(actor.senses) };
            View::of_eye(*agent, camera, channels)
        };
        let views: Vec<View> = looking.iter().map(view).collect();
        let mut images = match views[..] {
            [] => Vec::new(),
            _ => self.scene.render(world, &views),
        }
        .into_iter();
        who.iter()
            .map(|(agent, actor)| {
                let images = if actor.senses.wants_image() { images.next() } else { None }
                    .unwrap_or_default();
                self.observation(world, *agent, actor, images)
            })
            .collect()
    }

    fn observation(
        &self,
        world: &World,
        agent: AgentId,
        actor: &Actor,
        mut images: Images,
    ) -> Observation {
        let seen = images.ids.as_deref().map_or(Seen::default(), |ids| self.seen(ids));
        let Actor { grants, senses, .. } = actor;
        strip(&mut images, *senses, grants.ids);
        let in_view = |other: AgentId| seen.agents >> other.0 & 1 == 1;
        let knows_progress = grants.progress || seen.goal_place || world.is_near_goal(agent);
        Observation {
            frame: world.state().frame,
            own: world.own_state(agent),
            camera: world.eye(agent, senses.image_size),
            images,
            delivered: knows_progress.then(|| world.delivered()),
            removed: world.told_removed(),
            granted: world.granted(agent, *grants, &self.classes, &in_view),
        }
    }

    fn seen(&self, ids: &[u16]) -> Seen {
        let mut seen = Seen::default();
        let mut last = EntityId::NOTHING.0;
        // Neighboring pixels mostly show the same thing.
        let is_news = |chunk: &[u16], last| chunk.iter().fold(false, |n, id| n | (*id != last));
        for chunk in ids.chunks(16) {
            if !is_news(chunk, last) {
                continue;
            }
            for id in chunk {
                if *id == last {
                    continue;
                }
                last = *id;
                if let Some(agent) = EntityId(*id).agent() {
                    seen.agents |= 1 << agent.0;
                }
                seen.goal_place |= self.goal_places.contains(id);
            }
        }
        seen
    }
}

/// Takes away what wasn't asked for or isn't granted.
fn strip(images: &mut Images, senses: Senses, may_have_ids: bool) {
    if !senses.rgb {
        images.rgb = None;
    }
    if !senses.depth {
        images.depth_m = None;
    }
    if !senses.ids || !may_have_ids {
        images.ids = None;
    }
}
