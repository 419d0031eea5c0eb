"""Recorders, which receive the array that each stage of an extraction produces."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, Protocol

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.image.preprocess.foreground import Box

MAY_BE_UNKNOWN: Final = frozenset({"orientation", "period"})  # NaN where there is no print


class Recorder(Protocol):
    """Receive each stage's array by name, in the order of the stages.

    A recorder with an attribute ``wanted``, a collection of names, receives those stages alone, and
    stages that only serve for display are not computed for it.
    """

    def record(self, stage: str, array: NDArray[Any]) -> None:
        """Take the array that `stage` produced; it must not be changed."""


class UncropRecorder:
    """Pass the stages of a box of an image to a recorder, padded with 0 or NaN to its `shape`."""

    def __init__(self, recorder: Recorder | None, box: Box, shape: tuple[int, int]) -> None:
        self.recorder, self.box, self.shape = recorder, box, shape

    def wants(self, stage: str) -> bool:
        """Return whether the recorder receives `stage`."""
        return self.recorder is not None and stage in getattr(self.recorder, "wanted", (stage,))

    def record(self, stage: str, array: NDArray[Any]) -> None:
        """Pass on an image of the box padded, and any other array as it is."""
        if self.recorder is None or not self.wants(stage):
            return
        height, width = self.box.bottom - self.box.top, self.box.right - self.box.left
        if array.shape == (height, width) != self.shape:
            around = math.nan if stage in MAY_BE_UNKNOWN else 0.0
            array = self.box.uncrop(array, self.shape, around=around)
        self.recorder.record(stage, array)


class StageRecorder:
    """Keep every stage's array in `stages`, a dict in the order of the stages.

    Examples
    --------
    >>> import numpy as np
    >>> from fpmatch import StageRecorder
    >>> recorder = StageRecorder()
    >>> recorder.record("binary", np.zeros((4, 4), bool))
    >>> list(recorder.stages)
    ['binary']
    """

    def __init__(self) -> None:
        self.stages: dict[str, NDArray[Any]] = {}

    def record(self, stage: str, array: NDArray[Any]) -> None:
        """Keep a copy of `array` under the name of its stage."""
        self.stages[stage] = array.copy()
