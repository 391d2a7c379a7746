"""A running node."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from os import PathLike
from types import TracebackType

import numpy.typing as npt

from catenary import _catenary
from catenary._catenary import Action, Outcome, Snapshot, State
from catenary._commands import Commands
from catenary._errors import NotRunning, Timeout


class Node(Commands[Outcome], _catenary.Node):
    """A connection to a running node: reads its snapshots and sends commands.

    Each command waits for its outcome and returns it, or raises `Rejected` with the reason. `send` does not
    wait, and `batch` waits for many commands at once.

    A node that ends takes its snapshots with it, but the connection stays: when another node takes the name,
    the next call reads from it.
    """

    def _perform(self, action: Action) -> Outcome:
        return self.request(action)

    def _perform_all(self, actions: list[Action]) -> Outcome:
        """Performs the first action of a command that takes several, such as a long path, then the others in a batch."""
        outcome = self._perform(actions[0])
        if len(actions) == 1:
            return outcome
        # The batch raises `Rejected` for the first command that is rejected.
        with self.batch() as batch:
            for action in actions[1:]:
                batch._perform(action)
        return outcome

    def snapshots(self) -> Iterator[Snapshot]:
        """Yields each snapshot in turn, beginning with the newest one. Ends when the node ends.

        Each loop has a queue of its own, and waits while the node is paused. A program that takes longer for a
        snapshot than the node for a step falls behind, up to 64 snapshots, and then misses some:
        `snapshot_index` shows it. To see only the newest one, call `latest`; to slow the node down to the
        speed of the program, use `lockstep`.
        """
        reader = self.another()
        try:
            while True:
                try:
                    snapshot = reader.next_snapshot(timeout=1.0)
                except Timeout:
                    continue
                if snapshot is None:
                    return
                yield snapshot
                # Drop it before the wait: a node lends a program only a few.
                del snapshot
        finally:
            reader.close()

    def _shown(self, outcome: Outcome, last: int | None = None, timeout: float = 5.0) -> Outcome:
        """Waits until the state of a step is published: that of the outcome, or a later one."""
        step = outcome.step if last is None else last
        while not outcome.begins_run and self.latest().step < step:
            if self.next_snapshot(timeout) is None:
                raise NotRunning(f"the node ended before step {step}")
        return outcome

    def load(self, scene: str | PathLike[str]) -> Outcome:
        """Replaces the scene: the name of a built-in one, or a path on the host of the node.

        A scene with another rate begins a new run at step 0 (`Outcome.begins_run`).

        Raises `SceneError` for a scene that is wrong or cannot be read.
        """
        return self._shown(self.request(Action.load(scene)))

    def pause(self) -> Outcome:
        """Pauses the node before its next step."""
        return self.request(Action.pause())

    def resume(self) -> Outcome:
        """Resumes a paused node."""
        return self.request(Action.resume())

    def step(self, count: int = 1, timeout: float = 60.0) -> Outcome:
        """Makes a paused node perform `count` steps, and returns when the last one is published.

        `latest` then returns its snapshot.
        """
        outcome = self.request(Action.step(count))
        return self._shown(outcome, outcome.step + count - 1, timeout)

    def reset(self) -> Outcome:
        """Puts the initial state in place. The step number continues.

        A running node goes on at once. For episodes that repeat bit for bit, reset within `lockstep`.
        """
        return self._shown(self.request(Action.reset()))

    def rewind(self, *, to_step: int | None = None, back_steps: int | None = None) -> Outcome:
        """Puts the nearest kept state at or before a step in place, and continues from it.

        `to_step` is a step of the run, `back_steps` a number of steps back. The step number continues;
        `Outcome.command["to_step"]` names the step of the state.
        """
        return self._shown(self.request(Action.rewind(to_step=to_step, back_steps=back_steps)))

    def restore(self, state: State | Snapshot, timeout: float = 5.0) -> Outcome:
        """Puts a state in place, and continues from it. `latest` then returns its snapshot, or a later one.

        A `State` replaces everything. A `Snapshot` replaces only positions and velocities.
        """
        return self._shown(super().restore(state, timeout))

    def set_motion(
        self, positions: npt.ArrayLike, velocities: npt.ArrayLike, timeout: float = 5.0
    ) -> Outcome:
        """Replaces the positions and velocities of all particles. Shape of both: (particles, 3)."""
        return self._shown(super().set_motion(positions, velocities, timeout))

    def batch(self, timeout: float = 5.0) -> Batch:
        """Sends many commands without waiting for each: `with node.batch() as batch: batch.pin(3)`."""
        return Batch(self, timeout)

    def lockstep(self, every: int = 1, *, timeout: float = 10.0) -> Lockstep:
        """Joins the lockstep: `with node.lockstep() as steps: for snapshot in steps: ...`.

        The node publishes a snapshot, waits for the body of the loop, and applies the commands of the body
        before its next step. So the same program gives the same states in every run, at any speed, from
        `steps.reset()` on. With `every`, the program takes part in every `every`-th step, counted from the first
        snapshot, and again from each reset, load, rewind and restored state. `timeout` is the longest wait for the
        node's admission, in seconds. Attach with a fixed `client_id` to keep the order among several members.
        """
        return Lockstep(self, every, timeout=timeout)

    def __enter__(self) -> Node:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


class Batch(Commands[int]):
    """Commands that are sent at once and answered later. Each method returns a sequence number.

    The end of the `with` block waits for all outcomes, and raises `Rejected` if there is a rejected one;
    `outcomes` has all of them, in the order of sending.
    """

    PENDING_MAX = 128
    """Most commands without an outcome. A node keeps 256 of a client."""

    def __init__(self, node: Node, timeout: float) -> None:
        self._node = node
        self._timeout = timeout
        self._pending: deque[int] = deque()
        self.outcomes: list[Outcome] = []

    def _perform(self, action: Action) -> int:
        if len(self._pending) == self.PENDING_MAX:
            self._receive()
        sequence = self._node.send(action)
        self._pending.append(sequence)
        return sequence

    def _receive(self) -> None:
        self.outcomes.append(self._node.outcome(self._pending[0], self._timeout))
        self._pending.popleft()

    def wait(self) -> list[Outcome]:
        """Waits for the outcomes of all commands so far, applied or rejected, and returns them."""
        while self._pending:
            self._receive()
        return self.outcomes

    def __enter__(self) -> Batch:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if kind is not None:
            return
        for outcome in self.wait():
            outcome.require_applied()


class Lockstep(Commands[int], _catenary.Lockstep):
    """A membership in the lockstep: an iterator of snapshots that the node waits at.

    Its commands take effect in the step after the snapshot; those before the first snapshot show in it. They
    return a sequence number at once; a rejected command raises `Rejected` at the next snapshot. `outcomes` has the
    outcomes that came with the snapshot.
    """

    def _perform(self, action: Action) -> int:
        return self.send(action)

    def reset(self) -> int:
        """Puts the initial state in place: the next snapshot shows it. The step number continues."""
        return self.send(Action.reset())

    def rewind(self, *, to_step: int | None = None, back_steps: int | None = None) -> int:
        """Puts the nearest kept state at or before a step in place: the next snapshot shows it. See `Node.rewind`."""
        return self.send(Action.rewind(to_step=to_step, back_steps=back_steps))

    def load(self, scene: str | PathLike[str]) -> int:
        """Replaces the scene: the next snapshot shows its initial state. See `Node.load`."""
        return self.send(Action.load(scene))
