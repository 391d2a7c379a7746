"""The solver in this process."""

from __future__ import annotations

from types import TracebackType
from typing import Any

from catenary import _catenary
from catenary._catenary import Action, State
from catenary._commands import Commands


class Simulation(Commands[None], _catenary.Simulation):
    """A scene that runs in this process: the same solver and the same bits as in a node.

    `scene` is the name of a built-in scene, the path of a scene file, or a recording, whose scene is used;
    `toml` is the text of a scene instead. `threads` does not change the result. With `forces`, each
    step computes its forces, too, which takes a little longer and changes no bit of the state.

    `record` is the path of a recording of every step and command, the same file as that of `recorder simulate`. It
    gets its name when it is complete, at `close()`, at the end of a `with` block, or with the simulation. A file
    that exists is replaced only with `overwrite`.

    Commands take effect before the next step, and raise `Rejected` with the reason if they are wrong.
    Several threads may use different simulations at the same time. A simulation can be pickled and copied,
    except between a command and its step; the copy goes on with the same bits, and is not recorded.
    """

    def _perform(self, action: Action) -> None:
        self.apply(action)

    def __enter__(self) -> Simulation:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    # Before protocol 4, pickle would name the compiled class, which cannot be found under its name.
    def __reduce__(self) -> tuple[Any, ...]:
        _, arguments = self.__getnewargs_ex__()
        return _made, (type(self), arguments), self.__getstate__()

    def __getstate__(self) -> tuple[State, int, dict[str, Any]]:
        return self.state(), self.step_count, self.__dict__

    def __setstate__(self, state: tuple[State, int, dict[str, Any]]) -> None:
        kept, step_count, attributes = state
        self._continue_from(kept, step_count)
        self.__dict__.update(attributes)


def _made(kind: type[Simulation], arguments: dict[str, Any]) -> Simulation:
    return kind.__new__(kind, **arguments)
