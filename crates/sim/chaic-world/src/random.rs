//! Random draws of the world, one stream for each purpose.

use chaic_core::AgentId;
use chaic_core::rng::RngStream;

use crate::state::State;
use crate::world::World;

/// Purpose of a random draw. Each purpose has its own named stream and its own counter per agent,
/// so additional draws of one purpose do not shift those of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RngPurpose {
    /// Decides whether a fragile object breaks.
    Break,
    /// Decides whether a pick-up succeeds.
    Take,
    /// Decides whether a put-on succeeds.
    PutOn,
    /// Number of frames for watching an object that was put into a container.
    WatchPutIn,
    /// Decides whether a grasp slips because of a tremor.
    Slip,
    /// Decides whether a held object drops because of a tremor.
    Drop,
}

impl RngPurpose {
    /// Returns the name of the stream.
    fn stream_name(self) -> &'static str {
        match self {
            RngPurpose::Break => "break",
            RngPurpose::Take => "take",
            RngPurpose::PutOn => "put on",
            RngPurpose::WatchPutIn => "watch put in",
            RngPurpose::Slip => "slip",
            RngPurpose::Drop => "drop",
        }
    }
}

impl World {
    /// Returns the stream of an agent's next draw for this purpose, and counts the draw.
    pub(crate) fn rng(&mut self, agent: AgentId, purpose: RngPurpose) -> RngStream {
        let seed = self.setup.seed;
        let State { agents, impairment_states, .. } = &mut self.state;
        let draws = &mut agents[agent.index()].draws;
        let count = match purpose {
            RngPurpose::Break => &mut draws.breaks,
            RngPurpose::Take => &mut draws.takes,
            RngPurpose::PutOn => &mut draws.puts_on,
            RngPurpose::WatchPutIn => &mut draws.puts_in,
            // Requested only for agents with a tremor, who have such a state.
            RngPurpose::Slip => &mut impairment_states[agent.index()].slips,
            RngPurpose::Drop => &mut impairment_states[agent.index()].drops,
        };
        let index = u64::from(agent.0) << 32 | u64::from(*count);
        *count += 1;
        RngStream::new(seed, purpose.stream_name(), index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setup::Setup;
    use crate::{AgentSpec, ObjectSpec, Rules};
    use chaic_core::briefing::Goal;
    use chaic_core::capability::{Impairment, Impairments, PersonKind, Persona};
    use chaic_core::geom::{Pose, Rect};
    use chaic_core::{ClassId, TaskId, Vec3};

    fn world() -> World {
        let trembling = PersonKind {
            persona: Persona::Adult,
            impairments: Impairments::new(Impairment::Tremor),
        };
        let person = |x: f32| {
            AgentSpec::new(trembling, Pose { position: Vec3::new(x, 0.0, 0.0), yaw_rad: 0.0 }, 0)
        };
        let setup = Setup {
            task: TaskId::NoConstraint,
            seed: 7,
            horizon: 100,
            bounds: Rect::new([-5.0, -5.0], [5.0, 5.0]),
            ceiling_m: None,
            rooms: vec![],
            walls: vec![],
            openings: vec![],
            floors: vec![],
            things: vec![ObjectSpec::new(ClassId::named("bed"), Vec3::ZERO, 0.0)],
            people: vec![person(-1.0), person(1.0)],
            goal: Goal { targets: vec![(ClassId::named("apple"), 1)] },
            goal_places: vec![Setup::entity(0)],
        };
        World::new(setup, Rules::paper()).expect("an empty field is a valid world")
    }

    #[test]
    fn draws_of_one_purpose_do_not_shift_draws_of_another() {
        const ALL: [RngPurpose; 6] = [
            RngPurpose::Break,
            RngPurpose::Take,
            RngPurpose::PutOn,
            RngPurpose::WatchPutIn,
            RngPurpose::Slip,
            RngPurpose::Drop,
        ];
        let (own, other) = (AgentId(0), AgentId(1));
        let draw_three =
            |world: &mut World, purpose| [(); 3].map(|()| world.rng(own, purpose).unit());
        for purpose in ALL {
            let alone = draw_three(&mut world(), purpose);
            let mut busy = world();
            for another in ALL.into_iter().filter(|p| *p != purpose) {
                busy.rng(own, another);
            }
            for any in ALL {
                busy.rng(other, any);
            }
            assert_eq!(draw_three(&mut busy, purpose), alone, "{purpose:?}");
            assert!(
                alone[0] != alone[1] && alone[1] != alone[2],
                "{purpose:?} draws are independent"
            );
        }
        let firsts = ALL.map(|purpose| world().rng(own, purpose).unit().to_bits());
        assert!(
            (1..6).all(|i| !firsts[..i].contains(&firsts[i])),
            "each purpose has its own stream"
        );
    }
}
