//! Habits of partners: parameters in which a partner deviates from the published rules.

use std::fmt;

use chaic_core::Frame;
use chaic_core::rng::RngStream;

/// Prefix of a partner whose habits are listed.
const HABITS: &str = "habits:";
/// Prefix of a partner whose habits are drawn from a seed.
const DRAWN: &str = "drawn:";

/// Order in which a partner fetches the wanted objects that it knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FetchOrder {
    /// Nearest first, as in the rules.
    Nearest,
    /// Farthest first.
    Farthest,
    /// Random order.
    Random,
}

impl FetchOrder {
    const ALL: [FetchOrder; 3] = [FetchOrder::Nearest, FetchOrder::Farthest, FetchOrder::Random];

    fn name(self) -> &'static str {
        match self {
            FetchOrder::Nearest => "nearest",
            FetchOrder::Farthest => "farthest",
            FetchOrder::Random => "random",
        }
    }
}

/// Parameters in which a partner deviates from the rules. As text, `habits:` and the parameters that
/// differ from the rules: `habits:order=farthest,noise=20,pause=90,memory=300,load=1,containers=no`.
///
/// ```
/// use chaic_agents::partners::PartnerHabits;
/// let habits = PartnerHabits::from_name("habits:pause=30").unwrap();
/// assert_eq!(habits.pause_frames, 30);
/// assert_eq!(habits.to_string(), "habits:pause=30");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PartnerHabits {
    /// Order of the wanted objects.
    pub order: FetchOrder,
    /// Probability that it fetches a random possible target instead of a wanted one, percent, 0 to 100.
    pub noise_percent: u8,
    /// Pause before each plan, frames, 0 to 600.
    pub pause_frames: Frame,
    /// Time after which it forgets an object that it has not seen, frames, 30 to 3000; `None` if it
    /// never forgets.
    pub memory_frames: Option<Frame>,
    /// Number of carried targets, 1 to 4, from which it delivers before it fetches more; `None` for
    /// the rules.
    pub max_load: Option<u8>,
    /// True if it takes containers.
    pub takes_containers: bool,
}

/// Reason why a name is not that of a partner with habits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HabitsError {
    /// The name has neither of the two forms, and no table lists it.
    Unknown,
    /// The text after the prefix is wrong; one sentence describes the problem.
    Invalid(String),
}

impl PartnerHabits {
    /// Habits of the rules.
    pub const RULES: PartnerHabits = PartnerHabits {
        order: FetchOrder::Nearest,
        noise_percent: 0,
        pause_frames: 0,
        memory_frames: None,
        max_load: None,
        takes_containers: true,
    };

    /// Habits of a partner that pauses before each plan, for about the duration of a pick-up.
    pub const SLOW: PartnerHabits = PartnerHabits { pause_frames: 90, ..PartnerHabits::RULES };

    /// Parses `habits:...` or `drawn:SEED`.
    ///
    /// # Errors
    /// [`HabitsError`] if the name has another form or wrong parameters.
    pub fn from_name(name: &str) -> Result<PartnerHabits, HabitsError> {
        let invalid = |problem: String| HabitsError::Invalid(format!("`{name}`: {problem}"));
        if let Some(seed) = name.strip_prefix(DRAWN) {
            let range = || format!("expected {DRAWN}SEED with a seed from 0 to {}", u64::MAX);
            let seed = seed.parse().map_err(|_| invalid(range()))?;
            return Ok(PartnerHabits::draw(seed));
        }
        let text = name.strip_prefix(HABITS).ok_or(HabitsError::Unknown)?;
        let mut habits = PartnerHabits::RULES;
        let mut known: Vec<&str> = Vec::new();
        for parameter in text.split(',') {
            let (key, value) = parameter.split_once('=').unwrap_or((parameter, ""));
            if known.contains(&key) {
                return Err(invalid(format!("`{key}` is given twice")));
            }
            known.push(key);
            habits.set(key, value).map_err(invalid)?;
        }
        Ok(habits)
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        let number = |low: u32, high: u32| {
            let number: Option<u32> = value.parse().ok();
            number.filter(|n| (low..=high).contains(n)).ok_or_else(|| {
                format!("`{key}` is `{value}`, expected a number from {low} to {high}")
            })
        };
        match key {
            "order" => {
                let order = FetchOrder::ALL.into_iter().find(|order| order.name() == value);
                let names = FetchOrder::ALL.map(FetchOrder::name).join(", ");
                self.order = order
                    .ok_or_else(|| format!("`{key}` is `{value}`, expected one of {names}"))?;
            }
            "noise" => self.noise_percent = number(0, 100)? as u8,
            "pause" => self.pause_frames = number(0, 600)?,
            "memory" => self.memory_frames = Some(number(30, 3000)?),
            "load" => self.max_load = Some(number(1, 4)? as u8),
            "containers" => {
                self.takes_containers = match value {
                    "yes" => true,
                    "no" => false,
                    _ => return Err(format!("`{key}` is `{value}`, expected yes or no")),
                };
            }
            _ => {
                return Err(format!(
                    "unknown parameter `{key}`; they are order, noise, pause, memory, load and \
                     containers"
                ));
            }
        }
        Ok(())
    }

