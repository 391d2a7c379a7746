"""The native part of the module."""

from os import PathLike
from types import TracebackType
from typing import Any, Literal, Self, final

import numpy as np
import numpy.typing as npt

from catenary._commands import ActionType
from catenary._types import Floats, Vector, Wholes

__all__ = [
    "Action",
    "AnchorForces",
    "Bends",
    "ColliderForces",
    "Forces",
    "Lockstep",
    "Node",
    "Outcome",
    "Recording",
    "Simulation",
    "Snapshot",
    "State",
    "Topology",
    "Verification",
    "scene_names",
    "verify",
]

def scene_names() -> list[str]:
    """Returns the names of the built-in scenes."""

def verify(
    path: str | PathLike[str],
    *,
    start: int | None = None,
    stop: int | None = None,
    threads: int = 1,
) -> Verification:
    """Simulates a recording again and compares every state, up to the first difference.

    `start` is the first step to compare, and `stop` the step after the last one. The simulation starts at the
    last complete state up to `start`. `threads` parts of the recording are simulated at the same time. Other threads of
    the interpreter run meanwhile; Ctrl-C ends it.

    Raises `RecordingError` if the file cannot be read, or has no complete state to start from.
    """

@final
class Snapshot:
    """The particles after a step.

    The arrays view the particles without a copy, and are read-only. Each of them keeps the snapshot alive. A
    node lends a program at most 4 snapshots at a time, so keep copies: `snapshot.positions.copy()`.
    """

    @property
    def positions(self) -> Floats:
        """Positions in metres, relative to the origin of the scene. Shape: (particles, 3)."""
    @property
    def velocities(self) -> Floats:
        """Velocities in metres per second. Shape: (particles, 3)."""
    @property
    def inverse_masses(self) -> Floats:
        """Inverse masses in 1/kg; 0 for particles that the step does not move. Shape: (particles,)."""
    @property
    def flags(self) -> Wholes:
        """Sums of PINNED, GRABBED, ANCHORED and FROZEN. Shape: (particles,)."""
    @property
    def step(self) -> int:
        """Number of the step in its run."""
    @property
    def scene_step(self) -> int:
        """Number of steps since the scene was loaded, reset or restored."""
    @property
    def time(self) -> float:
        """Simulated time since step 0, in seconds."""
    @property
    def hash(self) -> np.uint64:
        """Hash of the state: equal states have equal hashes on every machine."""
    @property
    def hash_hex(self) -> str:
        """The hash as recordings write it: 16 hexadecimal digits."""
    @property
    def run_id(self) -> int:
        """Number of the run. Steps begin at 0 in each run."""
    @property
    def snapshot_index(self) -> int:
        """Number of snapshots that the run has published before. A gap shows missed ones."""
    @property
    def topology_revision(self) -> int:
        """Number of the load in this run."""
    @property
    def torn_count(self) -> int:
        """Number of torn constraints."""
    @property
    def outcome_count(self) -> int:
        """Number of outcomes that are part of this state."""
    @property
    def is_paused(self) -> bool:
        """True if the node was paused when it made this step."""
    @property
    def is_replay(self) -> bool:
        """True if `recorder play` publishes it."""
    @property
    def forces(self) -> Forces | None:
        """Forces of the step on colliders, anchors and fixed particles. None if the node did not compute them in this step:
        before its first step, and in steps before the connection that reads them.

        Raises `Error` without `forces=True` in `attach` or `Simulation`, and `RecordingError` if the recording has none
        of this step.
        """
    @property
    def published_at(self) -> float:
        """Time of publication in seconds, on the clock of `time.monotonic`."""
    @property
    def solve_time(self) -> float:
        """Time that the solver took for this step, in seconds."""
    @property
    def wake_lateness(self) -> float:
        """Delay of the start of the step after its deadline, in seconds."""
    def to_bytes(self) -> bytes:
        """Returns the particles as they are published and recorded: 32 bytes each, little-endian."""
    def copy(self) -> Snapshot:
        """Returns the snapshot in the memory of this process, so that it can be kept."""
    def __len__(self) -> int: ...

