"""How often two prints joined into one match both fingers, and how often that is noticed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np

from fpmatch.gallery.listing.two_prints import find_doubts
from fpmatch.image.extract import extract
from fpmatch.image.io.read import read_image
from fpmatch.lab.synthesis.templates import make_templates
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.matchers.unit_circle import MATCHER
from research.attacks.joining import IMAGE_KINDS, KINDS, Joint
from research.commands import Command, folders, json_file, print_and_write, workers
from research.databases import extract_folders, prints_of, without_ridges
from research.tables.joined import format_joined, joined_kept

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from fpmatch.lab.evaluation.databases.extraction import ExtractedSet
    from fpmatch.templates.minutiae import Template

FORMS: Final = ("ridges", "alone")  # with ridges, as minutiae alone
ALONE: Final = "the two prints, not joined"
MATCH_SCORE: Final = 40.0
PAIRS: Final = 100  # of fingers of a database that are joined as templates,
IMAGES: Final = 30  # and as images
SYNTHETIC: Final = {"normal": 931, "hard": 932, "stretched": 933}  # presets and their seeds
FINGERS: Final = 700
LEAST_MINUTIAE: Final = 5
SEVERAL: Final = 3  # impressions of a finger from which several others are there to be matched
MOST_COMPARED: Final = 7  # of these


@dataclass(frozen=True)
class Source:
    """The prints of a database: of each finger templates, and the files of their images."""

    name: str
    templates: Sequence[Sequence[Template]]
    files: Sequence[Sequence[Path]] = ()

    @classmethod
    def of(cls, one: ExtractedSet) -> Source:
        """Return the prints of a database that have ridges."""
        by_finger: dict[str, list[tuple[Template, Path]]] = {}
        for impression, template in prints_of(one):
            if template.field is not None:
                kept = by_finger.setdefault(str(impression.finger), [])
                kept.append((template, impression.path))
        rows = [tuple(zip(*prints, strict=True)) for prints in by_finger.values()]
        return cls(one.dataset.name, [row[0] for row in rows], [row[1] for row in rows])

    @classmethod
    def synthetic(cls, preset: str, fingers: int) -> Source:
        """Return templates of synthetic fingers, two of each."""
        made = list(make_templates(SYNTHETIC[preset], range(fingers), 2, preset=preset))
        return cls(f"synthetic templates, {preset}", list(zip(made[::2], made[1::2], strict=True)))

    @property
    def has_several(self) -> bool:
        """Whether every finger has several impressions beside the one that is joined."""
        return all(len(templates) >= SEVERAL for templates in self.templates)

    def draws(self, count: int) -> Iterator[tuple[tuple[int, ...], tuple[int, ...], float]]:
        """Yield finger, impression that is joined and probe of two fingers, and a direction."""
        rng = np.random.default_rng(0)
        several = [k for k, templates in enumerate(self.templates) if len(templates) > 1]
        for _ in range(count):
            pair = rng.choice(several, 2, replace=False)
            drawn = [rng.choice(len(self.templates[k]), 2, replace=False) for k in pair]
            one, other = ((int(k), *map(int, two)) for k, two in zip(pair, drawn, strict=True))
            yield one, other, float(rng.uniform(0, np.pi))


def in_form(template: Template, form: str) -> Template:
    """Return a template with its ridges or as minutiae alone."""
    return template if form == FORMS[0] else without_ridges(template)


def measure_joined(
    sources: Sequence[Source], *, pairs: int = PAIRS, images: int = IMAGES
) -> dict[str, Any]:
    """Return shares that match both fingers and are noticed by source, kind and form."""
    rows: list[dict[str, Any]] = []
    for source in sources:
        for as_images, count in ((False, pairs), (True, images if source.files else 0)):
            outcomes: dict[tuple[str, str], list[tuple[bool, ...]]] = {}
            for one, other, turn in source.draws(count):
                for kind, form, outcome in _tried(source, one, other, turn, as_images=as_images):
                    outcomes.setdefault((kind, form), []).append(outcome)
            for (kind, form), each in outcomes.items():
                both, any_of, noticed = np.array(each).T
                rows.append(
                    {
                        "source": source.name,
                        "images": as_images,
                        "synthetic": not source.files,
                        "kind": kind,
                        "form": form,
                        "joined": len(each),
                        "match": float(both.mean()),
                        "any": float(any_of.mean()) if source.has_several else None,
                        "noticed": float(noticed.mean()),
                        "unnoticed": float((both & ~noticed).mean()),
                    }
                )
    ordinary = [
        {
            "source": source.name,
            "prints": sum(map(len, source.templates)),
            **{
                form: sum(
                    bool(find_doubts(in_form(template, form)))
                    for templates in source.templates
                    for template in templates
                )
                for form in FORMS
            },
        }
        for source in sources
    ]
    return {"joined": rows, "ordinary": ordinary}


def _tried(
    source: Source, one: tuple[int, ...], other: tuple[int, ...], turn: float, *, as_images: bool
) -> Iterator[tuple[str, str, tuple[bool, ...]]]:
    """Yield kind, form, and whether the joined print matches both fingers and is noticed.

    It is compared with one impression of each finger, then with several others than are joined.
    """
    a, b = (source.templates[finger][drawn] for finger, drawn, _ in (one, other))
    if min(len(a.minutiae), len(b.minutiae)) < LEAST_MINUTIAE:
        return
    pixels = [read_image(source.files[k[0]][k[1]]) for k in (one, other)] if as_images else []
    made: dict[str, Template] = {}
    for kind in IMAGE_KINDS if as_images else KINDS:
        joint = Joint.of(a, b, kind, turn)
        if as_images:
            made[kind] = extract(joint.images(*(image.pixels for image in pixels)), a.dpi)
        else:
            made[kind] = joint.templates(a, b)
    score = load_calibration(MATCHER.name).score
    for form in FORMS:
        others = [
            {
                k: MATCHER.prepare(in_form(source.templates[finger][k], form))
                for k in _compared(len(source.templates[finger]), drawn, probe)
            }
            for finger, drawn, probe in (one, other)
        ]

        def matches(
            templates: Sequence[Template], form: str = form, others: Sequence[Any] = others
        ) -> tuple[bool, bool]:
            matched = []
            for template, prints in zip(templates, others, strict=True):
                enrolled = MATCHER.prepare(in_form(template, form))
                matched.append(
                    {
                        k: score(MATCHER.compare(probe, enrolled).similarity) >= MATCH_SCORE
                        for k, probe in prints.items()
                    }
                )
            drawn = [each[probe] for each, (_, _, probe) in zip(matched, (one, other), strict=True)]
            return all(drawn), all(any(each.values()) for each in matched)

        yield ALONE, form, (*matches([a, b]), False)
        for kind, template in made.items():
            noticed = bool(find_doubts(in_form(template, form)))
            yield kind, form, (*matches([template, template]), noticed)


def _compared(count: int, drawn: int, probe: int) -> list[int]:
    """Return which impressions are compared: the probe, and others than the one that is joined."""
    left = [k for k in range(count) if k not in {drawn, probe}]
    return [probe, *left][:MOST_COMPARED]


@click.command(cls=Command)
@folders
@click.option("--pairs", default=PAIRS, show_default=True, help="Of each database, as templates.")
@click.option("--images", default=IMAGES, show_default=True, help="Of each database, as images.")
@json_file
@workers
def command(
    folders: tuple[Path, ...], pairs: int, images: int, json_file: Path | None, workers: int | None
) -> None:
    """Join prints of two fingers of the databases DIR, and of synthetic ones, into one.

    The joined print is compared with another impression of each finger; it matches both where both
    scores reach 40. It is also compared with up to seven other impressions of both, as in a
    gallery that has several of each finger: it matches both where it matches any impression of
    either. It is noticed where `fpmatch inspect` has a note on it. The same check of all the
    prints, each as it is and as minutiae alone, shows false alarms.

    --json writes what ``python -m research tables quality --joined`` reads.
    """
    sources = [Source.of(one) for one in extract_folders(folders, workers)]
    sources += [Source.synthetic(preset, FINGERS) for preset in SYNTHETIC]
    measured = measure_joined(sources, pairs=pairs, images=images)
    print_and_write(format_joined(joined_kept(measured)), measured, json_file)
