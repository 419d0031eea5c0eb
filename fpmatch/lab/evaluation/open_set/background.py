"""Prints without mates that fill the gallery of a test: those of a gallery, or of a database."""

from __future__ import annotations

import os
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.errors import DatasetError
from fpmatch.gallery.engine.workers import Progress, no_progress
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.kinds import kind_of
from fpmatch.gallery.search.whole import WholeSearch
from fpmatch.lab.evaluation.databases import extraction
from fpmatch.lab.evaluation.databases.dataset import load_dataset
from fpmatch.lab.evaluation.databases.protocol import finger_numbers
from fpmatch.lab.evaluation.open_set.roles import group_fingers, subject_of
from fpmatch.lab.evaluation.open_set.searches import Background

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping, Sequence

    from numpy.typing import NDArray

    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.lab.evaluation.databases.dataset import Dataset
    from fpmatch.matching.result import Matcher


@dataclass(frozen=True, slots=True, eq=False)
class BackgroundPrints:
    """A search of prints without mates, the finger of each, and the subject of each finger.

    Fingers are numbered from 0; a subject is None where it is not known.
    """

    search: WholeSearch
    finger: NDArray[np.intp]
    subjects: Sequence[Hashable]

    def of_subjects(self, fingers: int) -> Background:
        """Return the prints as those of subjects, each of `fingers` fingers, or of all if it is 1.

        See `group_fingers`.
        """
        if fingers == 1:
            named = [k if s is None else (s,) for k, s in enumerate(self.subjects)]
            codes = {name: code for code, name in enumerate(dict.fromkeys(named))}
            subject = np.array([codes[name] for name in named], np.intp)
            return Background(self.search, subject[self.finger], self.finger)
        subject = np.full(len(self.subjects), -1)
        place = np.zeros(len(self.subjects), np.intp)
        for k, group in enumerate(group_fingers(self.subjects, fingers)):
            subject[list(group)], place[list(group)] = k, np.arange(fingers)
        return Background(self.search, subject[self.finger], place[self.finger])


def no_background(matcher: Matcher) -> Background:
    """Return a background without prints."""
    return BackgroundPrints(WholeSearch.of([], matcher), np.empty(0, np.intp), ()).of_subjects(1)


def load_background(
    place: str | os.PathLike[str],
    matcher: Matcher,
    *,
    engine: Engine | None = None,
    progress: Progress = no_progress,
    enhance: str = "",
    apart_from: Sequence[Dataset] = (),
    dpi: float | None = None,
    reading: Mapping[str, Any] = MappingProxyType({}),
    **labels: Any,
) -> BackgroundPrints:
    """Load the prints of a gallery, which is not changed, or of a folder or manifest.

    Prints that cannot be read are left out. None may be of the databases `apart_from`. `labels` are
    the parameters `pattern` and `by_folder` of `load_dataset`, `reading` further ones of
    `dataset_reader`; `dpi` is the resolution of all images, and `enhance` names the ridge
    enhancement, as for `extract_image`. The stage of `progress` is "extract background". Raises a
    `DatasetError` or a `GalleryError` if there is no such place, it cannot be read, or a print is
    one that is searched for; a `TemplateError` if a gallery cannot store a template.
    """
    how: dict[str, Any] = {"engine": engine, "progress": progress}
    probes = {os.path.realpath(one.path) for dataset in apart_from for one in dataset.impressions}
    if kind_of(place) == "gallery":
        with open_gallery(place) as gallery:
            labelled = {}
            for entry in gallery.entries():
                labelled[entry.id] = entry.label.of_finger
                _check_apart(place, entry.source, probes)
            enrolled = [row for row in gallery.templates() if row[0] in labelled]
        search = WholeSearch.of([template for _, template in enrolled], matcher)
        fingers = [labelled[number] for number, _ in enrolled]
        codes = {finger: code for code, finger in enumerate(dict.fromkeys(fingers))}
        numbered = np.array([codes[finger] for finger in fingers], np.intp)
        return BackgroundPrints(search, numbered, [finger.subject for finger in codes])
    dataset = load_dataset(place, **labels).at(dpi)
    for one in dataset.impressions:
        _check_apart(place, os.path.realpath(one.path), probes)
    extractor = extraction.extractor_of(
        enhance, extraction.dataset_reader([dataset], engine=engine, **reading)
    )
    how |= {"extractor": extractor, "stage": "extract background"}
    (extracted,) = extraction.extract_datasets([dataset], **how)
    templates = [one.template for one in extracted.extractions]
    finger = finger_numbers(dataset.impressions)
    names = {
        int(code): subject_of(one.finger)
        for code, one in zip(finger, dataset.impressions, strict=True)
    }
    kept = finger[[template is not None for template in templates]]
    search = WholeSearch.of([one for one in templates if one is not None], matcher)
    return BackgroundPrints(search, kept, [names[code] for code in range(len(names))])


def _check_apart(place: str | os.PathLike[str], source: str, probes: set[str]) -> None:
    """Raise a DatasetError if a print of the background is one that is searched for."""
    if source in probes:
        raise DatasetError(f"the background has a print that is searched for: {source}", path=place)
