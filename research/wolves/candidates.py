"""Candidates of the search for wolves: templates and composed images, and their changes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from fpmatch.image.extract import extract, resample
from fpmatch.matching.pipeline.match import MIN_MINUTIAE
from fpmatch.templates.minutiae import STANDARD_DPI, Minutiae, Template
from fpmatch.templates.ridge_field import RidgeField
from research.wolves.probes import grey_of
from research.wolves.scores import FORMS
from research.wolves.search import SearchSpace
from research.wolves.templates import (
    CELL_PX,
    FRAME_PX,
    Wave,
    around_minutiae,
    drawn_field,
    with_ridges,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from research.wolves.scores import Prints

IMAGE_SIDES_PX: Final = (96, 128, 192)
MOST_MINUTIAE: Final = 100  # of a template that is searched for
MOST_JOINED: Final = 4  # patches of prints that a search of templates begins with
JOIN_SHARE: Final = 0.15  # of the changes; the others are of a minutia or of the ridges
PATCH_RADII_PX: Final = (20.0, 150.0)
MOST_PATCHES: Final = 12
CELLS: Final = round(FRAME_PX / CELL_PX)


Part = tuple[Template, int]  # a print in the frame, and its finger


@dataclass(frozen=True, eq=False)
class TemplateCandidate:
    """A template in the frame of `research.wolves.templates`, and the finger of its part."""

    made: Template
    fingers: tuple[int, ...] = ()

    def template(self) -> Template:
        """Return the template."""
        return self.made

    def pixels(self) -> None:
        """Return no image."""


def search_spaces(
    prints: Prints, kind: str = "wolf", *, images: bool = True
) -> Iterator[SearchSpace]:
    """Yield the spaces to search, given the prints that may be searched on."""
    parts = [
        (centred(template), int(k))
        for template, k in zip(prints.templates, prints.finger, strict=True)
        if len(template.minutiae)
    ]
    for form in FORMS:
        start = partial(_start, parts=parts, ridges=form == FORMS[0])
        change = partial(changed, parts=parts)
        for against in FORMS:
            yield SearchSpace(kind, 0, form, against, start, change)
    for side in IMAGE_SIDES_PX if images else ():
        compose = partial(ImageCandidate.random, prints=prints, side=side)
        yield SearchSpace(f"{kind} image", side, FORMS[0], FORMS[0], compose, changed_image)


def _start(rng: np.random.Generator, parts: Sequence[Part], *, ridges: bool) -> TemplateCandidate:
    """Return a few patches of prints, joined; with their ridges, and drawn ones between them."""
    nothing = Template(Minutiae.empty(), FRAME_PX, FRAME_PX)
    wave = Wave.random(rng, (6.0, 14.0))
    candidate = TemplateCandidate(nothing)
    for _ in range(rng.integers(1, MOST_JOINED + 1)):
        candidate = _joined(candidate, rng, parts)
        if ridges and candidate.made.field is None:
            candidate = replace(candidate, made=with_ridges(candidate.made, wave))
    return candidate


def _joined(
    candidate: TemplateCandidate, rng: np.random.Generator, parts: Sequence[Part]
) -> TemplateCandidate:
    """Return a template with a disc of it replaced by one of a print, moved by whole cells."""
    print_, finger = parts[int(rng.integers(len(parts)))]
    base, m = candidate.made, print_.minutiae
    if not len(m):
        return candidate
    middle = m.xy[rng.integers(len(m))]
    cells = np.round(rng.normal(0.0, 2.0, 2)).astype(int)
    radius = float(rng.uniform(*PATCH_RADII_PX))
    shift = cells * CELL_PX
    near = np.flatnonzero(np.hypot(*(m.xy - middle).T) <= radius)
    taken = m.take(near[:MOST_MINUTIAE])
    x, y = np.clip((taken.xy + shift).T, 0.0, FRAME_PX - 1.0)
    left = base.minutiae
    if len(left):
        outside = np.hypot(*(left.xy - middle - shift).T) > radius
        left = left.take(np.flatnonzero(outside)[: MOST_MINUTIAE - len(taken)])
    minutiae = Minutiae(
        np.append(left.x, x),
        np.append(left.y, y),
        np.append(left.angle, taken.angle),
        quality=np.append(left.quality, taken.quality),
    )
    made = replace(base, minutiae=minutiae)
    if base.field is not None and print_.field is not None:
        made = replace(made, field=_with_disc(base.field, print_.field, middle, radius, cells))
    return TemplateCandidate(made, tuple({*candidate.fingers, finger}))


def _with_disc(
    base: RidgeField,
    other: RidgeField,
    middle: NDArray[np.floating],
    radius: float,
    cells: NDArray[np.intp],
) -> RidgeField:
    """Return a ridge field with the cells of a disc of another one, moved by whole cells."""
    y, x = (np.indices(other.mask.shape) + 0.5) * CELL_PX
    disc = (np.hypot(x - middle[0], y - middle[1]) <= radius) & other.mask
    at = np.argwhere(disc)
    to = at + cells[::-1]
    inside = ((to >= 0) & (to < CELLS)).all(axis=1)
    row, column = at[inside].T

    def placed(array: NDArray[Any], taken: NDArray[Any]) -> NDArray[Any]:
        changed = array.copy()
        changed[tuple(to[inside].T)] = taken[row, column]
        return changed

    assert base.ridges is not None
    assert other.ridges is not None
    return RidgeField(
        CELL_PX,
        placed(base.orientation, other.orientation),
        placed(base.mask, other.mask),
        placed(base.ridges, other.ridges),
    )


def centred(template: Template) -> Template:
    """Return a template at 500 dpi in the middle of the frame, moved by whole cells."""
    zoom = STANDARD_DPI / template.dpi
    m = template.minutiae
    xy = m.xy * zoom
    cells = np.round((FRAME_PX / 2 - (xy.min(axis=0) + xy.max(axis=0)) / 2) / CELL_PX)
    x, y = np.clip((xy + cells * CELL_PX).T, 0.0, FRAME_PX - 1.0)
    moved = Template(Minutiae(x, y, m.angle, m.kind, m.quality), FRAME_PX, FRAME_PX)
    field = template.field
    if field is None or abs(field.step * zoom - CELL_PX) > 0.01:
        return moved
    right, down = cells.astype(int)
    row, column = np.nonzero(field.mask)
    inside = (row + down >= 0) & (row + down < CELLS) & (column + right >= 0)
    inside &= column + right < CELLS
    row, column = row[inside], column[inside]
    ridges = np.zeros(field.mask.shape, np.uint64) if field.ridges is None else field.ridges

    def shifted(given: NDArray[Any]) -> NDArray[Any]:
        array = np.zeros((CELLS, CELLS), given.dtype)
        array[row + down, column + right] = given[row, column]
        return array

    arrays = (shifted(field.orientation), shifted(field.mask), shifted(ridges))
    return replace(moved, field=RidgeField(CELL_PX, *arrays))


def changed(
    candidate: TemplateCandidate, rng: np.random.Generator, parts: Sequence[Part]
) -> TemplateCandidate:
    """Return a template with a patch, a few of its minutiae, or its ridges changed."""
    template = candidate.made
    if rng.random() < JOIN_SHARE:
        return _joined(candidate, rng, parts)
    if template.field is not None and rng.random() < 0.5:
        return replace(candidate, made=replace(template, field=_changed_field(template, rng)))
    return replace(
        candidate, made=replace(template, minutiae=_changed_minutiae(template, rng, MOST_MINUTIAE))
    )


def _changed_minutiae(template: Template, rng: np.random.Generator, most: int) -> Minutiae:
    m = template.minutiae
    x, y, angle, quality = (
        getattr(m, name).astype(np.float64) for name in ("x", "y", "angle", "quality")
    )
    for _ in range(rng.geometric(0.5)):
        k = int(rng.integers(len(x)))
        what = rng.integers(6)
        if what == 0 and len(x) < most:
            far = rng.choice([5.0, 20.0, 60.0])
            x, y = np.append(x, x[k] + rng.normal(0, far)), np.append(y, y[k] + rng.normal(0, far))
            angle = np.append(angle, rng.uniform(0, 2 * np.pi))
            quality = np.append(quality, quality[k])
        elif what == 1 and len(x) > MIN_MINUTIAE:
            x, y, angle, quality = (np.delete(one, k) for one in (x, y, angle, quality))
        elif what == 2:
            quality[k] = rng.choice([1.0, 20.0, 50.0, 100.0])
        elif what == 3:
            angle[k] += rng.normal(0, rng.choice([0.1, 0.4, 3.0]))
        else:
            far = rng.choice([1.0, 4.0, 16.0])
            x[k] += rng.normal(0, far)
            y[k] += rng.normal(0, far)
    x, y = np.clip(x, 0.0, FRAME_PX - 1.0), np.clip(y, 0.0, FRAME_PX - 1.0)
    return Minutiae(x, y, angle, quality=quality)


def _changed_field(template: Template, rng: np.random.Generator) -> RidgeField:
    """Return a ridge field in which a disc of cells is redrawn, added or removed."""
    field = template.field
    assert field is not None
    m = template.minutiae
    k = int(rng.integers(len(m)))
    x, y = (rng.normal(values[k], 40.0, 1) for values in (m.x, m.y))
    spot = Minutiae(x, y, np.zeros(1))  # type: ignore[arg-type]
    if rng.random() < 0.1:
        whole = around_minutiae(m, float(rng.uniform(8.0, 60.0)))
        return drawn_field(Wave.random(rng, (6.0, 14.0)), whole)
    disc = around_minutiae(spot, float(rng.uniform(8.0, 80.0)))
    new = drawn_field(Wave.random(rng, (6.0, 14.0)), disc)
    if rng.random() < 0.25 and (field.mask & ~new.mask).any():
        return RidgeField(CELL_PX, field.orientation, field.mask & ~new.mask, field.ridges)
    assert field.ridges is not None
    assert new.ridges is not None
    return RidgeField(
        CELL_PX,
        np.where(new.mask, new.orientation, field.orientation),
        field.mask | new.mask,
        np.where(new.mask, new.ridges, field.ridges),
    )


@dataclass(frozen=True)
class Patch:
    """Describe a disc of drawn ridges, or of a print where `print_` is not negative.

    Lengths are in pixels at 500 dpi; `shown` is the place in the print that lies in the middle.
    """

    x: float
    y: float
    radius: float
    wave: Wave
    print_: int = -1
    shown: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0


@dataclass(frozen=True, eq=False)
class ImageCandidate:
    """An image as patches, later ones over earlier ones; the first fills it."""

    side: int
    patches: tuple[Patch, ...]
    prints: Prints

    @classmethod
    def random(cls, rng: np.random.Generator, prints: Prints, side: int) -> ImageCandidate:
        """Return an image of a few random patches."""
        count = int(rng.integers(1, 6))
        return cls(side, tuple(random_patch(rng, prints, side) for _ in range(count)), prints)

    @property
    def fingers(self) -> tuple[int, ...]:
        """The fingers in the patches."""
        return tuple(int(self.prints.finger[p.print_]) for p in self.patches if p.print_ >= 0)

    def pixels(self) -> NDArray[np.uint8]:
        """Return the image."""
        y, x = np.mgrid[: self.side, : self.side].astype(np.float64)
        image = np.full((self.side, self.side), 255.0)
        for number, patch in enumerate(self.patches):
            seen = _pixels_of(patch, self.prints, x - patch.x, y - patch.y)
            edge = patch.radius - np.hypot(x - patch.x, y - patch.y)
            share = np.clip(edge / 4.0 + 0.5, 0.0, 1.0) if number else 1.0
            image += share * (seen - image)
        return np.asarray(np.rint(image), np.uint8)

    def template(self) -> Template | None:
        """Return the template extracted from the image; None where it has too few minutiae."""
        found = extract(self.pixels(), STANDARD_DPI)
        return found if len(found.minutiae) >= MIN_MINUTIAE else None


def _pixels_of(
    patch: Patch, prints: Prints, dx: NDArray[np.float64], dy: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return grey values of a patch at places relative to its middle."""
    if patch.print_ < 0:
        return np.asarray(127.0 - 110.0 * np.cos(patch.wave.at(dx, dy)))
    dpi = prints.templates[patch.print_].dpi
    grey, _ = resample(grey_of(prints.impressions[patch.print_].path).pixels, dpi)
    c, s = np.cos(patch.turn), np.sin(patch.turn)
    x = np.asarray(patch.shown[0] + c * dx + s * dy, np.float32)
    y = np.asarray(patch.shown[1] - s * dx + c * dy, np.float32)
    shown = cv2.remap(
        grey, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=(255.0,)
    )
    return np.asarray(shown, np.float64)


