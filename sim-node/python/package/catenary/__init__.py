"""Catenary: a real-time simulation of particles and constraints, in NumPy arrays.

    import catenary

    node = catenary.attach("sim")            # a running `sim-node run`
    for snapshot in node.snapshots():
        print(snapshot.step, snapshot.positions[:, 1].min())

    simulation = catenary.Simulation("curtain")   # the solver in this process
    recording = catenary.open("run.mcap")         # a recording of `recorder record`
    assert catenary.verify("run.mcap").is_identical   # it re-simulates bit for bit

Positions and velocities are read-only arrays without a copy. Lengths are in metres, times in seconds,
masses in kilograms, unless the scene says otherwise.
"""

from __future__ import annotations

from importlib.metadata import version
from os import PathLike, fspath

from catenary._catenary import (
    Action,
    AnchorForces,
    Bends,
    ColliderForces,
    Forces,
    Outcome,
    Snapshot,
    State,
    Topology,
    Verification,
    scene_names,
    verify,
)
from catenary._errors import (
    Error,
    NotRunning,
    RecordingError,
    Rejected,
    SceneError,
    StateError,
    Timeout,
    TooManySnapshots,
)
from catenary._node import Batch, Lockstep, Node
from catenary._recording import Arrays, ForceArrays, Recording, Steps
from catenary._simulation import Simulation

__all__ = [
    "ANCHORED",
    "BEND_SHAPES",
    "CONSTRAINT_KINDS",
    "FROZEN",
    "GRABBED",
    "PINNED",
    "Action",
    "AnchorForces",
    "Arrays",
    "Batch",
    "Bends",
    "ColliderForces",
    "Error",
    "ForceArrays",
    "Forces",
    "Lockstep",
    "Node",
    "NotRunning",
    "Outcome",
    "Recording",
    "RecordingError",
    "Rejected",
    "SceneError",
    "Simulation",
    "Snapshot",
    "State",
    "StateError",
    "Steps",
    "Timeout",
    "TooManySnapshots",
    "Topology",
    "Verification",
    "attach",
    "scene_names",
    "verify",
]

__version__ = version("catenary")

PINNED, GRABBED, ANCHORED, FROZEN = 1, 2, 4, 8
"""Bits of `Snapshot.flags`."""
CONSTRAINT_KINDS = ("structural", "shear", "bend", "tether")
"""Names of the numbers in `Topology.kinds`."""
BEND_SHAPES = ("line", "cell", "hinge")
"""Names of the numbers in `Bends.shapes`."""


def attach(
    name: str = "sim",
    *,
    domain: str | None = None,
    timeout: float = 0.0,
    client_id: int | None = None,
    forces: bool = False,
) -> Node:
    """Attaches to the node that runs under a name, or waits for it for up to `timeout` seconds.

    `domain` is that of `sim-node run --domain`; without it, the environment variable CATENARY_DOMAIN counts.
    `client_id`, below 2^53, names this client in outcomes and recordings; it is random by default. With `forces`,
    each snapshot comes with the forces of its step, which the node then computes until the connection is closed.

    Raises `NotRunning` if there is no such node.
    """
    return Node(name, domain=domain, timeout=timeout, client_id=client_id, forces=forces)


def open(path: str | PathLike[str]) -> Recording:
    """Opens a recording, finished or not. Raises `RecordingError` if it cannot be read."""
    return Recording(fspath(path))
