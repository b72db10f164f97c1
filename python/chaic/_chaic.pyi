"""Types of the native module; python/stub_docs.py copies the docstrings from Rust."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

__version__: str
ACTIONS: list[str]
PROPRIOCEPTION: list[str]
PLAN_FEATURES: list[str]
MAP: list[str]
REWARD: dict[str, float]

#: String or dictionary as in docs/subprocess-helpers.md, or a row of kind, column and row.
_Action: TypeAlias = str | Mapping[str, Any] | Sequence[int] | NDArray[np.integer[Any]]

@final
class Episode:
    """An episode: a scene, its objects and people, and the partner's goal."""
    def __new__(cls, id: str) -> Self: ...
    @staticmethod
    def from_json(text: str) -> Episode:
        """Parses and checks the text of an episode file (docs/episodes.md)."""
    @staticmethod
    def from_dict(fields: dict[str, Any]) -> Episode:
        """Parses and checks the content of an episode file. Remove `generator` from a changed episode: the field
        states which generator made it."""
    def to_json(self) -> str:
        """Returns the text of an episode file."""
    def as_dict(self) -> dict[str, Any]:
        """Returns the content of an episode file (docs/episodes.md); `from_dict` reads it."""
    @property
    def id(self) -> str:
        """Episode id."""
    @property
    def task(self) -> str:
        """Task name."""
    def floor_plan(self, width: int = 640) -> NDArray[np.uint8]:
        """Draws the top view, uint8 [height, width, 3]."""
    def show(self) -> None:
        """Shows the top view in the notebook or the browser."""
    def _repr_png_(self) -> bytes:
        """Returns the picture for notebooks, as PNG."""

@final
class Briefing:
    """Information for an agent before an episode; docs/subprocess-helpers.md lists the fields."""
    me: int
    capability: dict[str, Any]
    motion: dict[str, Any]
    companions: list[dict[str, Any]]
    seed: int
    horizon: int
    bounds: dict[str, Any]
    possible_targets: list[str]
    containers: list[str]
    obstacles: list[str]
    goal_places: list[str]
    goal_place_min_top_m: float
    container_capacity: int
    grants: dict[str, bool]
    goal: dict[str, Any] | None
    disclosure: dict[str, Any] | None
    layout: dict[str, Any] | None
    def as_dict(self) -> dict[str, Any]:
        """Returns all fields."""

@final
class Observation:
    """Observation of an agent when its action has ended; docs/subprocess-helpers.md lists the fields."""
    @property
    def frame(self) -> int:
        """Frames since the start of the episode."""
    @property
    def proprioception(self) -> dict[str, Any]:
        """State of the own body: `pose`, `hands`, `last`, `other_end`."""
    @property
    def camera(self) -> dict[str, Any]:
        """Camera of the images."""
    @property
    def granted(self) -> dict[str, Any]:
        """Granted information."""
    @property
    def rgb(self) -> NDArray[np.uint8] | None:
        """Color, uint8 [height, width, 3]; `None` if not requested."""
    @property
    def depth(self) -> NDArray[np.float32] | None:
        """Depth along the camera's axis, float32 meters [height, width]; `None` if not requested."""
    @property
    def ids(self) -> NDArray[np.uint16] | None:
        """Instance ids, uint16 [height, width]; `None` if not requested or not granted."""
    @property
    def frame_history(self) -> list[dict[str, Any]]:
        """Images since the last decision, oldest first, if requested: dictionaries with `frame`, `camera`, `rgb`
        and `depth`."""

@final
class Snapshot:
    """Copy of a running episode with its agents."""

