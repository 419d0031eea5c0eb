#!/usr/bin/env python3
"""Measure what parts of the default matcher are worth, by taking them out.

    .venv/bin/python research/benchmarks/ablation.py DIR... [--json FILE] [--keep FOLDER]

A variant is the package with a few lines of its source replaced, in a temporary copy that is
compiled again.
"""

from __future__ import annotations

import os
import pickle
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np
import repository  # noqa: F401

from fpmatch.lab.evaluation.rates.bootstrap import BOOTSTRAPPED, bootstrap_rates
from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.lab.evaluation.rates.intervals import interval_of
from fpmatch.lab.evaluation.rates.scores_set import Trials
from fpmatch.matching.pipeline import evidence
from fpmatch.templates.minutiae import Minutiae, Template
from research.all_pairs import compare_all_pairs
from research.commands import PATH, ROOT, Command, folders, json_file, print_and_write, workers
from research.databases import TRAINING_SEED, extract_folders, make_synthetic_sets, without_ridges
from research.tables import FORMS, format_ablation
from research.training.evidence_quantiles import AmountParameters, fit_amounts
from research.training.score_fit import fit_weights
from research.training.score_samples import SampleParameters, samples_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Templates = dict[str, list[tuple[int | str, Template | None]]]
    Similarities = dict[tuple[str, str], NDArray[np.float64]]

EVERY_IMPOSTOR: Final = 12
PROBES: Final = 30  # of each kind and database, to measure what impostors reach
RESAMPLES: Final = 1000
REPORTED: Final = ("eer", "fmr1000")

MESH: Final = "fpmatch/matching/pipeline/_kernels/_pair_mesh_kernel.py"
RING: Final = "fpmatch/pointset/paper/_one_ring_kernel.py"
NOISE_OF_PLACES: Final = (
    MESH,
    "            self.place[k] = self.place[k] / around_a - self.other_place[k] / around_b\n",
    """            v = self.ring[k]
            dx = sin(12.9898 * self.ax[v] + 78.233 * self.by[v]) * 43758.5453
            self.place[k] = 0.5 * (dx - cython.cast(cython.Py_ssize_t, dx))
""",
)
WEIGHTS_END: Final = "        weight[s] += side * whole\n    return True\n"
RANDOM: Final = """        weight[s] += side * whole
    whole = 0.0
    for line in range(begin, end):
        own = 12.9898 * px[vertex[line]] + 78.233 * py[vertex[line]] + 37.719 * x + 4.581 * y
        own = own * 43.7585453
        own = own - cython.cast(cython.Py_ssize_t, own)
        weight[line] = 0.01 + (own if own > 0.0 else -own)
        whole += weight[line]
    for line in range(begin, end):
        weight[line] /= whole
    return True
"""
EQUAL: Final = """        weight[s] += side * whole
    for line in range(begin, end):
        weight[line] = 1.0 / degree
    return True
"""
RANDOM_WEIGHTS: Final = (RING, WEIGHTS_END, RANDOM)
RIDGE_FEATURES: Final = ("ridges", "area of the ridges", "ridges by area")
MESH_FEATURES: Final = (
    "places on the circle",
    "weights in the ring",
    "fullness of the rings",
    "triangles turned over",
    "strain",
)


@dataclass(frozen=True)
class Variant:
    """Describe a variant: the lines that replace others, and features without a weight.

    `replaced`: file of the package, the lines that occur in it once, and those that replace them.
    """

    name: str
    replaced: tuple[tuple[str, str, str], ...] = ()
    without: tuple[str, ...] = ()  # features of the score that get no weight


VARIANTS: Final = (
    Variant("base"),
    Variant("places of eq. (3) by noise", (NOISE_OF_PLACES,)),
    Variant("weights of eq. (4) random", (RANDOM_WEIGHTS,)),
    Variant("both by noise", (NOISE_OF_PLACES, RANDOM_WEIGHTS)),
    Variant("weights of eq. (4) equal", ((RING, WEIGHTS_END, EQUAL),)),
    Variant("no evidence of the mesh", without=MESH_FEATURES),
    Variant("no ridges", without=RIDGE_FEATURES),
)


@dataclass(frozen=True)
class Work:
    """The templates that a variant is trained and measured on, by database, with fingers."""

    trained_on: Templates
    measured: Templates


@click.command(cls=Command)
@folders
@click.option("--keep", metavar="FOLDER", type=PATH, help="Keep the synthetic templates here.")
@json_file
@workers
def main(
    folders: tuple[Path, ...], keep: Path | None, json_file: Path | None, workers: int | None
) -> None:
    """Measure what parts of the default matcher are worth, by taking them out.

    Each DIR is an FVC-style database. The score weights of a variant and its prefilter are trained
    on the synthetic prints of ``python -m research train score``, on one impostor comparison in
    twelve; the base is trained in the same way. Then all pairs of every database are compared by
    the extended protocol, with the templates as they are extracted and on their minutiae alone.

    Printed are, for each variant, mean and pooled EER / FMR1000 in percent, and the difference of
    the mean EER from the base with its 95 % bootstrap interval (fingers resampled), in percentage
    points. The templates of the synthetic prints are kept in the folder of --keep, for the next
    run.
    """
    with tempfile.TemporaryDirectory() as temporary:
        kept = keep or Path(temporary)
        kept.mkdir(parents=True, exist_ok=True)
        work = Work(_synthetic_templates(kept, workers), _extracted(folders, workers))
    rows = _rows_of([_measure(number, work) for number in range(len(VARIANTS))], work)
    print_and_write(format_ablation(rows), rows, json_file)


