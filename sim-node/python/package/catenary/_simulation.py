"""The solver in this process."""

from __future__ import annotations

from catenary import _catenary
from catenary._catenary import Action
from catenary._commands import Commands


class Simulation(Commands[None], _catenary.Simulation):
    """A scene that runs in this process: the same solver and the same bits as in a node.

    `scene` is the name of a built-in scene, the path of a scene file, or a recording, whose scene is used;
    `toml` is the text of a scene instead. `threads` does not change the result. With `forces`, each
    step computes its forces, too, which takes a little longer and changes no bit of the state.

    Commands take effect before the next step, and raise `Rejected` with the reason if they are wrong.
    Several threads may use different simulations at the same time.
    """

    def _perform(self, action: Action) -> None:
        self.apply(action)
