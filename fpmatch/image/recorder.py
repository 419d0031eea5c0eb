"""The one door through which every stage of the image room can be looked at."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Recorder(Protocol):
    """Receive each stage's array by name, in the order of the stages."""

    def record(self, stage: str, array: NDArray[Any]) -> None:
        """Take the array that `stage` produced; it must not be changed."""


class NoRecorder:
    """Ignore every stage; the default."""

    def record(self, stage: str, array: NDArray[Any]) -> None:
        """Do nothing."""


class StageRecorder:
    """Keep every stage's array in `stages`, a dict in the order of the stages.

    Examples
    --------
    >>> import numpy as np
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