@final
class World:
    """Running episode. Agent 0 is the partner and agent 1 the helper; the caller controls one of them or both.

    Keywords of the constructor:

    - `helper`: `"caller"`, `"none"` or a built-in helper, with `perception` and `behavior` as in `PlanningAgent`;
    - `partner`: `"rules"` for the partner of the task, or `"caller"`;
    - `grants` (docs/grants.md), `images` (of `"rgb"`, `"depth"`, `"ids"`) and `image_size` of the caller's agents;
    - `partner_image_size`: image size of all other agents; by default that of scored runs;
    - `rules`, `set` and `appearance`, as in `chaic eval`. `grants`, `images` and `set` are one string or several."""
    def __new__(
        cls,
        episode: Episode,
        seed: int = 0,
        *,
        helper: str = "caller",
        partner: str = "rules",
        rules: str = "paper",
        set: Sequence[str] = ...,
        grants: Sequence[str] = ...,
        images: Sequence[str] = ...,
        image_size: int = 128,
        partner_image_size: int | None = None,
        appearance: str = "canonical",
        perception: str = "gt",
        behavior: str = "gt",
    ) -> Self: ...
    def reset(self, episode: Episode | None = None, seed: int = 0) -> None:
        """Starts another episode, or restarts the current one, with this seed; 0 is the episode's own."""
    @property
    def episode(self) -> Episode:
        """Current episode."""
    @property
    def frame(self) -> int:
        """Number of frames that have passed, 30 per second."""
    @property
    def horizon(self) -> int:
        """Number of frames of the episode."""
    @property
    def is_over(self) -> bool:
        """True if the episode has ended."""
    def advance(self, until: int | None = None) -> str:
        """Runs the episode until an agent of the caller needs an action (`"needs_action"`), the episode has `"ended"`, or
        an agent waits in a frame at or after `until` (`"stopped"`). After Ctrl-C, the next call continues."""
    def waiting(self) -> list[int]:
        """Returns the agents of the caller that need an action now."""
    def briefing(self, agent: int = 1) -> Briefing:
        """Returns the briefing of an agent."""
    def observe(self, agent: int = 1) -> Observation:
        """Returns the observation of an agent that needs an action."""
    def submit(self, action: _Action, agent: int = 1) -> None:
        """Sets the next action of an agent that needs one: a string or dictionary as in docs/subprocess-helpers.md, or a
        row of kind (`ACTIONS`), column and row of a pixel. It starts once all agents have chosen."""
    def step(self, action: _Action, agent: int = 1) -> tuple[bool, float, float, bool]:
        """Submits the action of the only agent that needs one and advances, in one call for learners. Returns whether an
        agent needs an action, and the reward terms: delivered fraction, meters of progress, and whether it failed."""
    def progress(self) -> tuple[float, float]:
        """Returns the delivered and the wanted amount; TR is their ratio."""
    def proprioception(self, agent: int = 1) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Returns the proprioception (`PROPRIOCEPTION`) of an agent that needs an action, and the mask of `ACTIONS` that
        its hands allow."""
    def reward(self, agent: int = 1) -> dict[str, Any] | None:
        """Returns the reward terms of the last action of an agent: `delivered`, `progress_m`, `is_invalid`; `None` before
        the first one."""
    def score(self) -> dict[str, Any]:
        """Returns the score so far: `frame`, `delivered`, `wanted`, `complete`; TR is `delivered / wanted`."""
    def take_events(self) -> list[dict[str, Any]]:
        """Returns the events since the last call (docs/reference/trace.md)."""
    def digest(self) -> str:
        """Returns the digest of the world's state."""
    def snapshot(self) -> Snapshot:
        """Copies the episode with its agents."""
    def restore(self, snapshot: Snapshot) -> None:
        """Replaces the state by a snapshot of the same episode."""
    def render(
        self,
        agent: int | None = None,
        camera: Mapping[str, Any] | None = None,
        image_size: int | None = None,
        images: Sequence[str] | None = None,
    ) -> dict[str, NDArray[Any]]:
        """Renders the view of an agent, by default the helper if there is one, or of a camera (a dictionary as
        `Observation.camera`). `image_size` is the width and height of an agent's view, 512 by default; a camera has its
        own. Returns arrays by name: `rgb`, `depth`, `ids`. The method ignores grants; agents use `observe`."""
    def floor_plan(self, width: int = 640) -> NDArray[np.uint8]:
        """Draws the top view, uint8 [height, width, 3]."""
    def show(self) -> None:
        """Shows the top view in the notebook or the browser."""
    def _repr_png_(self) -> bytes:
        """Returns the picture for notebooks, as PNG."""