@final
class Topology:
    """The constraints of a scene, as loaded."""

    @property
    def ends(self) -> Wholes:
        """Indices of the two particles of each constraint. Shape: (constraints, 2)."""
    @property
    def rest_lengths(self) -> Floats:
        """Rest lengths in metres. Shape: (constraints,)."""
    @property
    def compliances(self) -> Floats:
        """Compliances in m/N, or stiffnesses from 0 to 1 with method "pbd". Shape: (constraints,)."""
    @property
    def kinds(self) -> Wholes:
        """Kinds: indices into CONSTRAINT_KINDS. Shape: (constraints,)."""
    @property
    def origin(self) -> tuple[float, float, float]:
        """Origin of all positions, in metres."""
    @property
    def rate(self) -> int:
        """Steps per second."""
    @property
    def method(self) -> Literal["xpbd", "pbd"]:
        """Method of the solver."""
    @property
    def scene_hash(self) -> np.uint64:
        """Hash of the scene: a state belongs to the scene with the same one."""
    def __len__(self) -> int: ...

@final
class Bends:
    """The bends of a scene, as loaded: resistance to curvature.

    With C the sum of c x over the particles of a bend, its energy in J is |C - rest n|^2 rigidity / (2 geometry).
    For the positions p0 to p3 of a hinge, n is the unit vector along the sum of the unit normals of its triangles,
    along (p2 - p1) x (p0 - p1) and (p3 - p1) x (p2 - p1).
    """

    @property
    def particles(self) -> Wholes:
        """Indices of the four particles of each bend. The fourth of a bend of three is its second one again.
        Shape: (bends, 4)."""
    @property
    def coefficients(self) -> Floats:
        """Coefficients c of the particles. The fourth of a bend of three is 0. Shape: (bends, 4)."""
    @property
    def geometries(self) -> Floats:
        """Compliances times rigidities: m² on a surface, m³ on a line. Shape: (bends,)."""
    @property
    def rigidities(self) -> Floats:
        """Bending rigidities of the scene: N m on a surface, N m² on a line. Shape: (bends,)."""
    @property
    def rests(self) -> Floats:
        """C along n at rest in metres; other than 0 only for hinges that are folded at rest. Shape: (bends,)."""
    @property
    def shapes(self) -> Wholes:
        """Shapes: indices into BEND_SHAPES. Shape: (bends,)."""
    @property
    def blocks(self) -> npt.NDArray[np.int32]:
        """Indices of the [[generate]] blocks that they come from; -1 for explicit bends. Shape: (bends,)."""
    def __len__(self) -> int: ...

@final
class Forces:
    """The impulses of a step on colliders, anchors and fixed particles.

    The arrays are copies. An impulse in N s is the mean force over the step times its duration: `newtons` returns
    the force.
    """

    @property
    def step(self) -> int:
        """Number of the step in which the impulses acted."""
    @property
    def rate(self) -> int:
        """Steps per second."""
    @property
    def colliders(self) -> ColliderForces:
        """Impulses of the particles in contact on each collider."""
    @property
    def anchors(self) -> AnchorForces:
        """Impulses on each anchor: the sums of those on its particles."""
    @property
    def particles(self) -> Wholes:
        """Indices of the pinned, grabbed and anchored particles, ascending. Shape: (P,)."""
    @property
    def impulses(self) -> Floats:
        """Impulses of constraints, bends and tethers on each of `particles`, in N s. Shape: (P, 3)."""
    def newtons(self, impulses: npt.ArrayLike) -> Floats:
        """Returns impulses in N s as forces in N, or angular impulses in N m s as torques in N m."""

@final
class ColliderForces:
    """The impulses on colliders, by index."""

    @property
    def impulse(self) -> Floats:
        """Impulses in N s. Shape: (colliders, 3)."""
    @property
    def angular_impulse(self) -> Floats:
        """Angular impulses about the center of the collider, in N m s. Shape: (colliders, 3)."""
    @property
    def contacts(self) -> Wholes:
        """Largest number of particles in contact in one substep. Shape: (colliders,)."""
    def __len__(self) -> int: ...

