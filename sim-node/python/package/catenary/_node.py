"""A running node."""

from __future__ import annotations

from collections.abc import Iterator
from types import TracebackType

from catenary import _catenary
from catenary._catenary import Action, Outcome, Snapshot
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

    def snapshots(self) -> Iterator[Snapshot]:
        """Yields each snapshot in turn, beginning with the newest one. Ends when the node ends.

        The loop waits while the node is paused. A program that takes longer for a snapshot than the node
        for a step falls behind, up to 64 snapshots, and then misses some: `snapshot_index` shows it. To see
        only the newest one, call `latest`; to slow the node down to the speed of the program, use
        `lockstep`.
        """
        while True:
            try:
                snapshot = self.next_snapshot(timeout=1.0)
            except Timeout:
                continue
            if snapshot is None:
                return
            yield snapshot
            # Drop it before the wait: a node lends a program only a few.
            del snapshot

    def load(self, scene: str) -> Outcome:
        """Replaces the scene: the name of a built-in one, or a path on the host of the node.

        A scene with another rate begins a new run at step 0 (`Outcome.begins_run`).
        """
        return self.request(Action.load(scene))

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
        last = outcome.step + count - 1
        while self.latest().step < last:
            if self.next_snapshot(timeout) is None:
                raise NotRunning(f"the node ended before step {last}")
        return outcome

    def reset(self) -> Outcome:
        """Puts the initial state in place. The step number continues."""
        return self.request(Action.reset())

    def rewind(self, *, to_step: int | None = None, back_steps: int | None = None) -> Outcome:
        """Puts the nearest kept state at or before a step in place, and continues from it.

        `to_step` is a step of the run, `back_steps` a number of steps back. The step number continues;
        `Outcome.command["to_step"]` names the step of the state.
        """
        return self.request(Action.rewind(to_step=to_step, back_steps=back_steps))

    def batch(self, timeout: float = 5.0) -> Batch:
        """Sends many commands without waiting for each: `with node.batch() as batch: batch.pin(3)`."""
        return Batch(self, timeout)

    def lockstep(self, every: int = 1, *, timeout: float = 10.0) -> Lockstep:
        """Joins the lockstep: `with node.lockstep() as steps: for snapshot in steps: ...`.

        The node publishes a snapshot, waits for the body of the loop, and applies the commands of the body
        before its next step. So the same program gives the same states in every run, at any speed. With
        `every`, the program takes part at the steps that are multiples of it. `timeout` is the longest wait
        for the node's admission, in seconds. Attach with a fixed `client_id` to keep the order among several
        members.
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
    """Commands that are sent at once and answered later. Each method returns a sequence number."""

    def __init__(self, node: Node, timeout: float) -> None:
        self._node = node
        self._timeout = timeout
        self._sequences: list[int] = []
        self.outcomes: list[Outcome] = []
        """Outcomes in the order of sending, after the `with` block."""

    def _perform(self, action: Action) -> int:
        sequence = self._node.send(action)
        self._sequences.append(sequence)
        return sequence

    def wait(self) -> list[Outcome]:
        """Waits for the outcomes of all commands so far, applied or rejected, and returns them."""
        while self._sequences:
            self.outcomes.append(self._node.outcome(self._sequences[0], self._timeout))
            del self._sequences[0]
        return self.outcomes

    def __enter__(self) -> Batch:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if kind is None:
            self.wait()


class Lockstep(Commands[int], _catenary.Lockstep):
    """A membership in the lockstep: an iterator of snapshots that the node waits at.

    Its commands take effect in the step after the snapshot. They return a sequence number at once; a rejected
    command raises `Rejected` at the next snapshot. `outcomes` has the outcomes that came with the snapshot.
    """

    def _perform(self, action: Action) -> int:
        return self.send(action)