@final
class Batch:
    """Worlds that run in parallel on all cores. The agents that the caller controls are the slots of the batch, in
    the order of worlds and agents."""
    def __new__(
        cls,
        episodes: Sequence[Episode],
        seeds: Sequence[int],
        *,
        helper: str = "caller",
        partner: str = "rules",
        rules: str = "paper",
        set: Sequence[str] = ...,
        grants: Sequence[str] = ...,
        images: Sequence[str] = ...,
        image_size: int = 128,
        partner_image_size: int | None = None,
        appearance: str = "canonical",
        perception: str = "gt",
        behavior: str = "gt",
    ) -> Self: ...
    @property
    def slots(self) -> list[tuple[int, int]]:
        """World and agent of each slot."""
    def __len__(self) -> int: ...
    def reset(
        self, worlds: Sequence[int], episodes: Sequence[Episode], seeds: Sequence[int]
    ) -> None:
        """Starts other episodes in some worlds, on all cores."""
    def advance(self) -> NDArray[np.uint8]:
        """Runs all worlds until a slot needs an action or the episode ends; returns 0 for a world that needs an action
        and 1 for one that has ended."""
    def advance_and_observe(
        self,
        rgb: NDArray[np.uint8] | None = None,
        depth: NDArray[np.float32] | None = None,
        ids: NDArray[np.uint16] | None = None,
    ) -> NDArray[np.uint8]:
        """Advances and observes in one pass, which is faster: `advance`, then `observe` of the slots that have not been
        observed in this turn. Returns the outcomes as `advance` does. Pass the same arrays each time."""
    def observe(
        self,
        rgb: NDArray[np.uint8] | None = None,
        depth: NDArray[np.float32] | None = None,
        ids: NDArray[np.uint16] | None = None,
    ) -> list[int]:
        """Renders the requested images of all slots that need an action into arrays: color (uint8 [slots, size, size,
        3]), depth (float32 meters [slots, size, size]) and ids (uint16 [slots, size, size]). Returns these slots;
        the arrays of other slots do not change."""
    def proprioception(self, values: NDArray[np.float32], mask: NDArray[np.bool_]) -> None:
        """Writes proprioception (`PROPRIOCEPTION`, float32 [slots, 12]) and the mask of `ACTIONS` that the hands allow
        (bool [slots, 11]) of all observed slots."""
    def submit(self, actions: NDArray[np.int64]) -> None:
        """Sets the next actions of all slots that need one: int64 [slots, 3], rows of kind (`ACTIONS`), column and row
        of a pixel. Rows of other slots are ignored."""
    def frames(self) -> NDArray[np.uint32]:
        """Returns the number of frames that have passed in each world."""
    def rewards(self, weights: dict[str, float]) -> NDArray[np.float64]:
        """Returns the reward of the last action of each slot, float64 [slots]; zeros before the first action. The
        names of the weights are those of `REWARD`."""
    def progress(self) -> NDArray[np.float64]:
        """Returns the delivered and the wanted amount of each world, float64 [worlds, 2]; TR is their ratio."""
    def score(self, world: int) -> dict[str, Any]:
        """Returns the score of a world so far, as `World.score`."""
    def briefing(self, world: int, agent: int = 1) -> Briefing:
        """Returns the briefing of an agent of a world."""
    def digest(self, world: int) -> str:
        """Returns the digest of the state of a world."""

@final
class PlanningAgent:
    """Built-in helper that Python code asks for actions."""
    def __new__(
        cls,
        name: str,
        perception: str = "gt",
        behavior: str = "gt",
        *,
        rules: str = "paper",
        set: Sequence[str] = ...,
    ) -> Self: ...
    @property
    def grants(self) -> list[str]:
        """Required grants."""
    def reset(self, briefing: Briefing) -> None:
        """Starts an episode."""
    def sensors(self) -> dict[str, Any]:
        """Returns the requested sensors: `image_size`, `rgb`, `depth`, `ids`, `frame_history`."""
    def act(self, observation: Observation) -> _Action:
        """Returns the next action."""
    def thought(self) -> str:
        """Returns its current plan as text."""

