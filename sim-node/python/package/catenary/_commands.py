"""Commands, with the same names and arguments for nodes, lockstep members and simulations."""

from __future__ import annotations

from abc import ABC, ABCMeta, abstractmethod
from collections.abc import Iterable, Mapping
from os import PathLike
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeAlias, TypeVar, Union

from catenary._catenary import Action
from catenary._types import Vector

Result = TypeVar("Result")
Value: TypeAlias = Union[float, Vector, Mapping[str, float], Mapping[int, float], None]
"""The value of a parameter: a number, three numbers, None for off, or numbers by kind, block or collider."""


class PlainCommands(ABC, Generic[Result]):
    """The commands that are one action, with the arguments of the action."""

    @abstractmethod
    def _perform(self, action: Action) -> Result:
        """Performs the action of a command."""

    def pin(self, particle: int) -> Result:
        """Holds a particle in place."""
        return self._perform(Action("pin", particle=particle))

    def unpin(self, particle: int) -> Result:
        """Frees a pinned particle. It starts at rest."""
        return self._perform(Action("unpin", particle=particle))

    def grab(self, particle: int, target: Vector, over: float = 1 / 60) -> Result:
        """Grabs a particle and moves it along a straight line to `target`.

        `over` is the time to the target, from 0 to 3600 s. The particle follows only this client until
        `release`, or until the client ends.
        """
        return self._perform(Action("grab", particle=particle, target=target, over_s=over))

    def move(self, particle: int, target: Vector, over: float = 1 / 60) -> Result:
        """Sets a new target for a particle that this client has grabbed. See `grab`."""
        return self._perform(Action("move", particle=particle, target=target, over_s=over))

    def release(self, particle: int, *, force: bool = False) -> Result:
        """Releases a grabbed particle with its velocity. `force` also ends the grab of another client."""
        return self._perform(Action("release", particle=particle, force=force))

    def push(
        self, center: Vector, radius: float, delta: Vector, *, limit: float | None = None
    ) -> Result:
        """Sets the velocity of each free particle within `radius` of `center`.

        In the next step, these particles move by `delta`, in metres. `limit` bounds the magnitude of each
        component of `delta`.
        """
        return self._perform(Action("push", center=center, radius=radius, delta=delta, limit=limit))

    def cut(self, constraint: int) -> Result:
        """Tears a constraint."""
        return self._perform(Action("cut", constraint=constraint))

    def cut_radius(self, center: Vector, radius: float) -> Result:
        """Tears each constraint with an end within `radius` of `center`."""
        return self._perform(Action("cut_radius", center=center, radius=radius))

    def cut_segment(
        self, start: Vector, end: Vector, direction: Vector = (0.0, 0.0, 1.0)
    ) -> Result:
        """Tears each constraint that crosses the segment, extended to both sides along `direction`."""
        ends = {"from": start, "to": end}
        return self._perform(Action("cut_segment", **ends, direction=direction))

    def move_anchor(
        self,
        anchor: int,
        translation: Vector,
        rotation: Vector = (0.0, 0.0, 0.0, 1.0),
        over: float = 0.0,
    ) -> Result:
        """Moves an anchor of the scene to a pose relative to the loaded one. It stays there.

        `rotation` is a quaternion x, y, z, w. `over` is the time to the pose, up to 3600 s, and at least one step.
        """
        pose = {"translation": translation, "rotation": rotation}
        return self._perform(Action("move_anchor", anchor=anchor, **pose, over_s=over))

    def move_collider(
        self,
        collider: int,
        translation: Vector,
        rotation: Vector = (0.0, 0.0, 0.0, 1.0),
        over: float = 0.0,
    ) -> Result:
        """Moves a collider to a pose relative to the loaded one.

        Particles in contact feel the velocity of the motion. `rotation` is a quaternion x, y, z, w. `over` is the time
        to the pose, up to 3600 s, and at least one step.
        """
        pose = {"translation": translation, "rotation": rotation}
        return self._perform(Action("move_collider", collider=collider, **pose, over_s=over))

    def drive_body(
        self,
        collider: int,
        translation: Vector,
        rotation: Vector = (0.0, 0.0, 0.0, 1.0),
        *,
        velocity: Vector = (0.0, 0.0, 0.0),
        angular_velocity: Vector = (0.0, 0.0, 0.0),
        force: Vector = (0.0, 0.0, 0.0),
        torque: Vector = (0.0, 0.0, 0.0),
    ) -> Result:
        """Moves a body of another program through the next step, from a pose relative to the loaded one.

        The collider has a `body` in the scene, with mass and inertia. Within the step gravity, force (N), torque
        (N m) and contacts change its velocity (m/s) and angular velocity (rad/s), which are those at the start
        of the step. The row of the collider in the forces of the step has the impulse of the contacts, for your
        own body. In a step without this command the body stands.
        """
        return self._perform(
            Action(
                "drive_body",
                collider=collider,
                translation=translation,
                rotation=rotation,
                velocity=velocity,
                angular_velocity=angular_velocity,
                force=force,
                torque=torque,
            )
        )

    def mark(self, text: str) -> Result:
        """Marks the step in recordings. Changes nothing else."""
        return self._perform(Action("mark", text=text))


