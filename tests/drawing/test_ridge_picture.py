"""`ridge_picture`: the ridges that a template keeps are where they were."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fpmatch.drawing.ridge_picture import ridge_picture
from fpmatch.image.extract import extract
from fpmatch.minutiae import Minutiae, Template


def test_ridges_lie_where_the_picture_has_them(fingers: list[NDArray[np.uint8]]) -> None:
    for dpi in (500, 700):
        picture = ridge_picture(extract(fingers[0], dpi))
        assert picture.shape == fingers[0].shape
        print_ = picture < 255
        assert print_.mean() > 0.2
        inside = np.zeros_like(print_)
        inside[60:240, 60:220] = True
        same = np.corrcoef(picture[inside], fingers[0][inside])[0, 1]
        assert same > 0.6, dpi


def test_without_ridges_the_paper_is_white() -> None:
    assert (ridge_picture(Template(Minutiae.empty(), width=30, height=20)) == 255).all()
