"""What the Rust part of the package has; docstrings are copied from there by python/stub_docs.py."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

__version__: str
ACTIONS: list[str]
OWN: list[str]
PLAN: list[str]
MAP: list[str]
REWARD: dict[str, float]

#: A string or dictionary as in docs/subprocess-helpers.md, or a row of kind, column and row.
_Action: TypeAlias = str | Mapping[str, Any] | Sequence[int] | NDArray[np.integer[Any]]

@final
class Episode:
    """An episode: a place, what lies there, who takes part, and what the partner wants."""
    def __new__(cls, id: str) -> Self: ...
    @staticmethod
    def from_json(text: str) -> Episode:
        """The episode of a file's text (docs/episodes.md), checked as the file is."""
    @staticmethod
    def from_dict(fields: dict[str, Any]) -> Episode:
        """The episode of such a dictionary, checked as a file is. One that was changed has no `generator`: that
        would promise what its generator keeps."""
    def to_json(self) -> str:
        """As the text of a file."""
    def as_dict(self) -> dict[str, Any]:
        """As the dictionary that its file is written from (docs/episodes.md), to be changed and read again by
        `from_dict`."""
    @property
    def id(self) -> str:
        """Its name."""
    @property
    def task(self) -> str:
        """The name of its task."""
    def plan(self, width: int = 640) -> NDArray[np.uint8]:
        """Seen from above, uint8 [height, width, 3]."""
    def show(self) -> None:
        """Shows the place from above: in a notebook in its cell, elsewhere in the browser."""
    def _repr_png_(self) -> bytes:
        """The picture that notebooks show."""

@final
class Briefing:
    """What an agent is told before an episode (docs/subprocess-helpers.md has the fields)."""
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
    told: dict[str, Any] | None
    def as_dict(self) -> dict[str, Any]:
        """All of it."""

@final
class Observation:
    """What an agent perceives when its action has ended (docs/subprocess-helpers.md has the fields)."""
    @property
    def frame(self) -> int:
        """Frames since the episode began."""
    @property
    def own(self) -> dict[str, Any]:
        """What the agent knows of itself: `pose`, `hands`, `last`, `other_end`."""
    @property
    def camera(self) -> dict[str, Any]:
        """The camera that took the images."""
    @property
    def granted(self) -> dict[str, Any]:
        """What was granted beyond own images and state."""
    @property
    def rgb(self) -> NDArray[np.uint8] | None:
        """Color, uint8 [height, width, 3]; `None` if it wasn't asked for."""
    @property
    def depth(self) -> NDArray[np.float32] | None:
        """Depth along the camera's axis, float32 metres [height, width]; `None` if it wasn't asked for."""
    @property
    def ids(self) -> NDArray[np.uint16] | None:
        """Instance ids, uint16 [height, width]; `None` if they weren't asked for or aren't granted."""
    @property
    def film(self) -> list[dict[str, Any]]:
        """What was seen since the last decision, oldest first, where that was asked for: dictionaries with
        `frame`, `camera`, `rgb` and `depth`."""

@final
class Snapshot:
    """An episode as it stood, with the minds in it."""

