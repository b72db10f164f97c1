//! The eight tasks of the challenge (paper, table 1), further ones, and what is public about each.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::capability::{Impairment, Impairments, PersonKind, Persona};
use crate::catalogue::TargetSet;
use crate::ids::{ClassId, Frame};

/// Names a task, everywhere and in this spelling.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum TaskId {
    /// A partner without constraint.
    NoConstraint,
    /// Targets on the floor, partner in a wheelchair.
    LowTarget,
    /// Obstacles in doorways, partner in a wheelchair.
    Obstacle,
    /// Targets on cabinets and refrigerators, partner a child.
    HighTarget,
    /// The goal place is high, partner a child.
    HighGoal,
    /// Containers are high, partner a child.
    HighContainer,
    /// Shopping in a street with a bicycle and a child.
    Shopping,
    /// Furniture onto a truck with a frail partner.
    MovingHouse,
    /// A partner with one arm in a sling (ours).
    OneHanded,
    /// A partner who sees two metres far (ours).
    LowVision,
    /// A partner who tires (ours).
    Tires,
    /// A partner whose hands tremble (ours).
    Tremor,
}

/// Where a task comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The paper's table 1, under the original's word for it.
    Paper(&'static str),
    /// Ours: there are no published results, and neither bundled nor standard episodes.
    Ours,
}

/// Where a task happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SceneKind {
    /// A house of six to eight rooms.
    House,
    /// A street with six shops.
    Street,
    /// The yard before a house, with a truck.
    Yard,
}

/// What an object of the goal counts for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Worth {
    /// Each as much as any other.
    Count,
    /// Its mass in kilograms (facts S5.4).
    Mass,
}

impl Worth {
    /// What one object of a class counts for.
    pub fn of(self, class: ClassId) -> f64 {
        match self {
            Worth::Count => 1.0,
            Worth::Mass => f64::from(class.info().mass_kg),
        }
    }

    /// The unit of sums of it; empty for a mere number.
    pub fn unit(self) -> &'static str {
        match self {
            Worth::Count => "",
            Worth::Mass => "kg",
        }
    }
}

/// How high the top of a goal place must be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GoalTop {
    /// As it is.
    Any,
    /// As high as the rules' `high_goal_min_top_m` at least.
    High,
}

/// To which point of a goal place one brings things.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GoalApproach {
    /// As to any other thing.
    Usual,
    /// The nearest point, by all rules: nobody walks into the middle of a truck (facts S9.4).
    NearestPoint,
}

/// How the things of a house lie, so that the partner's constraint matters: what its generator and
/// the validator go by. Streets and yards have one arrangement only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrangement {
    /// Wherever there is room.
    Usual,
    /// Some targets on high tops, among them fragile ones (paper, appendix on task generation).
    HighTargets,
    /// The containers on high tops.
    HighContainers,
    /// Half of the targets on the floor.
    LowTargets,
    /// Obstacles in doorways between the partner and the goal.
    Obstacles,
}

/// What is fixed for a task: all that tells it from the others. Nothing but this table knows tasks by
/// their names.
#[derive(Clone, Copy, Debug)]
pub struct TaskInfo {
    /// The task.
    pub id: TaskId,
    /// Name in commands, files and tables.
    pub name: &'static str,
    /// Column title in tables.
    pub title: &'static str,
    /// Where it comes from.
    pub origin: Origin,
    /// Where it happens.
    pub scene: SceneKind,
    /// Who the partner is.
    pub partner: PersonKind,
    /// Whether a child comes along.
    pub has_child: bool,
    /// Frames until the episode ends (paper section 3.3.2).
    pub horizon: Frame,
    /// The target sets that the goal is drawn from.
    pub sets: &'static [TargetSet],
    /// Names of the classes that the goal place has in episodes of the paper's shape (paper, appendix on
    /// task generation; the high goal places are those of the original's episodes). With decoys, all
    /// indoor tasks have one of the house's.
    pub goal_places: &'static [&'static str],
    /// What an object of the goal counts for.
    pub worth: Worth,
    /// How high the goal place must be.
    pub goal_top: GoalTop,
    /// To which point of the goal place one brings things.
    pub goal_approach: GoalApproach,
    /// How things lie.
    pub arrangement: Arrangement,
}

const INDOOR: &[TargetSet] =
    &[TargetSet::Fruit, TargetSet::Bread, TargetSet::Work, TargetSet::School];

const fn indoor(
    id: TaskId,
    name: &'static str,
    title: &'static str,
    origin: Origin,
    partner: PersonKind,
    arrangement: Arrangement,
) -> TaskInfo {
    let goal_places = BED;
    TaskInfo {
        id,
        name,
        title,
        origin,
        scene: SceneKind::House,
        partner,
        has_child: false,
        horizon: 3000,
        sets: INDOOR,
        goal_places,
        worth: Worth::Count,
        goal_top: GoalTop::Any,
        goal_approach: GoalApproach::Usual,
        arrangement,
    }
}

const fn only(persona: Persona) -> PersonKind {
    PersonKind { persona, impairments: Impairments::NONE }
}

/// A task like the paper's without constraint, but for what impairs the partner.
const fn impaired(
    id: TaskId,
    name: &'static str,
    title: &'static str,
    impairment: Impairment,
) -> TaskInfo {
    let impairments = Impairments::of(impairment);
    let partner = PersonKind { persona: Persona::Adult, impairments };
    indoor(id, name, title, Origin::Ours, partner, Arrangement::Usual)
}

const BED: &[&str] = &["bed"];

