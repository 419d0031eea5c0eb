#!/usr/bin/env python3
"""Measure what each part of the default matcher is worth, by taking it out.

    .venv/bin/python benchmarks/ablation.py DIR... [--json FILE] [--variant NAME]... [--keep FOLDER]

Each DIR is an FVC-style database. A variant is the package with a few lines of its source replaced,
in a temporary copy that is compiled again. Its score weights and its prefilter are trained on the
synthetic prints of ``python -m research train score``, on one impostor comparison in twelve, and
its sums are conditioned on how much was compared; the base is trained in the same way. Then all
pairs of every database are compared by the extended protocol, with the templates as they are
extracted and on their minutiae alone.

Printed are, for each variant, mean and pooled EER and FMR1000 in percent, the difference of the
mean EER from the base with its 95 % bootstrap interval (fingers resampled), and the share of all
scores that are identical to those of the base when both use the base's weights. The templates of
the synthetic prints are kept in the folder of `--keep`, for the next run.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from repository import ROOT

if TYPE_CHECKING:
    from collections.abc import Sequence

EVERY_IMPOSTOR: Final = 12
PROBES: Final = 30  # of each kind and database, to measure what impostors reach
RESAMPLES: Final = 1000
KINDS: Final = ("with ridges", "minutiae alone")


@dataclass(frozen=True)
class Variant:
    """Name a variant, and say which lines of which files of the package it replaces.

    Its sums are conditioned on how much was compared, unless `conditioned` is false.
    """

    name: str
    replaced: tuple[tuple[str, str, str], ...] = ()
    without: tuple[str, ...] = ()
    conditioned: bool = True


MESH: Final = "fpmatch/matching/_pair_mesh_kernel.py"
RING: Final = "fpmatch/pointset/unit_circle/_one_ring_kernel.py"
EVIDENCE: Final = "fpmatch/matching/_evidence_kernel.py"
BOUND: Final = (
    "min(2.0 + (total - low) / high, self._most_decades())",
    "(2.0 + (total - low) / high)",
)
SEARCH: Final = ("if ridges and (self.found == 0 or not self.most > confident):", "if False:")
RAISED: Final = ("least / squares if 0.0 < squares < least else 1.0", "1.0")
NOISE_OF_PLACES: Final = (
    "            self.place[k] = self.place[k] / around_a - self.other_place[k] / around_b\n",
    """            v = self.ring[k]
            dx = sin(12.9898 * self.ax[v] + 78.233 * self.by[v]) * 43758.5453
            self.place[k] = 0.5 * (dx - cython.cast(cython.Py_ssize_t, dx))
""",
)
WEIGHTS_END: Final = "        weight[s] += side * whole\n    return True\n"
RANDOM_WEIGHTS: Final = """        weight[s] += side * whole
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
EQUAL_WEIGHTS: Final = """        weight[s] += side * whole
    for line in range(begin, end):
        weight[line] = 1.0 / degree
    return True
"""
FIND_RING: Final = """        v = self.vertex_of[i]
        if v < 0:
            self._cavity(a[0, i], a[1, i])
        else:
            self._chain(self.fan_from, self.fan_to, self.fan_start[v], self.fan_start[v + 1])
        return self.ring_size
"""
NEAREST_RING: Final = """        own: cython.Py_ssize_t = self.vertex_of[i]
        k: cython.Py_ssize_t
        n: cython.Py_ssize_t = 0
        dx: cython.double
        dy: cython.double
        far: cython.double
        turn: cython.double
        # the six nearest vertices, then in the order of their directions
        for v in range(self.vertices):
            if v == own:
                continue
            dx = self.ax[v] - a[0, i]
            dy = self.ay[v] - a[1, i]
            far = dx * dx + dy * dy
            if n < 6:
                n += 1
            elif far >= self.place[n - 1]:
                continue
            k = n - 1
            while k > 0 and self.place[k - 1] > far:
                self.place[k] = self.place[k - 1]
                self.ring[k] = self.ring[k - 1]
                k -= 1
            self.place[k] = far
            self.ring[k] = cython.cast(cython.int, v)
        for k in range(n):
            v = self.ring[k]
            dx = self.ax[v] - a[0, i]
            dy = self.ay[v] - a[1, i]
            far = fabs(dx) + fabs(dy)
            turn = dy / far if far > 0.0 else 0.0
            self.place[k] = turn if dx >= 0.0 else (2.0 - turn if dy >= 0.0 else -2.0 - turn)
        for own in range(1, n):
            far = self.place[own]
            v = self.ring[own]
            k = own
            while k > 0 and self.place[k - 1] > far:
                self.place[k] = self.place[k - 1]
                self.ring[k] = self.ring[k - 1]
                k -= 1
            self.place[k] = far
            self.ring[k] = cython.cast(cython.int, v)
        self.ring_size = cython.cast(cython.int, n)
        return self.ring_size
"""
NEIGHBOURS: Final = (
    "    mesh = triangulate(points[:2].T)\n    rings = anchored_rings(points, mesh)\n"
)
NEAREST_NEIGHBOURS: Final = """    from types import SimpleNamespace
    from scipy.spatial import cKDTree
    near = np.empty((0, 1))
    if n:
        near = cKDTree(points[:2].T).query(points[:2].T, min(7, n))[1].reshape(n, -1)
    pairs = np.sort(np.stack([np.repeat(np.arange(n), near.shape[1]), near.ravel()], 1), axis=1)
    pairs = np.unique(pairs[pairs[:, 0] < pairs[:, 1]], axis=0).astype(np.int32)
    mesh = SimpleNamespace(edges=np.ascontiguousarray(pairs))
    rings = AnchoredRings(np.zeros(n + 1, np.int32), np.empty(0, np.int32), np.empty((3, 0)))
"""
PREDICTED: Final = (
    """                if measured and self.vertex_of[i] >= 0:
                    self._measure_one(a, i, b, partner[i])
                continue
""",
    """                if measured and self.vertex_of[i] >= 0:
                    self._measure_one(a, i, b, partner[i])
""",
)
REACH_OF_TRANSFORM: Final = (
    "            self.nearest[i] = FAR_AWAY\n",
    "            self.nearest[i] = 50.0\n",  # px: a reach of 16 px everywhere
)