@final
class AnchorForces:
    """The impulses on anchors, by index."""

    @property
    def impulse(self) -> Floats:
        """Impulses in N s. Shape: (anchors, 3)."""
    @property
    def angular_impulse(self) -> Floats:
        """Angular impulses about the center of the anchor, in N m s. Shape: (anchors, 3)."""
    def __len__(self) -> int: ...

@final
class Outcome:
    """The answer to a command."""

    @property
    def is_applied(self) -> bool:
        """True if the command took effect; False if it was rejected and changed nothing."""
    @property
    def reason(self) -> str | None:
        """Name of the reason of a rejection, such as "unknown_particle"."""
    @property
    def step(self) -> int:
        """First step that shows the effect."""
    @property
    def index(self) -> int:
        """Number of the outcome in its run, without gaps."""
    @property
    def sequence(self) -> int:
        """Number of the command among those of its client."""
    @property
    def client_id(self) -> int:
        """Id of the client that sent the command."""
    @property
    def command(self) -> dict[str, Any]:
        """The command as recordings store it: "kind" and its fields."""
    def require_applied(self) -> None:
        """Raises `Rejected` if the command was rejected."""
    @property
    def begins_run(self) -> bool:
        """True for a load that began a new run."""

@final
class State:
    """A complete state of a scene: it can be pickled, sent to another process and restored."""

    def __new__(cls, scene_hash: int, particles: bytes, keyframe: bytes) -> Self: ...
    @property
    def scene_hash(self) -> np.uint64:
        """Hash of the scene that the state belongs to."""
    @property
    def hash(self) -> np.uint64:
        """Hash of the state, as in `Snapshot.hash`."""
    @property
    def hash_hex(self) -> str:
        """The hash as recordings write it: 16 hexadecimal digits."""
    def __len__(self) -> int: ...
    def __getnewargs__(self) -> tuple[int, bytes, bytes]: ...

@final
class Action(metaclass=ActionType):
    """A command without its sender: `Action("grab", particle=3, target=(0, 1, 0))`, with the fields of recordings.

    The static methods have the names and arguments of the methods of `Commands`, which describe them.
    """

    KINDS: list[str]
    """Names of the kinds of actions."""

    def __new__(cls, kind: str, /, **fields: Any) -> Self: ...
    @staticmethod
    def _follow(object: str, index: int, path: list[list[float]], append: bool) -> list[Action]:
        """Returns the actions that lead an object along points, each a list of 4 or 8 numbers."""
    @staticmethod
    def from_dict(fields: dict[str, Any]) -> Action:
        """Returns the action of a dict such as `Outcome.command`, or of a row of `Recording.outcomes()`."""
    def to_dict(self) -> dict[str, Any]:
        """Returns the action as recordings store it."""
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...

