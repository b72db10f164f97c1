//! Draws of luck, each purpose from a stream of its own.

use chaic_core::AgentId;
use chaic_core::rng::Stream;
use serde::{Deserialize, Serialize};

use crate::state::State;
use crate::world::World;

/// What luck decides. Each purpose has its own named stream and its own count of draws per person,
/// so that another draw of one purpose moves no draw of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Luck {
    /// Whether a fragile thing breaks.
    Break,
    /// Whether a hand gets what it reaches for.
    Take,
    /// Whether a thing comes to lie where it is put.
    PutOn,
    /// How long one watches what was put into a container.
    WatchPutIn,
    /// Whether a grasp slips.
    Slip,
    /// Whether something drops from a hand.
    Drop,
}

/// How many draws of each purpose a person has had.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Draws {
    /// Whether a fragile thing breaks.
    pub breaks: u32,
    /// Whether a hand gets what it reaches for.
    pub takes: u32,
    /// Whether a thing comes to lie where it is put.
    pub puts_on: u32,
    /// How long one watches what was put into a container.
    pub puts_in: u32,
}

impl Luck {
    /// The name of its stream.
    fn purpose(self) -> &'static str {
        match self {
            Luck::Break => "break",
            Luck::Take => "take",
            Luck::PutOn => "put on",
            Luck::WatchPutIn => "watch put in",
            Luck::Slip => "slip",
            Luck::Drop => "drop",
        }
    }
}

impl World {
    /// The stream of a person's next draw of this purpose.
    pub(crate) fn luck(&mut self, agent: AgentId, luck: Luck) -> Stream {
        let seed = self.setup.seed;
        let State { people, conditions, .. } = &mut self.state;
        let draws = &mut people[agent.index()].draws;
        let count = match luck {
            Luck::Break => &mut draws.breaks,
            Luck::Take => &mut draws.takes,
            Luck::PutOn => &mut draws.puts_on,
            Luck::WatchPutIn => &mut draws.puts_in,
            // Only asked for people who tremble, who have a condition.
            Luck::Slip => &mut conditions[agent.index()].slips,
            Luck::Drop => &mut conditions[agent.index()].drops,
        };
        let index = u64::from(agent.0) << 32 | u64::from(*count);
        *count += 1;
        Stream::new(seed, luck.purpose(), index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setup::Setup;
    use crate::{Person, Rules, Thing};
    use chaic_core::briefing::Goal;
    use chaic_core::capability::{Impairment, Impairments, PersonKind, Persona};
    use chaic_core::geom::{Pose, Rect};
    use chaic_core::{ClassId, TaskId, Vec3};

    fn world() -> World {
        let trembling = PersonKind {
            persona: Persona::Adult,
            impairments: Impairments::of(Impairment::Tremor),
        };
        let person = |x: f32| {
            Person::new(trembling, Pose { position: Vec3::new(x, 0.0, 0.0), yaw_rad: 0.0 }, 0)
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
            things: vec![Thing::new(ClassId::named("bed"), Vec3::ZERO, 0.0)],
            people: vec![person(-1.0), person(1.0)],
            goal: Goal { targets: vec![(ClassId::named("apple"), 1)] },
            goal_places: vec![Setup::entity(0)],
        };
        World::new(setup, Rules::paper()).expect("a bare field is a world")
    }

    #[test]
    fn a_draw_of_one_purpose_moves_no_draw_of_another() {
        const ALL: [Luck; 6] =
            [Luck::Break, Luck::Take, Luck::PutOn, Luck::WatchPutIn, Luck::Slip, Luck::Drop];
        let (me, other) = (AgentId(0), AgentId(1));
        let three = |world: &mut World, luck| [(); 3].map(|()| world.luck(me, luck).unit());
        for luck in ALL {
            let alone = three(&mut world(), luck);
            let mut busy = world();
            for another in ALL.into_iter().filter(|l| *l != luck) {
                busy.luck(me, another);
            }
            for any in ALL {
                busy.luck(other, any);
            }
            assert_eq!(three(&mut busy, luck), alone, "{luck:?}");
            assert!(alone[0] != alone[1] && alone[1] != alone[2], "{luck:?} draws anew");
        }
        let firsts = ALL.map(|luck| world().luck(me, luck).unit().to_bits());
        assert!((1..6).all(|i| !firsts[..i].contains(&firsts[i])), "each has its own stream");
    }
}