RIDGE_FEATURES: Final = ("ridges", "area of the ridges", "ridges by area")
MESH_FEATURES: Final = (
    "places on the circle",
    "weights in the ring",
    "fullness of the rings",
    "triangles turned over",
    "strain",
)

VARIANTS: Final = (
    Variant("base"),
    Variant("places on the circle by noise", ((MESH, *NOISE_OF_PLACES),)),
    Variant("weights random", ((RING, WEIGHTS_END, RANDOM_WEIGHTS),)),
    Variant(
        "places and weights by noise",
        ((MESH, *NOISE_OF_PLACES), (RING, WEIGHTS_END, RANDOM_WEIGHTS)),
    ),
    Variant("weights equal", ((RING, WEIGHTS_END, EQUAL_WEIGHTS),)),
    Variant(
        "nearest neighbours instead of Delaunay",
        (
            (MESH, FIND_RING, NEAREST_RING),
            ("fpmatch/matching/neighbourhood.py", NEIGHBOURS, NEAREST_NEIGHBOURS),
        ),
    ),
    Variant(
        "no prediction by the mesh",
        ((MESH, *PREDICTED), (MESH, *REACH_OF_TRANSFORM)),
    ),
    Variant(
        "no relaxation",
        (("fpmatch/matching/relaxation.py", "    rounds: int = 5\n", "    rounds: int = 0\n"),),
    ),
    Variant("no evidence of the mesh", without=MESH_FEATURES),
    Variant(
        "neither prediction nor evidence of the mesh",
        ((MESH, *PREDICTED), (MESH, *REACH_OF_TRANSFORM)),
        MESH_FEATURES,
    ),
    Variant("no ridges", without=RIDGE_FEATURES),
    Variant("no search by the ridges", ((EVIDENCE, *SEARCH),)),
    Variant("sums not conditioned on how much was compared", conditioned=False),
    Variant("no bound on what few pairs can say", ((EVIDENCE, *BOUND),)),
    Variant("poor minutiae by their quality alone", ((EVIDENCE, *RAISED),)),
)


@dataclass(frozen=True)
class Work:
    """Hold what a variant is learned and measured on: templates by database, with their fingers."""

    learned: dict[str, list[tuple[int, Any]]]
    measured: dict[str, list[tuple[int, Any]]]


def extracted(folders: Sequence[Path], workers: int | None) -> dict[str, list[tuple[int, Any]]]:
    """Extract the templates of some databases."""
    from fpmatch.evaluation.extraction import extract_datasets  # noqa: PLC0415
    from fpmatch.evaluation.run import load_datasets  # noqa: PLC0415

    return {
        one.dataset.name: [
            (impression.finger, extraction.template)
            for impression, extraction in zip(one.dataset.impressions, one.extractions, strict=True)
        ]
        for one in extract_datasets(load_datasets(folders), workers=workers)
    }