class Node:
    def __new__(
        cls,
        name: str = "sim",
        *,
        domain: str | None = None,
        timeout: float = 0.0,
        client_id: int | None = None,
        forces: bool = False,
    ) -> Self: ...
    def another(self) -> Node:
        """Returns another connection to the same node, with an id and a queue of snapshots of its own."""
    @property
    def client_id(self) -> int:
        """Id of this client in outcomes and recordings."""
    @property
    def is_running(self) -> bool:
        """True if a process runs under the name. Reads the file system: ask a few times per second at most."""
    def close(self) -> None:
        """Detaches. Snapshots that are still held stay valid."""
    def next_snapshot(self, timeout: float | None = None) -> Snapshot | None:
        """Returns the oldest unread snapshot, or waits for the next one. None if the node has ended.

        `latest` reads from the same queue, and skips what is in it; `snapshots` has a queue of its own.

        Raises `Timeout` if none comes in time, and `TooManySnapshots` if the program holds too many.
        """
    def latest(self, timeout: float | None = 5.0) -> Snapshot:
        """Returns the newest snapshot. Waits only for the first one.

        Raises `TooManySnapshots` if the program holds too many to read a newer one.
        """
    def state(self) -> State:
        """Returns the newest complete state, which `restore` puts in place again."""
    def topology(self) -> Topology:
        """Returns the constraints."""
    def bends(self) -> Bends:
        """Returns the bends."""
    def surface(self) -> Wholes:
        """Returns the particles of each triangle of the surface. Shape: (triangles, 3)."""
    def scene(self) -> str:
        """Returns the scene as TOML, with every default written out."""
    def parameters(self) -> dict[str, Any]:
        """Returns the current parameters by name. None is off."""
    def status(self) -> dict[str, Any]:
        """Returns the status of the node, with the keys of `/status` in recordings."""
    def torn(self) -> Wholes:
        """Returns the indices of the torn constraints, in the order of tearing."""
    def colliders(self) -> list[dict[str, Any]]:
        """Returns the colliders in their newest poses."""
    def forces(self, timeout: float | None = 5.0) -> Forces:
        """Returns the newest forces on colliders, anchors and fixed particles. Waits only if none have arrived.

        The node computes them only while a client reads them: the first call waits for the next step, and from then
        on each step costs the node a little more time, until `close`. A paused node has none until its next step, and
        a replay only those of a recording that was made with `--forces`. `snapshot.forces` reads from the same queue:
        a snapshot from before the forces that this returned has none then.

        Raises `Timeout` if there are none in time.
        """
    def send(self, action: Action) -> int:
        """Sends an action without waiting. Returns its sequence number, for `outcome`."""
    def outcome(self, sequence: int, timeout: float | None = 5.0) -> Outcome:
        """Waits for the outcome of a sent action, applied or rejected."""
    def request(self, action: Action, timeout: float | None = 5.0) -> Outcome:
        """Sends an action and waits for its outcome. Raises `Rejected` if it was rejected."""
    def restore(self, state: State | Snapshot, timeout: float = 5.0) -> Outcome:
        """Puts a state in place, and continues from it.

        A `State` replaces everything. A `Snapshot` replaces only positions and velocities.
        """
    def set_motion(
        self, positions: npt.ArrayLike, velocities: npt.ArrayLike, timeout: float = 5.0
    ) -> Outcome:
        """Replaces the positions and velocities of all particles. Shape of both: (particles, 3)."""

class Lockstep:
    def __new__(cls, node: Node, every: int = 1, *, timeout: float = 10.0) -> Self: ...
    @property
    def outcomes(self) -> list[Outcome]:
        """Outcomes that came with the last snapshot."""
    def send(self, action: Action) -> int:
        """Sends an action for the next step. Returns its sequence number."""
    def restore(self, state: State | Snapshot) -> int:
        """Puts a state in place in the next step, which shows it without further changes. Returns the sequence number.

        A `State` replaces everything. A `Snapshot` replaces only positions and velocities.
        """
    def set_motion(self, positions: npt.ArrayLike, velocities: npt.ArrayLike) -> int:
        """Replaces the positions and velocities of all particles in the next step. Shape of both: (particles, 3)."""
    def forces(self) -> Forces | None:
        """Returns the forces of the step of the last snapshot. None if the node has not computed them: the first call makes
        it compute them from the next step on.
        """
    def __enter__(self) -> Self: ...
    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
        /,
    ) -> None: ...
    def __iter__(self) -> Self: ...
    def __next__(self) -> Snapshot: ...