/// All tasks: the paper's in the order of its result table, then ours.
pub static TASKS: [TaskInfo; 12] = [
    indoor(
        TaskId::NoConstraint,
        "no_constraint",
        "No constraint",
        Origin::Paper("normal"),
        only(Persona::Adult),
        Arrangement::Usual,
    ),
    indoor(
        TaskId::HighTarget,
        "high_target",
        "High target",
        Origin::Paper("highthing"),
        only(Persona::Child),
        Arrangement::HighTargets,
    ),
    indoor(
        TaskId::HighContainer,
        "high_container",
        "High container",
        Origin::Paper("highcontainer"),
        only(Persona::Child),
        Arrangement::HighContainers,
    ),
    TaskInfo {
        goal_places: &["cabinet", "refrigerator"],
        goal_top: GoalTop::High,
        ..indoor(
            TaskId::HighGoal,
            "high_goal",
            "High goal",
            Origin::Paper("highgoalplace"),
            only(Persona::Child),
            Arrangement::Usual,
        )
    },
    indoor(
        TaskId::LowTarget,
        "low_target",
        "Low target",
        Origin::Paper("lowthing"),
        only(Persona::Wheelchair),
        Arrangement::LowTargets,
    ),
    indoor(
        TaskId::Obstacle,
        "obstacle",
        "Obstacle",
        Origin::Paper("wheelchair"),
        only(Persona::Wheelchair),
        Arrangement::Obstacles,
    ),
    TaskInfo {
        id: TaskId::Shopping,
        name: "shopping",
        title: "Shopping",
        origin: Origin::Paper("outdoor_shopping"),
        scene: SceneKind::Street,
        partner: only(Persona::Rider),
        has_child: true,
        horizon: 3000,
        sets: &[TargetSet::ShopFruit, TargetSet::ShopBakery, TargetSet::ShopDrinks],
        goal_places: &["fire_hydrant"],
        worth: Worth::Count,
        goal_top: GoalTop::Any,
        goal_approach: GoalApproach::Usual,
        arrangement: Arrangement::Usual,
    },
    TaskInfo {
        id: TaskId::MovingHouse,
        name: "moving_house",
        title: "Moving house",
        origin: Origin::Paper("outdoor_furniture"),
        scene: SceneKind::Yard,
        partner: only(Persona::Frail),
        has_child: false,
        horizon: 1500,
        sets: &[TargetSet::Furniture],
        goal_places: &["truck"],
        worth: Worth::Mass,
        goal_top: GoalTop::Any,
        goal_approach: GoalApproach::NearestPoint,
        arrangement: Arrangement::Usual,
    },
    impaired(TaskId::OneHanded, "one_handed", "One-handed", Impairment::OneHanded),
    impaired(TaskId::LowVision, "low_vision", "Low vision", Impairment::LowVision),
    impaired(TaskId::Tires, "tires", "Tires", Impairment::Tires),
    impaired(TaskId::Tremor, "tremor", "Tremor", Impairment::Tremor),
];

impl TaskId {
    /// All tasks: the paper's, then ours.
    pub fn all() -> impl Iterator<Item = TaskId> {
        TASKS.iter().map(|t| t.id)
    }

    /// The benchmark's eight tasks, in the order of the paper's result table.
    pub fn paper() -> impl Iterator<Item = TaskId> {
        TASKS.iter().filter(|t| t.origin != Origin::Ours).map(|t| t.id)
    }

    /// The tasks beyond the paper's.
    pub fn ours() -> impl Iterator<Item = TaskId> {
        TASKS.iter().filter(|t| t.origin == Origin::Ours).map(|t| t.id)
    }

    /// What is fixed for this task.
    pub fn info(self) -> &'static TaskInfo {
        TASKS.iter().find(|t| t.id == self).expect("the table lists every task")
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        self.info().name
    }

    /// The original's word for it, if it is the paper's.
    pub fn original_name(self) -> Option<&'static str> {
        match self.info().origin {
            Origin::Paper(name) => Some(name),
            Origin::Ours => None,
        }
    }
}

impl fmt::Display for TaskId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl SceneKind {
    /// Classes that the goal place may have in some task of this kind of scene, in the catalogue's
    /// order.
    pub fn goal_places(self) -> Vec<ClassId> {
        let tasks = || TASKS.iter().filter(|t| t.scene == self);
        ClassId::all().filter(|c| tasks().any(|t| t.goal_places.contains(&c.name()))).collect()
    }
}

/// No task has this name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownTask(pub String);

impl fmt::Display for UnknownTask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = TASKS.iter().map(|t| t.name).collect();
        write!(f, "unknown task `{}`; the tasks are {}", self.0, names.join(", "))
    }
}

impl std::error::Error for UnknownTask {}

impl FromStr for TaskId {
    type Err = UnknownTask;

    fn from_str(name: &str) -> Result<TaskId, UnknownTask> {
        TASKS
            .iter()
            .find(|t| t.name == name)
            .map(|t| t.id)
            .ok_or_else(|| UnknownTask(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_tasks_come_first() {
        let ids: Vec<TaskId> = TaskId::paper().chain(TaskId::ours()).collect();
        assert_eq!(ids, TaskId::all().collect::<Vec<_>>());
        assert_eq!(TaskId::paper().count(), 8);
    }

    #[test]
    fn names_in_files_and_in_the_table_agree() {
        for task in TaskId::all() {
            assert_eq!(serde_json::to_string(&task).unwrap(), format!("\"{}\"", task.name()));
            assert_eq!(task.name().parse(), Ok(task));
        }
        assert!("normal".parse::<TaskId>().unwrap_err().to_string().contains("no_constraint"));
    }
}