def synthetic_templates(folder: Path, workers: int | None) -> dict[str, list[tuple[int, Any]]]:
    """Return the templates of the synthetic prints, made where they are not kept from before."""
    from research.synthetic_sets import TRAINING_SEED, make_synthetic_sets  # noqa: PLC0415

    kept = folder / "templates.pickle"
    if not kept.exists():
        folders = make_synthetic_sets(folder / "prints", first_seed=TRAINING_SEED, workers=workers)
        kept.write_bytes(pickle.dumps(extracted(folders, workers)))
    found: dict[str, list[tuple[int, Any]]] = pickle.loads(kept.read_bytes())
    return found


def make_copy(variant: Variant, into: Path) -> None:
    """Copy the package, replace the lines of the variant, and compile what changed."""
    for name in ("fpmatch", "build"):
        if (ROOT / name).exists():
            shutil.copytree(ROOT / name, into / name)
    for name in ("setup.py", "pyproject.toml", "README.md", "LICENSE"):
        shutil.copy2(ROOT / name, into / name)
    for file, old, new in variant.replaced:
        path = into / file
        text = path.read_text(encoding="utf-8")
        if text.count(old) != 1:
            raise SystemExit(f"ablation: {variant.name}: {file} no longer has what is replaced")
        path.write_text(text.replace(old, new), encoding="utf-8")
    if any(file.endswith("_kernel.py") for file, _, _ in variant.replaced):
        build = [sys.executable, "setup.py", "build_ext", "--inplace"]
        subprocess.run(build, cwd=into, check=True, capture_output=True)


def run_worker(work: Path, variant: int, base_weights: Path, into: Path) -> None:
    """Learn and measure one variant in this process, whose package is the variant's."""
    from fpmatch.evaluation.all_pairs import compare_all_pairs  # noqa: PLC0415
    from fpmatch.matching import score  # noqa: PLC0415
    from fpmatch.minutiae import Minutiae, Template  # noqa: PLC0415
    from research.training.evidence_quantiles import AmountParameters, fit_amounts  # noqa: PLC0415
    from research.training.score_fit import fit_weights  # noqa: PLC0415
    from research.training.score_samples import SampleParameters, samples_of  # noqa: PLC0415

    given: Work = pickle.loads(work.read_bytes())
    parameters = SampleParameters(
        every_impostor=EVERY_IMPOSTOR, every_window_impostor=4 * EVERY_IMPOSTOR
    )
    sets = [_as_extracted(name, rows) for name, rows in given.learned.items()]
    learned = fit_weights(*samples_of(sets, parameters), without=VARIANTS[variant].without)
    if VARIANTS[variant].conditioned:
        learned = fit_amounts(learned, sets, parameters=AmountParameters(probes=PROBES))
    if not base_weights.exists():
        base_weights.write_text(learned.as_json(), encoding="utf-8")
    base = score.ScoreWeights.from_json(base_weights.read_text(encoding="utf-8"))
    nothing = Template(Minutiae.empty(), 1, 1)
    found: dict[str, Any] = {}
    for weights, key in ((learned, "learned"), (base, "base")):
        score.load_weights = lambda weights=weights: weights
        for name, rows in given.measured.items():
            for kind in KINDS:
                templates = [nothing if one is None else one for _, one in rows]
                if kind != KINDS[0]:
                    templates = [replace(one, field=None) for one in templates]
                found[key, kind, name] = compare_all_pairs(templates)
    into.write_bytes(pickle.dumps(found))


def _as_extracted(name: str, rows: list[tuple[int, Any]]) -> Any:
    """Return templates in the form in which `sample_of` takes a database."""
    from types import SimpleNamespace  # noqa: PLC0415

    impressions = [
        SimpleNamespace(finger=finger, impression=k) for k, (finger, _) in enumerate(rows)
    ]
    return SimpleNamespace(
        dataset=SimpleNamespace(name=name, impressions=impressions),
        extractions=[SimpleNamespace(template=template) for _, template in rows],
    )


def measure(variants: Sequence[int], work: Work) -> dict[int, dict[Any, np.ndarray]]:
    """Return the similarities of each variant, each in a process of its own."""
    found = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        given, base_weights = folder / "work.pickle", folder / "base.json"
        given.write_bytes(pickle.dumps(work))
        for number in variants:
            print(f"ablation: {VARIANTS[number].name}", file=sys.stderr, flush=True)
            copy, result = folder / f"copy-{number}", folder / f"result-{number}.pickle"
            copy.mkdir()
            make_copy(VARIANTS[number], copy)
            command = [
                sys.executable,
                __file__,
                "--worker",
                *map(str, (given, number, base_weights, result)),
            ]
            subprocess.run(
                command, check=True, env={**os.environ, "PYTHONPATH": str(copy)}, cwd=folder
            )
            found[number] = pickle.loads(result.read_bytes())
            shutil.rmtree(copy)
    return found