class Simulation:
    def __new__(
        cls,
        scene: str | PathLike[str] | None = None,
        threads: int = 1,
        *,
        toml: str | None = None,
        forces: bool = False,
        record: str | PathLike[str] | None = None,
        overwrite: bool = False,
    ) -> Self: ...
    def step(self, count: int = 1) -> None:
        """Makes `count` steps. Other threads of the interpreter run meanwhile; Ctrl-C ends it between steps."""
    def apply(self, action: Action) -> None:
        """Applies an action before the next step. Raises `Rejected` if it is wrong.

        Actions that concern a node (`pause`, `resume`, `step`, `mark`, a time scale) change nothing here;
        `load`, `rewind` and `restore` are rejected.
        """
    def snapshot(self) -> Snapshot:
        """Returns the current state. It keeps its values when the simulation goes on."""
    @property
    def positions(self) -> Floats:
        """The current positions in metres, as a read-only view of `snapshot()`. Shape: (particles, 3)."""
    @property
    def velocities(self) -> Floats:
        """The current velocities in metres per second, as a read-only view of `snapshot()`. Shape: (particles, 3)."""
    @property
    def hash(self) -> np.uint64:
        """Hash of the current state."""
    @property
    def hash_hex(self) -> str:
        """The hash as recordings write it: 16 hexadecimal digits."""
    @property
    def step_count(self) -> int:
        """Number of steps so far."""
    @property
    def time(self) -> float:
        """Simulated time of these steps, in seconds."""
    @property
    def rate(self) -> int:
        """Steps per second."""
    def scene(self) -> str:
        """Returns the scene as TOML, with every default written out."""
    def topology(self) -> Topology:
        """Returns the constraints."""
    def bends(self) -> Bends:
        """Returns the bends."""
    def surface(self) -> Wholes:
        """Returns the particles of each triangle of the surface. Shape: (triangles, 3)."""
    def parameters(self) -> dict[str, Any]:
        """Returns the current parameters by name. None is off."""
    def torn(self) -> Wholes:
        """Returns the indices of the torn constraints, in the order of tearing."""
    def colliders(self) -> list[dict[str, Any]]:
        """Returns the colliders in their current poses."""
    def forces(self) -> Forces:
        """Returns the forces of the last step on colliders, anchors and fixed particles: all 0 before the first step, and
        in a step that put a state in place.

        Raises `Error` for a simulation that was made without `forces=True`.
        """
    def energy(self) -> dict[str, float]:
        """Returns the energy of the current state by kind: `kinetic`, `potential` (-m g.x, with x from the origin of the scene)
        and `elastic`, in J if the scene is in metres, of the free particles and of the constraints and bends that are not torn.
        """
    def state(self) -> State:
        """Returns the complete state, which `restore` puts in place again.

        Raises `StateError` between a command and the step that shows it.
        """
    def restore(self, state: State | Snapshot) -> None:
        """Puts a state of the same scene in place, and makes the step that shows it. `step_count` continues.

        A `State` replaces everything, a `Snapshot` only positions and velocities. Raises `StateError` if it
        belongs to another scene.
        """
    def set_motion(self, positions: npt.ArrayLike, velocities: npt.ArrayLike) -> None:
        """Replaces the positions and velocities of all particles, and makes the step that shows them. Shape of both:
        (particles, 3).
        """
    def reset(self) -> None:
        """Puts the initial state and parameters in place, and makes the step that shows them. `step_count` continues."""
    def render(
        self,
        *,
        size: tuple[int, int] = ...,
        view: Literal["front", "side", "top", "iso"] | None = None,
        style: Literal["wires", "shaded"] = "wires",
        bounds: tuple[Vector, Vector] | None = None,
    ) -> npt.NDArray[np.uint8]:
        """Returns a picture of the current state as `recorder export --png` draws it, from the top to the bottom: red,
        green and blue. Shape: (height, width, 3).

        `size` is width and height in pixels. `view` is "front", "side", "top" or "iso"; by default it suits the scene.
        The style "wires" shows particles, constraints and triangles, and "shaded" surfaces, each triangle in one shade. `bounds` are two
        corners of the box that the picture shows, by default around the state: give them to keep the camera still.
        """
    def close(self) -> None:
        """Completes the recording, if there is one. The simulation can go on, unrecorded."""
    def __getnewargs_ex__(self) -> tuple[tuple[()], dict[str, Any]]: ...
    def _continue_from(self, state: State, step_count: int) -> None:
        """Puts the state of a pickled or copied simulation in place."""
    def __len__(self) -> int: ...