def random_patch(rng: np.random.Generator, prints: Prints, side: int) -> Patch:
    """Return a patch of drawn ridges or of a print, with equal chance."""
    x, y = rng.uniform(0, side, 2).tolist()
    patch = Patch(x, y, float(rng.uniform(10.0, 0.7 * side)), Wave.random(rng, (6.0, 14.0)))
    if rng.random() < 0.5:
        return patch
    k = int(rng.integers(len(prints.templates)))
    template = prints.templates[k]
    if template.field is None:
        return patch
    cells = np.argwhere(template.field.mask)
    zoom = STANDARD_DPI / template.dpi
    row, column = (cells[rng.integers(len(cells))] + 0.5) * template.field.step * zoom
    turn = float(rng.uniform(0, 2 * np.pi))
    return replace(patch, print_=k, shown=(float(column), float(row)), turn=turn)


def changed_image(candidate: Any, rng: np.random.Generator) -> ImageCandidate:
    """Return an image with one patch added, removed, replaced or changed."""
    image: ImageCandidate = candidate
    patches = list(image.patches)
    k = int(rng.integers(len(patches)))
    what = rng.integers(8)
    if what == 0 and len(patches) < MOST_PATCHES:
        patches.append(random_patch(rng, image.prints, image.side))
    elif what == 1 and len(patches) > 1:
        del patches[k]
    elif what == 2:
        patches[k] = random_patch(rng, image.prints, image.side)
    else:
        patches[k] = _changed_patch(patches[k], rng)
    return replace(image, patches=tuple(patches))


def _changed_patch(patch: Patch, rng: np.random.Generator) -> Patch:
    far = rng.choice([1.0, 4.0, 16.0])
    dx, dy = rng.normal(0, far, 2).tolist()
    wave, what = patch.wave, rng.integers(4)
    if what == 0:
        return replace(patch, x=patch.x + dx, y=patch.y + dy)
    if what == 1:
        return replace(patch, radius=max(4.0, patch.radius + dx))
    if patch.print_ >= 0:
        turn = patch.turn + float(rng.normal(0, 0.2))
        return replace(patch, shown=(patch.shown[0] + dx, patch.shown[1] + dy), turn=turn)
    return replace(
        patch,
        wave=Wave(
            wave.orientation + float(rng.normal(0, 0.2)),
            float(np.clip(wave.period * np.exp(rng.normal(0, 0.05)), 4.0, 20.0)),
            wave.phase + float(rng.normal(0, 0.5)),
            wave.bend + float(rng.normal(0, 0.1)),
        ),
    )