@final
class World:
    """An episode under way: a world, the minds in it, and the seats of the caller's (agents 0, the partner, and 1,
    the helper)."""
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
        minds_image_size: int | None = None,
        appearance: str = "canonical",
        perception: str = "gt",
        behavior: str = "gt",
    ) -> Self: ...
    def reset(self, episode: Episode | None = None, seed: int = 0) -> None:
        """Begins another episode, or this one anew."""
    @property
    def episode(self) -> Episode:
        """The episode that is played."""
    @property
    def frame(self) -> int:
        """Frames that have passed; there are 30 to a second."""
    @property
    def horizon(self) -> int:
        """How many frames the episode has."""
    @property
    def is_over(self) -> bool:
        """Whether it is over."""
    def advance(self, until: int | None = None) -> str:
        """Plays on until a choice of the caller's is needed (`"waits"`), the episode has `"ended"`, or the first frame
        at or after `until` in which somebody decides has come (`"stopped"`)."""
    def waiting(self) -> list[int]:
        """The agents whose choices are the caller's and needed now."""
    def briefing(self, agent: int = 1) -> Briefing:
        """What an agent is told before the episode."""
    def observe(self, agent: int = 1) -> Observation:
        """What an agent that waits perceives."""
    def submit(self, action: _Action, agent: int = 1) -> None:
        """Chooses for an agent that waits: a string or dictionary as in docs/subprocess-helpers.md, or a row of
        `ACTIONS` with the column and row of a pixel. It acts once all who wait have chosen."""
    def step(self, action: _Action, agent: int = 1) -> tuple[bool, float, float, bool]:
        """Chooses for the agent that alone waits and plays on, in one call for learners: whether somebody waits, and of
        what came of it the share that was delivered, metres of approach, and whether it failed."""
    def progress(self) -> tuple[float, float]:
        """What is done and what was wanted; TR is their ratio."""
    def own(self, agent: int = 1) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """What an agent that waits knows of itself, as numbers (`OWN`), and which of `ACTIONS` its hands don't
        rule out."""
    def reward(self, agent: int = 1) -> dict[str, Any] | None:
        """What has come of the caller's last choice for an agent, as the terms of a reward: `delivered`,
        `approached_m`, `is_invalid`; `None` before the first one."""
    def score(self) -> dict[str, Any]:
        """The score so far: `frame`, `done`, `total`, `complete`; TR is `done / total`."""
    def take_events(self) -> list[dict[str, Any]]:
        """What happened since this was last asked (docs/reference/trace.md)."""
    def digest(self) -> str:
        """A number that differs between different states of the world, and is the same for equal ones."""
    def snapshot(self) -> Snapshot:
        """All of it as it stands, to go on from later or more than once."""
    def restore(self, snapshot: Snapshot) -> None:
        """Goes back, or on, to a snapshot of the same episode."""
    def render(
        self,
        agent: int | None = None,
        camera: Mapping[str, Any] | None = None,
        image_size: int = 512,
        images: Sequence[str] | None = None,
    ) -> dict[str, NDArray[Any]]:
        """What somebody sees: an agent, or a camera (a dictionary like [`Observation.camera`]). Arrays by name: `rgb`,
        `depth`, `ids`. This is for onlookers; an agent perceives what it is granted."""
    def plan(self, width: int = 640) -> NDArray[np.uint8]:
        """Seen from above, uint8 [height, width, 3]."""
    def show(self) -> None:
        """Shows the world from above: in a notebook in its cell, elsewhere in the browser."""
    def _repr_png_(self) -> bytes:
        """The picture that notebooks show: all from above."""

@final
class Batch:
    """Worlds that are stepped together on all cores. The caller's seats are numbered through all worlds, in the
    order of worlds and agents: its slots."""
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
        minds_image_size: int | None = None,
        appearance: str = "canonical",
        perception: str = "gt",
        behavior: str = "gt",
    ) -> Self: ...
    @property
    def slots(self) -> list[tuple[int, int]]:
        """The world and the agent of each of the caller's seats."""
    def __len__(self) -> int: ...
    def reset(
        self, worlds: Sequence[int], episodes: Sequence[Episode], seeds: Sequence[int]
    ) -> None:
        """Begins other episodes in some of the worlds, on all cores."""
    def advance(self) -> NDArray[np.uint8]:
        """Plays all worlds on until a choice of the caller's is needed or they end: 0 for each that waits, 1 for each
        that has ended."""
    def observe(
        self,
        rgb: NDArray[np.uint8] | None = None,
        depth: NDArray[np.float32] | None = None,
        ids: NDArray[np.uint16] | None = None,
    ) -> list[int]:
        """Lets all who wait look, into arrays for all slots: color (uint8 [slots, size, size, 3]), depth
        (float32 metres [slots, size, size]) and ids (uint16 [slots, size, size]), which the senses asked for. The
        slots that looked; of others, the arrays stay as they are."""
    def own(self, numbers: NDArray[np.float32], mask: NDArray[np.bool_]) -> None:
        """Writes what those who looked know of themselves: numbers (`OWN`, float32 [slots, 12]), and which of
        `ACTIONS` their hands don't rule out (bool [slots, 11])."""
    def submit(self, actions: NDArray[np.int64]) -> None:
        """Chooses for all slots that wait: int64 [slots, 3], rows of kind (`ACTIONS`), column and row of a pixel.
        Rows of other slots aren't looked at."""
    def frames(self) -> NDArray[np.uint32]:
        """Frames that have passed in each world."""
    def rewards(self) -> NDArray[np.float64]:
        """What has come of the last choice for each slot: the share that was delivered meanwhile, metres of approach,
        and whether it failed; float64 [slots, 3], zeros before the first one."""
    def progress(self) -> NDArray[np.float64]:
        """What is done and what was wanted in each world, float64 [worlds, 2]; TR is their ratio."""
    def score(self, world: int) -> dict[str, Any]:
        """The score of a world so far, as `World.score`."""
    def briefing(self, world: int, agent: int = 1) -> Briefing:
        """What the agent of a world is told before its episode."""
    def digest(self, world: int) -> str:
        """A number that differs between different states of a world, and is the same for equal ones."""