class Commands(PlainCommands[Result]):
    """The commands. Each of them takes effect before the next step."""

    def follow(
        self,
        object: Literal["particle", "anchor", "collider"],
        index: int,
        path: Iterable[Iterable[float]],
        *,
        append: bool = False,
    ) -> Result:
        """Leads a particle that this client has grabbed, an anchor or a collider along points in time.

        `path` is an array of shape (n, 4), with the time in s after this command, x, y and z in each row, or (n, 8)
        with a quaternion x, y, z, w behind them. Points are as those of `grab` and `move_collider`. Times ascend, up to
        3600 s. The object moves linearly from where it is, and stays at the last point. With `append`, the points
        come after those of the motion under way, and their times count from its beginning. At most 2048 points of all
        motions are on their way. Four points are a command, in the order given; the result is the outcome of the first
        command.
        """
        return self._perform_all(Action.follow(object, index, path, append))

    def _perform_all(self, actions: list[Action]) -> Result:
        return [self._perform(action) for action in actions][0]

    def set(self, values: Mapping[str, Value] | None = None, /, **named: Value) -> Result:
        """Sets parameters by name, such as `set(gravity=(0, 0, 0), damping=0.5)`. None turns one off.

        A name with a dot stands in a dict: `set({"wind.drag": 0.3, "contact.friction": 0.2})`.
        `compliance` and `stiffness` take a number for all constraints, or a dict with a number for each kind,
        such as `{"shear": 0.5}`. `bending` replaces the rigidity of all bends, or with a dict that of the bends of
        some generated blocks, such as `{1: 1e-3}` for the second one. `friction` and `restitution` change all
        colliders, or with a dict some of them, such as `{2: 0.3}`. Each value is a command of its own, in the order
        given; the result is the outcome of the last command.
        """
        all_values = {**(values or {}), **named}
        actions = [action for name, value in all_values.items() for action in _settings(name, value)]
        if not actions:
            raise TypeError("give at least one parameter, such as set(damping=0.5)")
        return [self._perform(action) for action in actions][-1]


class Constructors(PlainCommands[Action]):
    """The static methods of `Action`: each returns the action of a command."""

    def _perform(self, action: Action) -> Action:
        return action

    def follow(
        self, object: str, index: int, path: Iterable[Iterable[float]], append: bool = False
    ) -> list[Action]:
        return Action._follow(object, index, [[float(one) for one in row] for row in path], append)

    def set(
        self,
        parameter: str,
        value: float | Vector | None,
        kind: str | None = None,
        block: int | None = None,
        collider: int | None = None,
    ) -> Action:
        part = {"constraint_kind": kind, "block": block, "collider": collider}
        return Action("set", parameter=parameter, value=value, **part)

    def load(self, scene: str | PathLike[str]) -> Action:
        return Action("load", scene=scene)

    def pause(self) -> Action:
        return Action("pause")

    def resume(self) -> Action:
        return Action("resume")

    def step(self, count: int = 1) -> Action:
        return Action("step", count=count)

    def reset(self) -> Action:
        return Action("reset")

    def rewind(self, *, to_step: int | None = None, back_steps: int | None = None) -> Action:
        if (to_step is None) == (back_steps is None):
            raise ValueError("give either `to_step` or `back_steps`")
        return Action("rewind", to_step=to_step, back_steps=back_steps)


if TYPE_CHECKING:

    class ActionType(ABCMeta, Constructors):
        """The type of `Action`, for type checkers: the constructors are its methods."""


for _name in dir(Constructors):
    if not _name.startswith("_"):
        setattr(Action, _name, staticmethod(getattr(Constructors(), _name)))


# The part of the scene that an index in a dict names.
_PARTS = {
    "bending": "a block, such as {1: 1e-3}",
    "friction": "a collider, such as {2: 0.3}",
    "restitution": "a collider, such as {2: 0.3}",
}


def _settings(name: str, value: Any) -> list[Action]:
    if not isinstance(value, Mapping):
        return [Action.set(name, value)]
    if not value:
        part = _PARTS.get(name, "a kind, such as {'shear': 0.5}")
        raise TypeError(f"`{name}` is empty: give a number for {part}")
    return [_setting_of(name, part, number) for part, number in value.items()]


def _setting_of(name: str, part: Any, value: Any) -> Action:
    """The command for a kind of constraint, a collider or a generated block."""
    if isinstance(part, str):
        return Action.set(name, value, kind=part)
    if "collider" in _PARTS.get(name, ""):
        return Action.set(name, value, collider=part)
    return Action.set(name, value, block=part)
