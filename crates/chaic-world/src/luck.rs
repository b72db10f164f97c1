//! Draws of luck, each purpose from a stream of its own.

use chaic_protocol::AgentId;
use chaic_protocol::rng::Stream;
use serde::{Deserialize, Serialize};

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
        }
    }
}

impl Draws {
    fn count_mut(&mut self, luck: Luck) -> &mut u32 {
        match luck {
            Luck::Break => &mut self.breaks,
            Luck::Take => &mut self.takes,
            Luck::PutOn => &mut self.puts_on,
            Luck::WatchPutIn => &mut self.puts_in,
        }
    }
}

impl World {
    /// The stream of a person's next draw of this purpose.
    pub(crate) fn luck(&mut self, agent: AgentId, luck: Luck) -> Stream {
        let seed = self.setup.seed;
        let count = self.person_mut(agent).draws.count_mut(luck);
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
    use chaic_protocol::briefing::Goal;
    use chaic_protocol::capability::Persona;
    use chaic_protocol::geom::{Pose, Rect};
    use chaic_protocol::{ClassId, TaskId, Vec3};

    fn world() -> World {
        let person = |x: f32| Person {
            persona: Persona::Adult,
            pose: Pose { position: Vec3::new(x, 0.0, 0.0), yaw_rad: 0.0 },
            look: 0,
            capability: None,
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
        const ALL: [Luck; 4] = [Luck::Break, Luck::Take, Luck::PutOn, Luck::WatchPutIn];
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
        assert!((1..4).all(|i| !firsts[..i].contains(&firsts[i])), "each has its own stream");
    }
}
