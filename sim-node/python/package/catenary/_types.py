"""Types in the signatures of the module."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias, Union

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float32]
Wholes: TypeAlias = npt.NDArray[np.uint32]
Vector: TypeAlias = Union[Sequence[float], npt.NDArray[np.floating[Any]]]
"""Numbers in any sequence or NumPy array: three coordinates in metres, relative to the origin of the
scene, or a quaternion x, y, z, w."""
