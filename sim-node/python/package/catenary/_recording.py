"""Recordings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from types import TracebackType
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from catenary import _catenary
from catenary._catenary import Forces, Snapshot


class Recording(_catenary.Recording):
    """A recording. Its keys are steps: `recording[480]`, `recording[240:480:4]`.

    A recording of every n-th step, or one with losses, lacks some steps: a single step that is missing raises
    `KeyError`, and a slice leaves it out. `len(recording)` counts the snapshots; it reads the file once.
    """

    @overload
    def __getitem__(self, key: int) -> Snapshot: ...
    @overload
    def __getitem__(self, key: slice) -> Steps: ...
    def __getitem__(self, key: int | slice) -> Snapshot | Steps:
        if isinstance(key, slice):
            return Steps(self, self._range(key))
        if key not in self:
            raise KeyError(
                f"{self.path} has no step {key} (it has {self.first_step} to {self.last_step})"
            )
        return self.at_or_before(key)

    def __contains__(self, step: object) -> bool:
        if not isinstance(step, int) or not self.first_step <= step <= self.last_step:
            return False
        return self.step_at(step) == step

    def __len__(self) -> int:
        return self._count

    @cached_property
    def _count(self) -> int:
        return sum(1 for _ in self[:]._steps())

    def __bool__(self) -> bool:
        # Without a look at the length, which reads the file.
        return True

    def at(self, time: float) -> Snapshot:
        """Returns the last snapshot up to a simulated time in seconds since step 0.

        Raises `ValueError` for a time before the first or after the last recorded step.
        """
        first, last = self.first_step / self.rate, self.last_step / self.rate
        # Times of steps are rounded down to nanoseconds.
        rounding = 1e-9 + 1e-6 / self.rate
        if not first - rounding <= time <= last + rounding:
            raise ValueError(f"the time is {time} (allowed: {first:.6g} to {last:.6g} seconds)")
        return self.at_or_before(int((time + rounding) * self.rate))

    def __iter__(self) -> Iterator[Snapshot]:
        return iter(self[:])

    def to_numpy(self, start: int | None = None, stop: int | None = None, every: int = 1) -> Arrays:
        """Reads the snapshots of a range of steps into arrays. `stop` itself is not included.

        Raises `ValueError` for a range without a snapshot.
        """
        return self[start:stop:every].to_numpy()

    @cached_property
    def _all_outcomes(self) -> list[dict[str, Any]]:
        # Reads the file once.
        return self.outcomes()

    def __enter__(self) -> Recording:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _range(self, key: slice) -> range:
        every = 1 if key.step is None else key.step
        if every < 1:
            raise ValueError(f"the step of the slice is {every} (allowed: 1 or more)")
        start = self.first_step if key.start is None else key.start
        stop = self.last_step + 1 if key.stop is None else key.stop
        if start < 0 or stop < 0:
            raise ValueError("steps count from 0, so a slice has no negative ends")
        return range(start, min(stop, self.last_step + 1), every)


@dataclass
class Arrays:
    """The snapshots of a range of steps."""

    steps: npt.NDArray[np.uint64]
    """Steps. Shape: (snapshots,)."""
    times: npt.NDArray[np.float64]
    """Simulated times in seconds. Shape: (snapshots,)."""
    hashes: npt.NDArray[np.uint64]
    """State hashes. Shape: (snapshots,)."""
    positions: npt.NDArray[np.float32]
    """Positions in metres. Shape: (snapshots, particles, 3)."""
    velocities: npt.NDArray[np.float32]
    """Velocities in metres per second. Shape: (snapshots, particles, 3)."""
    commands: list[dict[str, Any]]
    """Outcomes of the commands from the first to the last of these steps, as in `Recording.outcomes()`. The `step` of
    each is the first that shows its effect; `Action.from_dict` returns its action."""
    forces: ForceArrays | None
    """Forces of the steps. None if the recording has none: it was made without `--forces`."""


@dataclass
class ForceArrays:
    """The forces of a range of steps, with the names of `recorder export --npz`.

    Impulses are in N s, angular impulses in N m s: times steps per second, they are forces and torques. They are NaN,
    and contacts 0, where the recording has none, as in its first step, or where a particle was not fixed.
    """

    collider_impulses: npt.NDArray[np.float32]
    """Impulses on each collider. Shape: (snapshots, colliders, 3)."""
    collider_angular_impulses: npt.NDArray[np.float32]
    """Angular impulses about the center of each collider. Shape: (snapshots, colliders, 3)."""
    collider_contacts: npt.NDArray[np.uint32]
    """Largest number of particles in contact in one substep. Shape: (snapshots, colliders)."""
    anchor_impulses: npt.NDArray[np.float32]
    """Impulses on each anchor. Shape: (snapshots, anchors, 3)."""
    anchor_angular_impulses: npt.NDArray[np.float32]
    """Angular impulses about the center of each anchor. Shape: (snapshots, anchors, 3)."""
    fixed_particles: npt.NDArray[np.uint32]
    """Indices of the particles that are pinned, grabbed or anchored in any of the steps. Shape: (P,)."""
    fixed_impulses: npt.NDArray[np.float32]
    """Impulses on each of `fixed_particles`. Shape: (snapshots, P, 3)."""


class Steps:
    """The snapshots of a range of steps, read one by one as a loop reaches them."""

    def __init__(self, recording: Recording, steps: range) -> None:
        self._recording = recording
        self._range = steps

    def __iter__(self) -> Iterator[Snapshot]:
        return map(self._recording.at_or_before, self._steps())

    def _steps(self) -> Iterator[int]:
        step: int | None = self._first()
        while step is not None and step < self._range.stop:
            if (step - self._range.start) % self._range.step == 0:
                yield step
            step = self._recording.step_after(step)

    def _first(self) -> int | None:
        start = self._range.start
        found = self._recording.step_at(start)
        return found if found >= start else self._recording.step_after(found)

    def to_numpy(self) -> Arrays:
        """Reads all of the snapshots into arrays. Raises `ValueError` if there are none."""
        steps = np.array(list(self._steps()), np.uint64)
        if not steps.size:
            recording, wanted = self._recording, self._range
            raise ValueError(
                f"{recording.path} has no snapshot in the steps from {wanted.start} up to {wanted.stop} (it has "
                f"{recording.first_step} to {recording.last_step})"
            )
        shape = (len(steps), self._recording.particle_count, 3)
        arrays = Arrays(
            steps=steps,
            times=np.empty(len(steps), np.float64),
            hashes=np.empty(len(steps), np.uint64),
            positions=np.empty(shape, np.float32),
            velocities=np.empty(shape, np.float32),
            commands=self._commands(int(steps[0]), int(steps[-1])),
            forces=_stacked([self._recording._forces(int(step)) for step in steps]),
        )
        for index, snapshot in enumerate(self):
            arrays.times[index] = snapshot.time
            arrays.hashes[index] = snapshot.hash
            arrays.positions[index] = snapshot.positions
            arrays.velocities[index] = snapshot.velocities
        return arrays

    def _commands(self, first: int, last: int) -> list[dict[str, Any]]:
        return [row for row in self._recording._all_outcomes if first <= row["step"] <= last]


def _stacked(steps: list[Forces | None]) -> ForceArrays | None:
    """The forces of each step in arrays. None if no step has any."""
    known = [(index, forces) for index, forces in enumerate(steps) if forces is not None]
    if not known:
        return None
    one = known[0][1]
    fixed = np.unique(np.concatenate([forces.particles for _, forces in known]))
    vectors = {name: np.full((len(steps), count, 3), np.nan, np.float32) for name, count in {
        "collider_impulses": len(one.colliders),
        "collider_angular_impulses": len(one.colliders),
        "anchor_impulses": len(one.anchors),
        "anchor_angular_impulses": len(one.anchors),
        "fixed_impulses": len(fixed),
    }.items()}
    contacts = np.zeros((len(steps), len(one.colliders)), np.uint32)
    for index, forces in known:
        vectors["collider_impulses"][index] = forces.colliders.impulse
        vectors["collider_angular_impulses"][index] = forces.colliders.angular_impulse
        vectors["anchor_impulses"][index] = forces.anchors.impulse
        vectors["anchor_angular_impulses"][index] = forces.anchors.angular_impulse
        vectors["fixed_impulses"][index, np.searchsorted(fixed, forces.particles)] = forces.impulses
        contacts[index] = forces.colliders.contacts
    return ForceArrays(collider_contacts=contacts, fixed_particles=fixed, **vectors)