def _extracted(folders: Sequence[Path], workers: int | None) -> Templates:
    return {
        one.dataset.name: [
            (impression.finger, extraction.template)
            for impression, extraction in zip(one.dataset.impressions, one.extractions, strict=True)
        ]
        for one in extract_folders(folders, workers)
    }


def _synthetic_templates(folder: Path, workers: int | None) -> Templates:
    """Return the templates of the synthetic prints, which are made where they are not kept."""
    kept = folder / "templates.pickle"
    if not kept.exists():
        made = make_synthetic_sets(folder / "prints", first_seed=TRAINING_SEED, workers=workers)
        kept.write_bytes(pickle.dumps(_extracted(made, workers)))
    found: Templates = pickle.loads(kept.read_bytes())
    return found


def _make_copy(variant: Variant, into: Path) -> None:
    """Copy the package, replace the lines of the variant, and compile what changed."""
    for name in ("fpmatch", "build"):
        if (ROOT / name).exists():
            shutil.copytree(ROOT / name, into / name)
    for name in ("setup.py", "pyproject.toml", "README.md", "LICENSE"):
        shutil.copy2(ROOT / name, into / name)
    for file, old, new in variant.replaced:
        text = (into / file).read_text(encoding="utf-8")
        if text.count(old) != 1:
            raise click.ClickException(f"{variant.name}: {file} no longer has the replaced lines")
        (into / file).write_text(text.replace(old, new), encoding="utf-8")
    if any(file.endswith("_kernel.py") for file, _, _ in variant.replaced):
        build = [sys.executable, "setup.py", "build_ext", "--inplace"]
        subprocess.run(build, cwd=into, check=True, capture_output=True)


def run_worker(work: str, number: str, into: str) -> None:
    """Train and measure one variant in this process, whose package is the variant's."""
    given: Work = pickle.loads(Path(work).read_bytes())
    every = SampleParameters(
        every_impostor=EVERY_IMPOSTOR, every_window_impostor=4 * EVERY_IMPOSTOR
    )
    sets = [_as_extracted(name, rows) for name, rows in given.trained_on.items()]
    trained = fit_weights(*samples_of(sets, every), without=VARIANTS[int(number)].without)
    trained = fit_amounts(trained, sets, parameters=AmountParameters(probes=PROBES))
    evidence.load_weights = lambda: trained  # type: ignore[assignment]
    empty = Template(Minutiae.empty(), 1, 1)
    found: Similarities = {}
    for name, rows in given.measured.items():
        templates = [empty if one is None else one for _, one in rows]
        found[FORMS[0], name] = compare_all_pairs(templates)
        found[FORMS[1], name] = compare_all_pairs([without_ridges(one) for one in templates])
    Path(into).write_bytes(pickle.dumps(found))


def _as_extracted(name: str, rows: list[tuple[int | str, Template | None]]) -> Any:
    """Return templates in the form in which `sample_of` takes a database."""
    impressions = [
        SimpleNamespace(finger=finger, impression=k) for k, (finger, _) in enumerate(rows)
    ]
    return SimpleNamespace(
        dataset=SimpleNamespace(name=name, impressions=impressions),
        extractions=[SimpleNamespace(template=template) for _, template in rows],
    )


def _measure(number: int, work: Work) -> Similarities:
    """Return the similarities of a variant, measured in a process of its own."""
    click.echo(VARIANTS[number].name, err=True)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        given, copy, result = (folder / name for name in ("work.pickle", "copy", "result.pickle"))
        given.write_bytes(pickle.dumps(work))
        copy.mkdir()
        _make_copy(VARIANTS[number], copy)
        command = [sys.executable, __file__, "--worker", str(given), str(number), str(result)]
        environment = {**os.environ, "PYTHONPATH": str(copy)}
        subprocess.run(command, check=True, env=environment, cwd=folder)
        found: Similarities = pickle.loads(result.read_bytes())
        return found


def _rows_of(found: Sequence[Similarities], work: Work) -> list[dict[str, Any]]:
    """Return a row for each variant: its rates by form, and their change."""
    sides = {}
    for name, templates in work.measured.items():
        _, finger = np.unique([one for one, _ in templates], return_inverse=True)
        first, second = np.triu_indices(len(templates), 1)
        sides[name] = finger[first], finger[second], int(finger.max()) + 1
    rows: list[dict[str, Any]] = []
    base: dict[str, NDArray[np.float64]] = {}
    for variant, similarity in zip(VARIANTS, found, strict=True):
        rows.append({"name": variant.name})
        for form in FORMS:
            trials = [Trials(similarity[form, name], *sides[name]) for name in sides]
            rates = [error_rates(t.similarity[t.genuine], t.similarity[~t.genuine]) for t in trials]
            genuine, impostor = (
                np.concatenate([t.similarity[t.genuine == same] for t in trials])
                for same in (True, False)
            )
            pooled = error_rates(genuine, impostor)
            drawn = bootstrap_rates(trials, RESAMPLES, 0).mean[:, BOOTSTRAPPED.index("eer")]
            change = interval_of(drawn - base.setdefault(form, drawn))
            rows[-1][form] = {
                "mean": {
                    rate: float(np.mean([getattr(one, rate) for one in rates])) for rate in REPORTED
                },
                "pooled": {rate: getattr(pooled, rate) for rate in REPORTED},
                "change": None if change is None else [change.low, change.high],
            }
    return rows


if __name__ == "__main__":
    if sys.argv[1:2] == ["--worker"]:
        run_worker(*sys.argv[2:])
    else:
        main()
