"""The one door through which every stage of the image room can be looked at."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, Protocol

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fpmatch.image.preprocess.foreground import Box

MAY_BE_UNKNOWN: Final = frozenset({"orientation", "period"})
"""The stages that are NaN where there is no print."""


class Recorder(Protocol):
    """Receive each stage's array by name, in the order of the stages."""

    def record(self, stage: str, array: NDArray[Any]) -> None:
        """Take the array that `stage` produced; it must not be changed."""


class NoRecorder:
    """Ignore every stage; the default.

    For a recorder of a kind of this class no stage is made for the eye alone.
    """

    def record(self, stage: str, array: NDArray[Any]) -> None:
        """Do nothing."""


class UncropRecorder:
    """Hand on the stages of a box of an image, each in its place in the image.

    Around it is 0, or NaN where what is recorded may be unknown.

    Parameters
    ----------
    recorder : Recorder
        Receives them.
    box : Box
        Where the box lies.
    shape : tuple of int
        Height and width of the image.
    """

    def __init__(self, recorder: Recorder, box: Box, shape: tuple[int, int]) -> None:
        self.recorder = recorder
        self.box = box
        self.shape = shape

    def record(self, stage: str, array: NDArray[Any]) -> None:
        """Hand on a picture in its place, and what is no picture of the box as it is."""
        height, width = self.box.bottom - self.box.top, self.box.right - self.box.left
        if array.shape == (height, width) != self.shape:
            around = math.nan if stage in MAY_BE_UNKNOWN else 0.0
            array = self.box.uncrop(array, self.shape, around=around)
        self.recorder.record(stage, array)


def needs_display_stages(recorder: Recorder) -> bool:
    """Tell whether stages that are made for the eye alone are to be made for this recorder."""
    receiver = recorder.recorder if isinstance(recorder, UncropRecorder) else recorder
    return not isinstance(receiver, NoRecorder)


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