    /// Draws habits that differ from the rules. Each parameter deviates independently. Probabilities:
    /// order 2/3; noise (5 to 40 percent), pause (10 to 180 frames) and memory (60 to 600 frames)
    /// 1/2 each; load (1) and containers (none) 1/4 each.
    pub fn draw(seed: u64) -> PartnerHabits {
        let mut stream = RngStream::new(seed, "drawn partner", 0);
        loop {
            let habits = PartnerHabits::draw_once(&mut stream);
            if habits != PartnerHabits::RULES {
                return habits;
            }
        }
    }

    fn draw_once(stream: &mut RngStream) -> PartnerHabits {
        /// Returns a number from `low` to `high` with this probability.
        fn number(stream: &mut RngStream, chance: f32, low: u32, high: u32) -> Option<u32> {
            let deviates = stream.chance(chance);
            let number = low + stream.below((high - low) as usize + 1) as u32;
            deviates.then_some(number)
        }
        let order = FetchOrder::ALL[stream.below(FetchOrder::ALL.len())];
        PartnerHabits {
            order,
            noise_percent: number(stream, 0.5, 5, 40).unwrap_or(0) as u8,
            pause_frames: number(stream, 0.5, 10, 180).unwrap_or(0),
            memory_frames: number(stream, 0.5, 60, 600),
            max_load: number(stream, 0.25, 1, 1).map(|load| load as u8),
            takes_containers: !stream.chance(0.25),
        }
    }
}

impl fmt::Display for PartnerHabits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let PartnerHabits { order, noise_percent, pause_frames, memory_frames, max_load, .. } =
            self;
        let is_rules = *self == PartnerHabits::RULES;
        let parameters = [
            // A partner that follows the rules has at least one parameter, too.
            (*order != FetchOrder::Nearest || is_rules).then(|| format!("order={}", order.name())),
            (*noise_percent > 0).then(|| format!("noise={noise_percent}")),
            (*pause_frames > 0).then(|| format!("pause={pause_frames}")),
            memory_frames.map(|frames| format!("memory={frames}")),
            max_load.map(|load| format!("load={load}")),
            (!self.takes_containers).then(|| "containers=no".to_owned()),
        ];
        let parameters: Vec<String> = parameters.into_iter().flatten().collect();
        write!(f, "{HABITS}{}", parameters.join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn habits_roundtrip_through_text() {
        for text in [
            "habits:order=farthest,noise=20,pause=90,memory=300,load=1,containers=no",
            "habits:order=random",
            "habits:load=4",
            "habits:order=nearest",
        ] {
            assert_eq!(PartnerHabits::from_name(text).expect("valid").to_string(), text);
        }
        assert_eq!(PartnerHabits::from_name("habits:noise=0"), Ok(PartnerHabits::RULES));
        assert_eq!(PartnerHabits::from_name("farthest"), Err(HabitsError::Unknown));
    }

    #[test]
    fn wrong_parameters_are_named_in_one_line() {
        for (text, words) in [
            ("habits:", "unknown parameter ``"),
            ("habits:speed=2", "unknown parameter `speed`"),
            ("habits:order=last", "expected one of nearest, farthest, random"),
            ("habits:noise=101", "from 0 to 100"),
            ("habits:noise=-1", "from 0 to 100"),
            ("habits:pause=601", "from 0 to 600"),
            ("habits:memory=29", "from 30 to 3000"),
            ("habits:load=0", "from 1 to 4"),
            ("habits:containers=2", "expected yes or no"),
            ("habits:pause=1,pause=2", "`pause` is given twice"),
            ("drawn:", "drawn:SEED"),
            ("drawn:18446744073709551616", "drawn:SEED"),
        ] {
            let Err(HabitsError::Invalid(problem)) = PartnerHabits::from_name(text) else {
                panic!("{text} is accepted");
            };
            assert!(problem.contains(words) && !problem.contains('\n'), "{problem}");
        }
    }

    #[test]
    fn drawn_habits_follow_from_the_seed() {
        let drawn: Vec<PartnerHabits> = (0..400).map(PartnerHabits::draw).collect();
        assert_eq!(drawn, (0..400).map(PartnerHabits::draw).collect::<Vec<_>>());
        assert!((1..400).filter(|k| drawn[*k] != drawn[*k - 1]).count() > 390);
        assert!(drawn.iter().all(|habits| *habits != PartnerHabits::RULES));
        for habits in &drawn {
            assert_eq!(PartnerHabits::from_name(&habits.to_string()), Ok(*habits));
        }
        let share = |deviates: fn(&PartnerHabits) -> bool| {
            drawn.iter().filter(|habits| deviates(habits)).count() as f32 / drawn.len() as f32
        };
        assert!((share(|h| h.order != FetchOrder::Nearest) - 0.67).abs() < 0.08);
        assert!((share(|h| h.noise_percent > 0) - 0.5).abs() < 0.08);
        assert!((share(|h| h.pause_frames > 0) - 0.5).abs() < 0.08);
        assert!((share(|h| h.memory_frames.is_some()) - 0.5).abs() < 0.08);
        assert!((share(|h| h.max_load.is_some()) - 0.25).abs() < 0.08);
        assert!((share(|h| !h.takes_containers) - 0.25).abs() < 0.08);
    }
}
