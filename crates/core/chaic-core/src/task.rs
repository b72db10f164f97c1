//! Tasks: the eight of the challenge (paper, table 1), additional ones, and their public
//! properties.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::capability::{Impairment, Impairments, PersonKind, Persona};
use crate::catalogue::TargetSet;
use crate::ids::{ClassId, Frame};

/// Id of a task; its snake-case name is used in all files and commands.
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
    /// Targets on cabinets and refrigerators, child as partner.
    HighTarget,
    /// High goal place, child as partner.
    HighGoal,
    /// Containers in high places, child as partner.
    HighContainer,
    /// Shopping in a street with a bicycle and a child.
    Shopping,
    /// Loading furniture onto a truck with a frail partner.
    MovingHouse,
    /// A partner with one arm in a sling (ours).
    OneHanded,
    /// A partner who sees only 2 m far (ours).
    LowVision,
    /// A partner who tires (ours).
    Tires,
    /// A partner with trembling hands (ours).
    Tremor,
}

/// Source of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskOrigin {
    /// The paper's table 1, with the original's name of the task.
    Paper(&'static str),
    /// A task of chaic, without published results and without bundled or standard episodes.
    Chaic,
}

/// Kind of scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SceneKind {
    /// A house of six to eight rooms.
    House,
    /// A street with six shops.
    Street,
    /// The yard in front of a house, with a truck.
    Yard,
}

/// Value of a delivered target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TargetValue {
    /// 1 for each object.
    Count,
    /// Mass in kilograms (facts S5.4).
    Mass,
}

impl TargetValue {
    /// Returns the value of one object of a class.
    pub fn value(self, class: ClassId) -> f64 {
        match self {
            TargetValue::Count => 1.0,
            TargetValue::Mass => f64::from(class.info().mass_kg),
        }
    }

    /// Returns the unit of the values; empty for counts.
    pub fn unit(self) -> &'static str {
        match self {
            TargetValue::Count => "",
            TargetValue::Mass => "kg",
        }
    }
}

/// Required number of objects of each class at the goal place.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Goal {
    /// Classes with their required numbers, each class once, in the order of the catalogue.
    pub targets: Vec<(ClassId, u32)>,
}

impl Goal {
    /// Returns the required number of this class.
    pub fn count(&self, class: ClassId) -> u32 {
        self.targets.iter().find(|(c, _)| *c == class).map_or(0, |(_, n)| *n)
    }

    /// Returns the total number of required objects.
    pub fn total(&self) -> u32 {
        self.targets.iter().map(|(_, n)| n).sum()
    }
}

/// Minimum height of a goal place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GoalTop {
    /// No minimum.
    Any,
    /// At least the rules' `high_goal_min_top_m`.
    High,
}

/// Target point of an approach to the goal place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GoalApproach {
    /// The same as for any other object.
    Default,
    /// The nearest point under all rules, because the center of a truck is not accessible (facts
    /// S9.4).
    NearestPoint,
}

/// Arrangement of objects in a house that makes the partner's constraint relevant. The generator
/// and the validator use it. Streets and yards have one arrangement only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrangement {
    /// Objects anywhere with enough space.
    Default,
    /// Some targets on high tops, including fragile ones (paper, appendix on task generation).
    HighTargets,
    /// Containers on high tops.
    HighContainers,
    /// Half of the targets on the floor.
    LowTargets,
    /// Obstacles in doorways between the partner and the goal.
    Obstacles,
}

/// Properties of a task. Only this table depends on the identity of tasks.
#[derive(Clone, Copy, Debug)]
pub struct TaskInfo {
    /// Id of the task.
    pub id: TaskId,
    /// Name in commands, files and tables.
    pub name: &'static str,
    /// Column title in tables.
    pub title: &'static str,
    /// Source of the task.
    pub origin: TaskOrigin,
    /// Kind of scene.
    pub scene: SceneKind,
    /// Kind of person of the partner.
    pub partner: PersonKind,
    /// True if a child takes part.
    pub has_child: bool,
    /// Number of frames until the episode ends (paper section 3.3.2).
    pub horizon: Frame,
    /// Target sets from which the goal is drawn.
    pub sets: &'static [TargetSet],
    /// Class names of the goal place in episodes of the paper's shape (paper, appendix on task
    /// generation). The high goal places are those of the original's episodes. With decoys, all
    /// indoor tasks use one of the house's goal places.
    pub goal_places: &'static [&'static str],
    /// Value of a delivered target.
    pub target_value: TargetValue,
    /// Minimum height of the goal place.
    pub goal_top: GoalTop,
    /// Target point of an approach to the goal place.
    pub goal_approach: GoalApproach,
    /// Arrangement of objects.
    pub arrangement: Arrangement,
}

const INDOOR: &[TargetSet] =
    &[TargetSet::Fruit, TargetSet::Bread, TargetSet::Work, TargetSet::School];

const fn indoor(
    id: TaskId,
    name: &'static str,
    title: &'static str,
    origin: TaskOrigin,
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
        target_value: TargetValue::Count,
        goal_top: GoalTop::Any,
        goal_approach: GoalApproach::Default,
        arrangement,
    }
}

const fn unimpaired(persona: Persona) -> PersonKind {
    PersonKind { persona, impairments: Impairments::NONE }
}

/// Returns a task like the paper's task without constraint, but with an impaired partner.
const fn impaired(
    id: TaskId,
    name: &'static str,
    title: &'static str,
    impairment: Impairment,
) -> TaskInfo {
    let impairments = Impairments::new(impairment);
    let partner = PersonKind { persona: Persona::Adult, impairments };
    indoor(id, name, title, TaskOrigin::Chaic, partner, Arrangement::Default)
}