@final
class Planner:
    """Perception, memory and execution of the built-in helpers; the caller chooses the plans."""
    def __new__(
        cls,
        perception: str = "gt",
        image_size: int = 512,
        behavior: str = "gt",
        *,
        rules: str = "paper",
        set: Sequence[str] = ...,
    ) -> Self: ...
    @property
    def grants(self) -> list[str]:
        """Required grants."""
    @property
    def images(self) -> list[str]:
        """Required images."""
    def reset(self, briefing: Briefing) -> None:
        """Starts an episode."""
    def act(self, observation: Observation) -> _Action | None:
        """Processes an observation; returns the next action of the current plan, or `None` if the caller must choose a
        plan (`plans`, `choose`)."""
    def observe(self, observation: Observation) -> None:
        """Updates the memory from an observation, without a decision."""
    def plans(self) -> list[str]:
        """Returns the valid plans as text, those of one kind by distance; empty while a plan is executed."""
    def plan_features(self) -> NDArray[np.float32]:
        """Returns the valid plans as vectors (`PLAN_FEATURES`), float32 [plans, 14]."""
    def semantic_map(self, side: int = 64, cell_m: float = 0.25) -> NDArray[np.uint8]:
        """Draws the memory as an egocentric top view, heading up: uint8 [channels, side, side], with the channels of
        `MAP`."""
    def choose(self, index: int) -> _Action | None:
        """Chooses a plan; returns its first action, or `None` if it can't be executed and another must be chosen."""
    def remembered_objects(self) -> list[dict[str, Any]]:
        """Returns the remembered objects: `name`, `class`, `position` in the world (meters), `last_seen` (frame), and
        `is_present` by current knowledge."""

@final
class Detector:
    """Object detector for images of color and depth."""
    def __new__(cls, weights: bytes | None = None) -> Self: ...
    def detect(self, observation: Observation) -> list[dict[str, Any]]:
        """Detects objects in an observation of color and depth: dictionaries with `class` (`None` for people), `score`
        and `mask`, bool [height, width]."""

def classes() -> list[str]:
    """Returns the names of all classes of the catalogue, by class index."""
def tasks() -> list[str]:
    """Returns the names of all tasks, the paper's eight first."""
def episode_ids(split: str, task: str) -> list[str]:
    """Returns the episode ids of a task in a split: `train`, `test`, `standard`, `gen:A..B` or
    `gen-standard:A..B`. A split of more than 10 million episodes raises `ValueError`."""
def encode_png(rgb: NDArray[np.uint8]) -> bytes:
    """Encodes a color image, uint8 [height, width, 3], as PNG."""
def weigh_reward(
    delivered: float, progress_m: float, is_invalid: bool, weights: dict[str, float]
) -> float:
    """Returns the reward of an action: the weighted sum of its terms, as in `World.step` and `World.reward`.
    The names of the weights are those of `REWARD`."""
def run_command(arguments: Sequence[str], launcher: Sequence[str]) -> int:
    """Runs the command `chaic` and returns its exit code. The first argument is the name of the program.
    `launcher` is a program with arguments that passes its further arguments to `run_sandbox_stage`."""
def run_sandbox_stage(arguments: Sequence[str]) -> int | None:
    """Runs a stage of a sandbox and returns its exit code; `None` if the arguments are not those of a stage. The
    first argument is the name of the program."""
def evaluate(
    helpers: Sequence[tuple[str, Callable[[], Any] | None]],
    out: str | PathLike[str],
    *,
    granted: Sequence[str],
    images: Sequence[str],
    image_size: int,
    jobs: int,
    resume: bool,
    shard: str | None,
    limit_s: float,
    isolation: Mapping[str, Any] | None,
    on_result: Callable[[str, str, int, float | None], bool],
    options: Mapping[str, Any],
) -> str | None:
    """Plays a run into a folder as `chaic eval` does, and returns the text of its report; `None` if it was stopped
    (`on_result` returned false).

    `helpers` are names, each with a callable that creates a helper for each episode, or `None` for a built-in
    helper. `granted`, `images`, `image_size` and `limit_s` apply to the Python helpers; the run records the last one,
    which the caller enforces. `isolation` describes how to run them in processes of their own."""
def serve(maker: Callable[[], Any], images: Sequence[str], image_size: int, output: int) -> None:
    """Serves helpers that `maker` creates on standard input and the descriptor `output`, until the input is closed."""
def merge(out: str | PathLike[str], runs: Sequence[str | PathLike[str]]) -> str:
    """Merges the shards of a run in a new folder; returns the report. Warns if episode runs are missing."""