def rows_of(found: dict[int, dict[Any, np.ndarray]], work: Work) -> list[dict[str, Any]]:
    """Return what the table shows of each variant."""
    from fpmatch.evaluation.bootstrap import RESAMPLED, Trials, resample_rates  # noqa: PLC0415
    from fpmatch.evaluation.intervals import interval_of  # noqa: PLC0415
    from fpmatch.evaluation.rates import error_rates  # noqa: PLC0415

    names = list(work.measured)
    sides = {}
    for name, rows in work.measured.items():
        _, finger = np.unique([one for one, _ in rows], return_inverse=True)
        first, second = np.triu_indices(len(rows), 1)
        sides[name] = finger[first], finger[second], int(finger.max()) + 1
    rows = []
    drawn: dict[str, Any] = {}
    for number, similarity in found.items():
        row: dict[str, Any] = {"name": VARIANTS[number].name}
        for kind in KINDS:
            trials = [Trials(similarity["learned", kind, name], *sides[name]) for name in names]
            rates = [error_rates(t.similarity[t.genuine], t.similarity[~t.genuine]) for t in trials]
            pooled = error_rates(
                *(
                    np.concatenate([t.similarity[t.genuine == same] for t in trials])
                    for same in (True, False)
                )
            )
            draws = resample_rates(trials, RESAMPLES, 0).mean
            drawn.setdefault(kind, draws)
            change = {
                rate: interval_of((draws - drawn[kind])[:, RESAMPLED.index(rate)])
                for rate in ("eer", "fmr1000")
            }
            same = [
                np.mean(similarity["base", kind, name] == found[min(found)]["base", kind, name])
                for name in names
            ]
            row[kind] = {
                "sets": {
                    name: {"eer": one.eer, "fmr1000": one.fmr1000}
                    for name, one in zip(names, rates, strict=True)
                },
                "mean": {
                    rate: float(np.mean([getattr(one, rate) for one in rates]))
                    for rate in ("eer", "fmr1000")
                },
                "pooled": {"eer": pooled.eer, "fmr1000": pooled.fmr1000},
                "change": {
                    rate: None if one is None else [one.low, one.high]
                    for rate, one in change.items()
                },
                "identical": float(np.mean(same)),
            }
        rows.append(row)
    return rows


def main() -> int:
    """Run the script; return its exit status."""
    if sys.argv[1:2] == ["--worker"]:
        work, number, weights, into = sys.argv[2:]
        run_worker(Path(work), int(number), Path(weights), Path(into))
        return 0
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "databases", metavar="DIR", type=Path, nargs="+", help="databases to measure"
    )
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the results as JSON")
    parser.add_argument(
        "--variant",
        action="append",
        choices=[v.name for v in VARIANTS],
        help="measure this variant beside the base (repeatable; default: all)",
    )
    parser.add_argument(
        "--keep",
        metavar="FOLDER",
        type=Path,
        help="keep the synthetic prints and their templates here",
    )
    parser.add_argument(
        "--workers", type=int, help="processes to use for extraction (default: one a core)"
    )
    options = parser.parse_args()
    from fpmatch.errors import FpmatchError  # noqa: PLC0415
    from fpmatch.output import atomic_write_bytes, check_writable  # noqa: PLC0415
    from research.tables.accuracy import format_ablation  # noqa: PLC0415

    try:
        if options.json:
            check_writable(options.json)
        with tempfile.TemporaryDirectory() as temporary:
            keep = options.keep or Path(temporary)
            keep.mkdir(parents=True, exist_ok=True)
            folders = [one for one in options.databases if one.is_dir()]
            work = Work(
                synthetic_templates(keep, options.workers), extracted(folders, options.workers)
            )
            chosen = [
                number
                for number, variant in enumerate(VARIANTS)
                if number == 0 or not options.variant or variant.name in options.variant
            ]
            rows = rows_of(measure(chosen, work), work)
        print(format_ablation(rows))
        if options.json:
            atomic_write_bytes(options.json, f"{json.dumps(rows, indent=1)}\n".encode())
    except FpmatchError as error:
        print(f"ablation: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