const BED: &[&str] = &["bed"];

/// Table of all tasks: the paper's in the order of its result table, then ours.
pub static TASKS: [TaskInfo; 12] = [
    indoor(
        TaskId::NoConstraint,
        "no_constraint",
        "No constraint",
        TaskOrigin::Paper("normal"),
        unimpaired(Persona::Adult),
        Arrangement::Default,
    ),
    indoor(
        TaskId::HighTarget,
        "high_target",
        "High target",
        TaskOrigin::Paper("highthing"),
        unimpaired(Persona::Child),
        Arrangement::HighTargets,
    ),
    indoor(
        TaskId::HighContainer,
        "high_container",
        "High container",
        TaskOrigin::Paper("highcontainer"),
        unimpaired(Persona::Child),
        Arrangement::HighContainers,
    ),
    TaskInfo {
        goal_places: &["cabinet", "refrigerator"],
        goal_top: GoalTop::High,
        ..indoor(
            TaskId::HighGoal,
            "high_goal",
            "High goal",
            TaskOrigin::Paper("highgoalplace"),
            unimpaired(Persona::Child),
            Arrangement::Default,
        )
    },
    indoor(
        TaskId::LowTarget,
        "low_target",
        "Low target",
        TaskOrigin::Paper("lowthing"),
        unimpaired(Persona::Wheelchair),
        Arrangement::LowTargets,
    ),
    indoor(
        TaskId::Obstacle,
        "obstacle",
        "Obstacle",
        TaskOrigin::Paper("wheelchair"),
        unimpaired(Persona::Wheelchair),
        Arrangement::Obstacles,
    ),
    TaskInfo {
        id: TaskId::Shopping,
        name: "shopping",
        title: "Shopping",
        origin: TaskOrigin::Paper("outdoor_shopping"),
        scene: SceneKind::Street,
        partner: unimpaired(Persona::Rider),
        has_child: true,
        horizon: 3000,
        sets: &[TargetSet::ShopFruit, TargetSet::ShopBakery, TargetSet::ShopDrinks],
        goal_places: &["fire_hydrant"],
        target_value: TargetValue::Count,
        goal_top: GoalTop::Any,
        goal_approach: GoalApproach::Default,
        arrangement: Arrangement::Default,
    },
    TaskInfo {
        id: TaskId::MovingHouse,
        name: "moving_house",
        title: "Moving house",
        origin: TaskOrigin::Paper("outdoor_furniture"),
        scene: SceneKind::Yard,
        partner: unimpaired(Persona::Frail),
        has_child: false,
        horizon: 1500,
        sets: &[TargetSet::Furniture],
        goal_places: &["truck"],
        target_value: TargetValue::Mass,
        goal_top: GoalTop::Any,
        goal_approach: GoalApproach::NearestPoint,
        arrangement: Arrangement::Default,
    },
    impaired(TaskId::OneHanded, "one_handed", "One-handed", Impairment::OneHanded),
    impaired(TaskId::LowVision, "low_vision", "Low vision", Impairment::LowVision),
    impaired(TaskId::Tires, "tires", "Tires", Impairment::Tires),
    impaired(TaskId::Tremor, "tremor", "Tremor", Impairment::Tremor),
];

impl TaskId {
    /// Returns all tasks: the paper's, then ours.
    pub fn all() -> impl Iterator<Item = TaskId> {
        TASKS.iter().map(|t| t.id)
    }

    /// Returns the eight tasks of the benchmark, in the order of the paper's result table.
    pub fn paper() -> impl Iterator<Item = TaskId> {
        TASKS.iter().filter(|t| t.origin != TaskOrigin::Chaic).map(|t| t.id)
    }

    /// Returns the tasks that are not in the paper.
    pub fn chaic() -> impl Iterator<Item = TaskId> {
        TASKS.iter().filter(|t| t.origin == TaskOrigin::Chaic).map(|t| t.id)
    }

    /// Returns the properties of the task.
    pub fn info(self) -> &'static TaskInfo {
        TASKS.iter().find(|t| t.id == self).expect("the table lists every task")
    }

    /// Returns the name.
    pub fn name(self) -> &'static str {
        self.info().name
    }

    /// Returns the original's name of the task, if it is in the paper.
    pub fn original_name(self) -> Option<&'static str> {
        match self.info().origin {
            TaskOrigin::Paper(name) => Some(name),
            TaskOrigin::Chaic => None,
        }
    }
}

impl fmt::Display for TaskId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl SceneKind {
    /// Returns the classes of goal places in the tasks of this kind of scene, in the order of the
    /// catalogue.
    pub fn goal_places(self) -> Vec<ClassId> {
        let tasks = || TASKS.iter().filter(|t| t.scene == self);
        ClassId::all().filter(|c| tasks().any(|t| t.goal_places.contains(&c.name()))).collect()
    }
}

/// A name that is not a task.
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
    fn the_tasks_of_the_paper_come_first() {
        let ids: Vec<TaskId> = TaskId::paper().chain(TaskId::chaic()).collect();
        assert_eq!(ids, TaskId::all().collect::<Vec<_>>());
        assert_eq!(TaskId::paper().count(), 8);
    }

    #[test]
    fn serialized_names_match_the_table() {
        for task in TaskId::all() {
            assert_eq!(serde_json::to_string(&task).unwrap(), format!("\"{}\"", task.name()));
            assert_eq!(task.name().parse(), Ok(task));
        }
        assert!("normal".parse::<TaskId>().unwrap_err().to_string().contains("no_constraint"));
    }
}