class Recording:
    def __new__(cls, path: str) -> Self: ...
    @property
    def path(self) -> str:
        """Path of the file."""
    @property
    def first_step(self) -> int:
        """First recorded step."""
    @property
    def last_step(self) -> int:
        """Last recorded step."""
    @property
    def rate(self) -> int:
        """Steps per second."""
    @property
    def scene_name(self) -> str:
        """Name of the scene."""
    @property
    def particle_count(self) -> int:
        """Number of particles."""
    @property
    def run_id(self) -> int:
        """Number of the recorded run."""
    def scene(self) -> str:
        """Returns the scene as TOML."""
    def topology(self) -> Topology:
        """Returns the constraints."""
    def bends(self) -> Bends:
        """Returns the bends."""
    def surface(self) -> Wholes:
        """Returns the particles of each triangle of the surface. Shape: (triangles, 3)."""
    def at_or_before(self, step: int) -> Snapshot:
        """Returns the snapshot of the last recorded step up to `step`, or else the first one."""
    def step_at(self, step: int) -> int:
        """Returns the last recorded step up to `step`, or else the first one."""
    def step_after(self, step: int) -> int | None:
        """Returns the first recorded step after `step`."""
    def torn(self, step: int) -> Wholes:
        """Returns the indices of the constraints that are torn at a step, in the order of tearing."""
    def forces(self, step: int) -> Forces:
        """Returns the forces of a step on colliders, anchors and fixed particles.

        Raises `KeyError` for a step before the first or after the last one, and `RecordingError` if the file has no
        forces of the step: it was made without `--forces`, or no step has led to its first state.
        """
    def _forces(self, step: int) -> Forces | None:
        """Returns the forces of a step, or None if the file has no forces of the step."""
    def render(
        self,
        step: int,
        *,
        size: tuple[int, int] = ...,
        view: Literal["front", "side", "top", "iso"] | None = None,
        style: Literal["wires", "shaded"] = "wires",
        bounds: tuple[Vector, Vector] | None = None,
    ) -> npt.NDArray[np.uint8]:
        """Returns a picture of a recorded step as `recorder export --png` draws it, from the top to the bottom: red,
        green and blue. Shape: (height, width, 3).

        `size` is width and height in pixels. `view` is "front", "side", "top" or "iso"; by default it suits the scene.
        The style "wires" shows particles, constraints and triangles, and "shaded" surfaces, each triangle in one shade. `bounds` are two
        corners of the box that the picture shows, by default around the state: give them to keep the camera still.

        Raises `KeyError` for a step that was not recorded.
        """
    def steps(self) -> dict[str, npt.NDArray[Any]]:
        """Returns a table of all recorded steps, by column: `pandas.DataFrame(recording.steps())`."""
    def outcomes(self) -> list[dict[str, Any]]:
        """Returns the outcomes of all commands, by row: `pandas.DataFrame(recording.outcomes())`."""
    def state(self, step: int) -> State:
        """Returns the complete state after a step, from which a simulation continues with the same bits.

        It is simulated from the last complete state in the file, and compared with every snapshot on the way; a
        step without a snapshot is proved by the next one. Raises `KeyError` for a step before the first or after
        the last one, and `RecordingError` if the file does not lead to the step, as after missing outcomes.
        """
    def close(self) -> None:
        """Closes the file. Snapshots and arrays stay valid."""

@final
class Verification:
    """The result of `verify`."""

    @property
    def is_identical(self) -> bool:
        """True if every compared bit is equal, and the file does not end too early."""
    @property
    def verdict(self) -> Literal["identical", "diverged", "outcome_log_incomplete"]:
        """Result: "identical", "diverged", or "outcome_log_incomplete" if steps that depend on missing outcomes
        could not be compared, and all others are identical.
        """
    @property
    def first_step(self) -> int:
        """Step that the simulation started from."""
    @property
    def last_identical_step(self) -> int | None:
        """Last bit-identical step, if there is one."""
    @property
    def steps_identical(self) -> int:
        """Number of simulated and bit-identical steps."""
    @property
    def gaps(self) -> list[tuple[int, int]]:
        """First and last step of each gap, where outcomes are missing."""
    @property
    def step(self) -> int | None:
        """First step that differs, or that may lack an outcome."""
    @property
    def particle(self) -> int | None:
        """First particle of that step that differs, if its particles do."""
    @property
    def field(self) -> str | None:
        """First field of that particle that differs, such as "position x"."""
    @property
    def what(self) -> str | None:
        """Description of the difference or of the missing outcome."""
    @property
    def end(self) -> str:
        """End of the file, such as "complete"."""
    @property
    def lost(self) -> dict[str, int]:
        """Number of messages that the recording lacks, by topic."""
    @property
    def not_covered(self) -> list[str]:
        """Content that was not compared, because the file has it only once."""
