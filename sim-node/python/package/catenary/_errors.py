"""The exceptions of the module."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from catenary._catenary import Outcome


class Error(Exception):
    """Base class of all exceptions of this module."""


class NotRunning(Error, ConnectionError):
    """No node runs under the name, or it has ended."""


class Timeout(Error, TimeoutError):
    """The node did not answer, or published nothing, within the timeout."""


class Rejected(Error):
    """The node rejected a command, which then changed nothing.

    `reason` is the name of the reason, such as `"unknown_particle"`. `outcome` is the outcome; None for a
    `Simulation`.
    """

    def __init__(self, message: str, reason: str, outcome: Outcome | None = None) -> None:
        super().__init__(message)
        self.reason = reason
        self.outcome = outcome

    def __reduce__(self) -> tuple[type[Rejected], tuple[str, str]]:
        # An exception crosses to another process without its outcome.
        return Rejected, (str(self), self.reason)


class TooManySnapshots(Error):
    """The program holds as many snapshots as a node lends it. Keep copies of arrays instead."""


class SceneError(Error, ValueError):
    """A scene cannot be read. The message names the file, the key and the remedy."""


class StateError(Error, ValueError):
    """A state is damaged, or belongs to another scene."""


class RecordingError(Error, ValueError):
    """A recording cannot be read."""