@final
class Mind:
    """A built-in helper, asked from Python: what it would do with an observation."""
    def __new__(cls, name: str, perception: str = "gt", behavior: str = "gt") -> Self: ...
    @property
    def grants(self) -> list[str]:
        """The grants that it needs."""
    def reset(self, briefing: Briefing) -> None:
        """Begins an episode."""
    def senses(self) -> dict[str, Any]:
        """Which images it wants: `image_size`, `rgb`, `depth`, `ids`, `film`."""
    def act(self, observation: Observation) -> _Action:
        """What it does next."""
    def thought(self) -> str:
        """What it thinks, in words."""

@final
class Planner:
    """Perception, memory and execution of the built-in helpers, with the choice of plans left to the caller."""
    def __new__(
        cls, perception: str = "gt", image_size: int = 512, behavior: str = "gt"
    ) -> Self: ...
    @property
    def grants(self) -> list[str]:
        """The grants that it needs."""
    @property
    def images(self) -> list[str]:
        """The images that it needs."""
    def reset(self, briefing: Briefing) -> None:
        """Begins an episode."""
    def attend(self, observation: Observation) -> _Action | None:
        """Takes in what is perceived: the next action of the plan that is followed, or `None` if a plan is to be
        chosen (`plans`, `choose`)."""
    def look(self, observation: Observation) -> None:
        """Takes in what is perceived, and decides nothing: for those who want the memory alone."""
    def plans(self) -> list[str]:
        """The plans to choose among, in words, those of one kind nearest first; empty while one is followed."""
    def plan_numbers(self) -> NDArray[np.float32]:
        """The same plans as numbers (`PLAN`), float32 [plans, 14]."""
    def semantic_map(self, side: int = 64, cell_m: float = 0.25) -> NDArray[np.uint8]:
        """What is remembered, seen from above with the own body in the middle, ahead upward: uint8
        [channels, side, side], the channels of `MAP`."""
    def choose(self, index: int) -> _Action | None:
        """Chooses one of the plans: its first action, or `None` if it can't be followed and another is to be chosen."""
    def things(self) -> list[dict[str, Any]]:
        """What it remembers: things with `name`, `class`, `position` in the world (metres), `last_seen` and whether
        it `is_present` as far as it knows."""

@final
class Detector:
    """The detector that comes with chaic: which things are in an image of color and depth."""
    def __new__(cls, weights: bytes | None = None) -> Self: ...
    def detect(self, observation: Observation) -> list[dict[str, Any]]:
        """What an observation of color and depth shows: dictionaries with `class` (`None` for people), `score`, and
        `mask`, bool [height, width]."""

def classes() -> list[str]:
    """The names of all classes of the catalogue, in the order of their numbers."""
def tasks() -> list[str]:
    """The names of all tasks, the paper's eight first."""
def episode_ids(split: str, task: str) -> list[str]:
    """The names of the episodes of a task in a split: `train`, `test`, `standard`, `gen:A..B` or
    `gen-standard:A..B`."""
def encode_png(rgb: NDArray[np.uint8]) -> bytes:
    """A picture as the bytes of a PNG file; color, uint8 [height, width, 3]."""
def run_command(arguments: Sequence[str], launcher: Sequence[str]) -> int:
    """Runs the command `chaic` with these arguments, the first of which is its name; returns its exit code.
    `launcher` is a program with arguments that passes its further arguments to `run_sandbox_stage`."""
def run_sandbox_stage(arguments: Sequence[str]) -> int | None:
    """Runs a stage of a sandbox with these arguments, the first of which is a program's name; returns the exit
    code, or `None` if they are not those of a stage."""
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
    isolation: Mapping[str, Any] | None,
    go_on: Callable[[str, str, int, float | None], bool],
    options: Mapping[str, Any],
) -> str | None:
    """Plays a run into a folder, which the command reads as its own, and gives the text of its report; `None` if it
    was stopped (`go_on` returned false).

    `helpers` are names with what makes a fresh helper for each episode, or `None` for a built-in one; `granted` and
    (`images`, `image_size`) are what the own ones get. `isolation` has how to run these in processes of
    their own."""
def serve(make: Callable[[], Any], images: Sequence[str], image_size: int, output: int) -> None:
    """Serves fresh helpers of `make` on the standard input and the descriptor `output`, until the input is closed."""
def merge(out: str | PathLike[str], runs: Sequence[str | PathLike[str]]) -> str:
    """Joins the shards of a run in a new folder; its report."""
