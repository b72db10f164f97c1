//! Memories of partner and helper over a replay, from agents that run again beside it.

use std::sync::Arc;

use chaic_core::agent::PartnerBelief;
use chaic_core::geom::to_xz;
use chaic_core::memory_view::{ExploredCell, ExploredMap, RememberedObject};
use chaic_core::{AgentId, Frame, Vec2, Vec3};
use chaic_env::helper_registry::BuiltInHelpers;
use chaic_env::trace::Trace;
use chaic_env::{AgentRerun, EnvError, RerunMoment, RerunStatus};
use chaic_episodes::Episode;
use chaic_render::floor_plan;
use chaic_world::World;
use serde::Serialize;

/// Maximum number of stored changes of maps, 12 bytes each: far more than an episode has.
const MAX_CHANGES: usize = 4 << 20;
/// Maximum number of objects, people and points of paths in all stored memories, about 100 bytes
/// each: far more than an episode of ordinary length has.
const MAX_REMEMBERED: usize = 2 << 20;

/// Agreement of an agent that runs again with the replay.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RerunInfo {
    /// The agent.
    pub agent: AgentId,
    /// False if the agent cannot run in a page.
    pub is_available: bool,
    /// Number of decisions that equal the recorded ones.
    pub n_equal: usize,
    /// Frame of the first decision that differs; later memories are unknown.
    pub differs_at: Option<Frame>,
}

/// Memory of an agent at a frame. Positions are distances from the left and upper edge of the map,
/// relative to its width.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MemoryState {
    /// The agent.
    pub agent: AgentId,
    /// Frame of the decision at which the memory was stored.
    pub frame: Frame,
    /// Seen area of the place, square meters.
    pub seen_m2: f32,
    /// Position of the corner of the first cell with the smallest coordinates.
    pub map_at: [f32; 2],
    /// Side of a cell, relative to the map's width.
    pub cell: f32,
    /// Number of cells in a row.
    pub n_columns: usize,
    /// Remembered objects.
    pub objects: Vec<PlacedObject>,
    /// Other people at their last known positions: name, position and frame.
    pub people: Vec<(String, [f32; 2], Frame)>,
    /// Planned path; empty without one.
    pub path: Vec<[f32; 2]>,
    /// Length of the planned path, meters.
    pub path_m: f32,
    /// Plan in words.
    pub plan: String,
    /// True if the agent has the recorded belief; absent if the trace has none.
    pub is_belief_equal: Option<bool>,
}

/// Remembered object.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlacedObject {
    /// Class and name, for example `apple #31`.
    pub name: String,
    /// Position.
    pub at: [f32; 2],
    /// Frame of the last sighting.
    pub last_seen: Frame,
    /// Probability that the goal wants its class, per mille, for agents that infer the goal.
    pub wanted: Option<u16>,
}

/// Memories of both agents up to the frame that the agents have reached.
pub struct MemoryHistory {
    rerun: AgentRerun<Arc<Trace>>,
    is_complete: bool,
    agents: Vec<AgentHistory>,
}

/// Memories of one agent.
struct AgentHistory {
    agent: AgentId,
    /// The latest map.
    map: Option<ExploredMap>,
    changes: Vec<CellChange>,
    moments: Vec<RerunMoment>,
    /// Number of objects, people and points of paths in all moments.
    n_remembered: usize,
}

struct CellChange {
    frame: Frame,
    cell: u32,
    content: ExploredCell,
}

impl MemoryHistory {
    /// Prepares the agents of a trace.
    ///
    /// # Errors
    /// If the episode is not the one of the trace.
    pub fn new(trace: Arc<Trace>, episode: &Episode) -> Result<MemoryHistory, EnvError> {
        let rerun = AgentRerun::new(trace, episode, &BuiltInHelpers)?;
        let history = |agent| AgentHistory {
            agent,
            map: None,
            changes: Vec::new(),
            moments: Vec::new(),
            n_remembered: 0,
        };
        let agents = rerun.statuses().map(|(agent, _)| history(agent)).collect();
        Ok(MemoryHistory { rerun, is_complete: false, agents })
    }

    /// Runs the agents until the next decision. Returns false at the end.
    pub fn run_to_decision(&mut self) -> bool {
        while !self.is_complete {
            // The agents run up to the frame in which an altered trace differs.
            let Ok(Some(moments)) = self.rerun.step() else {
                self.is_complete = true;
                break;
            };
            if moments.is_empty() {
                continue;
            }
            for moment in moments {
                let mut agents = self.agents.iter_mut();
                if let Some(history) = agents.find(|history| history.agent == moment.agent) {
                    history.add(moment);
                }
            }
            let n_changes: usize = self.agents.iter().map(|history| history.changes.len()).sum();
            let n_remembered: usize = self.agents.iter().map(|history| history.n_remembered).sum();
            self.is_complete = n_changes > MAX_CHANGES || n_remembered > MAX_REMEMBERED;
            break;
        }
        !self.is_complete
    }

    /// Returns the frame that the agents have reached.
    pub fn frame(&self) -> Frame {
        self.rerun.frame()
    }

    /// Returns the agreement of each agent with the replay.
    pub fn info(&self) -> Vec<RerunInfo> {
        let info =
            |((agent, status), history): ((AgentId, RerunStatus), &AgentHistory)| RerunInfo {
                agent,
                is_available: status != RerunStatus::Unavailable,
                n_equal: history.moments.len(),
                differs_at: match status {
                    RerunStatus::Differs(frame) => Some(frame),
                    RerunStatus::Equal | RerunStatus::Unavailable => None,
                },
            };
        self.rerun.statuses().zip(&self.agents).map(info).collect()
    }

