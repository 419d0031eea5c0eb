"""Templates that are not searched for: prints, parts of prints, and random minutiae."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np

from fpmatch.image.extract import extract
from fpmatch.image.io.read import read_image
from fpmatch.lab.evaluation.cropping import crop_at
from fpmatch.matching.pipeline.match import MIN_MINUTIAE
from research.partial_templates import fragment
from research.wolves.scores import FORMS, Probe, in_form
from research.wolves.table import WHOLE
from research.wolves.templates import FEW, MANY, Wave, with_ridges

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from fpmatch.image.io.read import GreyImage
    from fpmatch.templates.minutiae import Template
    from research.wolves.scores import Prints

FRAGMENT_SIZES: Final = (2, 3, 4, 5, 6, 8, 10, 12)
CROP_SIDES_PX: Final = (48, 64, 96, 128, 160, 200)
FEW_SIZES: Final = (2, 3, 5, 8, 12)
MANY_SIZES: Final = (100, 150, 250)
MOST_TRIALS: Final = 20  # crops of a print until one has enough minutiae


@dataclass(frozen=True)
class Group:
    """Name some templates of one kind and size, and make them."""

    kind: str
    size: int
    form: str
    make: Callable[[], list[Probe]]


def groups(prints: Prints, count: int, seed: int) -> Iterator[Group]:
    """Yield all groups of templates; the same for the same prints, count and seed."""
    for form in FORMS:
        yield Group(WHOLE, 0, form, _whole(prints, form, count, (seed, 0)))
        for size in FRAGMENT_SIZES:
            yield Group("fragment", size, form, _fragments(prints, size, form, count, (seed, size)))
    for side in CROP_SIDES_PX:
        made = cache(_crops(prints, side, count, (seed, side)))
        for form in FORMS:
            yield Group("crop", side, form, _alone(made, form))
    for number, (kind, make) in enumerate({**FEW, **MANY}.items()):
        for size in FEW_SIZES if kind in FEW else MANY_SIZES:
            for form in FORMS:
                yield Group(kind, size, form, _made(make, size, form, count, (seed, number, size)))


def _whole(
    prints: Prints, form: str, count: int, seed: tuple[int, ...]
) -> Callable[[], list[Probe]]:
    def made() -> list[Probe]:
        rng = np.random.default_rng(seed)
        chosen = rng.permutation(len(prints.templates))[:count].tolist()
        return [Probe(in_form(prints.templates[k], form), int(prints.finger[k])) for k in chosen]

    return made


def _fragments(
    prints: Prints, size: int, form: str, count: int, seed: tuple[int, ...]
) -> Callable[[], list[Probe]]:
    def made() -> list[Probe]:
        rng = np.random.default_rng(seed)
        large = [k for k, one in enumerate(prints.templates) if len(one.minutiae) >= size]
        chosen = rng.choice(large, count).tolist() if large else []
        return [
            Probe(in_form(fragment(prints.templates[k], size, rng), form), int(prints.finger[k]))
            for k in chosen
        ]

    return made


def _crops(
    prints: Prints, side: int, count: int, seed: tuple[int, ...]
) -> Callable[[], list[Probe]]:
    def made() -> list[Probe]:
        rng = np.random.default_rng(seed)
        found = []
        for k in rng.integers(len(prints.templates), size=count).tolist():
            image = grey_of(prints.impressions[k].path)
            template = prints.templates[k]
            if template.field is None:
                continue
            cells = np.argwhere(template.field.mask)
            for _ in range(MOST_TRIALS):
                row, column = (cells[rng.integers(len(cells))] + 0.5) * template.field.step
                square = extract(crop_at(image, column, row, side, template.dpi), template.dpi)
                if len(square.minutiae) >= MIN_MINUTIAE:
                    found.append(Probe(square, int(prints.finger[k])))
                    break
        return found

    return made


@cache
def grey_of(path: Path) -> GreyImage:
    """Return the image of a print."""
    return read_image(path)


def _alone(made: Callable[[], list[Probe]], form: str) -> Callable[[], list[Probe]]:
    return lambda: [Probe(in_form(one.template, form), one.finger) for one in made()]


def _made(
    make: Callable[[int, np.random.Generator], Template],
    size: int,
    form: str,
    count: int,
    seed: tuple[int, ...],
) -> Callable[[], list[Probe]]:
    def made() -> list[Probe]:
        rng = np.random.default_rng(seed)
        found = []
        for _ in range(count):
            template = make(size, rng)
            drawn = with_ridges(template, Wave.random(rng), float(rng.uniform(8.0, 80.0)))
            found.append(Probe(drawn if form == FORMS[0] else template))
        return found

    return made