    /// Returns the memory of an agent at a frame; `None` if the agent has not reached the frame, or
    /// does not act there as recorded. `recorded` is the belief in the trace.
    pub fn state(
        &self,
        world: &World,
        agent: AgentId,
        frame: Frame,
        recorded: Option<&PartnerBelief>,
    ) -> Option<MemoryState> {
        let (history, moment) = self.moment(agent, frame)?;
        let map = history.map.as_ref()?;
        let on_map = |xz: Vec2| rounded(floor_plan::position_on_map(world, xz));
        let at = |position: Vec3| on_map(to_xz(position));
        let cells = history.cells(frame)?;
        let n_seen = cells.iter().filter(|cell| **cell != ExploredCell::Unknown).count();
        let belief = moment.thought.belief.as_deref();
        let (memory, corner) = (&moment.memory, floor_plan::position_on_map(world, map.min));
        let next = floor_plan::position_on_map(world, map.min + map.cell_m);
        let path = &memory.path;
        Some(MemoryState {
            agent,
            frame: moment.frame,
            seen_m2: n_seen as f32 * map.cell_m * map.cell_m,
            map_at: [corner.x, corner.y],
            cell: next.x - corner.x,
            n_columns: map.n_columns,
            objects: memory.objects.iter().map(|object| placed(object, at, belief)).collect(),
            people: memory
                .people
                .iter()
                .map(|person| {
                    (person.agent.to_string(), at(person.position_in_world), person.frame)
                })
                .collect(),
            path: path.iter().map(|point| on_map(*point)).collect(),
            path_m: path.windows(2).map(|pair| pair[0].distance(pair[1])).sum(),
            plan: moment.thought.plan.clone(),
            is_belief_equal: recorded.map(|recorded| belief == Some(recorded)),
        })
    }

    /// Returns the map of an agent at a frame, row by row: 0 for an unknown cell, 1 for a free and 2
    /// for an occupied one; empty without a memory.
    pub fn explored(&self, agent: AgentId, frame: Frame) -> Vec<u8> {
        let cells = self.moment(agent, frame).and_then(|(history, _)| history.cells(frame));
        let code = |cell| match cell {
            ExploredCell::Unknown => 0,
            ExploredCell::Free => 1,
            ExploredCell::Occupied => 2,
        };
        cells.unwrap_or_default().into_iter().map(code).collect()
    }

    /// Returns the last moment of an agent at or before a frame that the agents have reached.
    fn moment(&self, agent: AgentId, frame: Frame) -> Option<(&AgentHistory, &RerunMoment)> {
        let k = self.agents.iter().position(|history| history.agent == agent)?;
        let (_, status) = self.rerun.statuses().nth(k)?;
        let is_different = matches!(status, RerunStatus::Differs(at) if frame >= at);
        let has_run = frame < self.frame() || (frame == self.frame() && self.is_complete);
        if is_different || !has_run {
            return None;
        }
        let history = &self.agents[k];
        let n = history.moments.partition_point(|moment| moment.frame <= frame);
        Some((history, history.moments.get(n.checked_sub(1)?)?))
    }
}

impl AgentHistory {
    /// Adds a moment, with the changed cells in place of its map.
    fn add(&mut self, mut moment: RerunMoment) {
        let cells = std::mem::take(&mut moment.memory.map.cells);
        let n_cells = cells.len();
        let map = self.map.get_or_insert_with(|| ExploredMap {
            cells: vec![ExploredCell::Unknown; n_cells],
            ..moment.memory.map.clone()
        });
        let frame = moment.frame;
        for (cell, (old, new)) in map.cells.iter_mut().zip(cells).enumerate() {
            if *old != new {
                *old = new;
                self.changes.push(CellChange { frame, cell: cell as u32, content: new });
            }
        }
        let memory = &moment.memory;
        // A moment without a memory takes space, too.
        self.n_remembered += 1 + memory.objects.len() + memory.people.len() + memory.path.len();
        self.moments.push(moment);
    }

    /// Returns the map at a frame.
    fn cells(&self, frame: Frame) -> Option<Vec<ExploredCell>> {
        let map = self.map.as_ref()?;
        let mut cells = vec![ExploredCell::Unknown; map.cells.len()];
        for change in self.changes.iter().take_while(|change| change.frame <= frame) {
            cells[change.cell as usize] = change.content;
        }
        Some(cells)
    }
}

fn placed(
    object: &RememberedObject,
    at: impl Fn(Vec3) -> [f32; 2],
    belief: Option<&PartnerBelief>,
) -> PlacedObject {
    let info = object.class.info();
    let wanted = |belief: &PartnerBelief| {
        if belief.extra.contains(&object.class) {
            return 1000;
        }
        let of_class = |name: &str| info.sets.iter().any(|set| set.name() == name);
        let goals = belief.goals.iter().filter(|(name, _)| of_class(name));
        goals.map(|(_, per_mille)| per_mille).sum::<u16>().min(1000)
    };
    PlacedObject {
        name: format!("{} {}", info.label, object.name),
        at: at(object.position_in_world),
        last_seen: object.last_seen,
        wanted: belief.map(wanted),
    }
}

/// Rounds a position on a map to four decimals, less than a pixel.
pub fn rounded(at: Vec2) -> [f32; 2] {
    [at.x, at.y].map(|x| (1e4 * x).round() / 1e4)
}

#[cfg(test)]
mod tests;
