"""Error rates of variants of the package, in which lines of its source are replaced."""

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

from fpmatch.lab.evaluation.rates.bootstrap import BOOTSTRAPPED, bootstrap_rates
from fpmatch.lab.evaluation.rates.error_rates import error_rates
from fpmatch.lab.evaluation.rates.intervals import interval_of
from fpmatch.lab.evaluation.rates.scores_set import Trials
from fpmatch.matching.pipeline import evidence as score
from fpmatch.matching.pipeline.score_model import ScoreWeights
from fpmatch.templates.minutiae import Minutiae, Template
from research.all_pairs import compare_all_pairs
from research.commands import PATH, ROOT, Command, folders, json_file, print_and_write, workers
from research.databases import TRAINING_SEED, extract_folders, make_synthetic_sets, without_ridges
from research.tables.accuracy import FORMS, format_ablation
from research.training.evidence_quantiles import AmountParameters, fit_amounts
from research.training.score_fit import fit_weights
from research.training.score_samples import SampleParameters, samples_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Templates = dict[str, list[tuple[int | str, Template | None]]]
    Similarities = dict[tuple[str, str, str], NDArray[np.float64]]

EVERY_IMPOSTOR: Final = 12
PROBES: Final = 30  # of each kind and database, to measure what impostors reach
RESAMPLES: Final = 1000
REPORTED: Final = ("eer", "fmr1000")


@dataclass(frozen=True)
class Variant:
    """Describe a variant: the lines that replace others, and features without a weight.

    `replaced`: file of the package, the lines that occur in it once, and those that replace them.
    """

    name: str
    replaced: tuple[tuple[str, str, str], ...] = ()
    without: tuple[str, ...] = ()  # features of the score that get no weight
    conditioned: bool = True  # whether the sums are conditioned on how much was compared


@dataclass(frozen=True)
class Work:
    """The templates that a variant is trained and measured on, by database, with fingers."""

    trained_on: Templates
    measured: Templates


def ablation_command(variants: Sequence[Variant], script: str) -> click.Command:
    """Return the command that measures variants, the first of which is the base."""

    @click.command(cls=Command)
    @folders
    @click.option("--variant", "names", multiple=True, help="Only this one and the base.")
    @click.option("--keep", metavar="FOLDER", type=PATH, help="Keep the synthetic templates here.")
    @json_file
    @workers
    def command(
        folders: tuple[Path, ...],
        names: tuple[str, ...],
        keep: Path | None,
        json_file: Path | None,
        workers: int | None,
    ) -> None:
        """Measure what each part of the default matcher is worth, by taking it out.

        Each DIR is an FVC-style database. A variant is the package with a few lines of its source
        replaced, in a temporary copy that is compiled again. Its score weights and its prefilter
        are trained on the synthetic prints of ``python -m research train score``, on one impostor
        comparison in twelve, and its sums are conditioned on how much was compared; the base is
        trained in the same way. Then all pairs of every database are compared by the extended
        protocol, with the templates as they are extracted and on their minutiae alone.

        Printed are, for each variant, mean and pooled EER and FMR1000 in percent, the difference of
        the mean EER from the base with its 95 % bootstrap interval (fingers resampled), and the
        share of all scores that are identical to those of the base when both use the base's
        weights. The templates of the synthetic prints are kept in the folder of --keep, for the
        next run.
        """
        if unknown := set(names) - {one.name for one in variants}:
            raise click.BadParameter(f"no variant {min(unknown)!r}")
        with tempfile.TemporaryDirectory() as temporary:
            kept = keep or Path(temporary)
            kept.mkdir(parents=True, exist_ok=True)
            work = Work(_synthetic_templates(kept, workers), _extracted(folders, workers))
        chosen = [k for k, one in enumerate(variants) if not k or not names or one.name in names]
        rows = _rows_of(variants, _measure(variants, chosen, work, script), work)
        print_and_write(format_ablation(rows), rows, json_file)

    return command


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


def run_worker(
    variants: Sequence[Variant], work: str, variant: str, base_weights: str, into: str
) -> None:
    """Train and measure one variant in this process, whose package is the variant's."""
    given: Work = pickle.loads(Path(work).read_bytes())
    chosen, base_file = variants[int(variant)], Path(base_weights)
    every = SampleParameters(
        every_impostor=EVERY_IMPOSTOR, every_window_impostor=4 * EVERY_IMPOSTOR
    )
    sets = [_as_extracted(name, rows) for name, rows in given.trained_on.items()]
    trained = fit_weights(*samples_of(sets, every), without=chosen.without)
    if chosen.conditioned:
        trained = fit_amounts(trained, sets, parameters=AmountParameters(probes=PROBES))
    if not base_file.exists():
        base_file.write_text(trained.as_json(), encoding="utf-8")
    base = ScoreWeights.from_json(base_file.read_text(encoding="utf-8"))
    empty = Template(Minutiae.empty(), 1, 1)
    found: Similarities = {}
    for weights, key in ((trained, "trained"), (base, "base")):
        score.load_weights = lambda weights=weights: weights  # type: ignore[assignment]
        for name, rows in given.measured.items():
            for form in FORMS:
                templates = [empty if one is None else one for _, one in rows]
                if form != FORMS[0]:
                    templates = [without_ridges(one) for one in templates]
                found[key, form, name] = compare_all_pairs(templates)
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


def _measure(
    variants: Sequence[Variant], chosen: Sequence[int], work: Work, script: str
) -> dict[int, Similarities]:
    """Return the similarities of each chosen variant, measured in a process of its own."""
    found = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        given, base_weights = folder / "work.pickle", folder / "base.json"
        given.write_bytes(pickle.dumps(work))
        for number in chosen:
            click.echo(variants[number].name, err=True)
            copy, result = folder / f"copy-{number}", folder / f"result-{number}.pickle"
            copy.mkdir()
            _make_copy(variants[number], copy)
            words = (given, number, base_weights, result)
            command = [sys.executable, script, "--worker", *map(str, words)]
            environment = {**os.environ, "PYTHONPATH": str(copy)}
            subprocess.run(command, check=True, env=environment, cwd=folder)
            found[number] = pickle.loads(result.read_bytes())
            shutil.rmtree(copy)
    return found


def _rows_of(
    variants: Sequence[Variant], found: dict[int, Similarities], work: Work
) -> list[dict[str, Any]]:
    """Return a row for each variant: its rates, their changes, and identical scores by form."""
    sides = {}
    for name, templates in work.measured.items():
        _, finger = np.unique([one for one, _ in templates], return_inverse=True)
        first, second = np.triu_indices(len(templates), 1)
        sides[name] = finger[first], finger[second], int(finger.max()) + 1
    base = found[min(found)]
    rows: list[dict[str, Any]] = []
    base_draws: dict[str, NDArray[np.float64]] = {}
    for number, similarity in found.items():
        rows.append({"name": variants[number].name})
        for form in FORMS:
            trials = [Trials(similarity["trained", form, name], *sides[name]) for name in sides]
            rates = [error_rates(t.similarity[t.genuine], t.similarity[~t.genuine]) for t in trials]
            genuine, impostor = (
                np.concatenate([t.similarity[t.genuine == same] for t in trials])
                for same in (True, False)
            )
            pooled = error_rates(genuine, impostor)
            draws = bootstrap_rates(trials, RESAMPLES, 0).mean
            base_draws.setdefault(form, draws)
            change = {
                rate: interval_of((draws - base_draws[form])[:, BOOTSTRAPPED.index(rate)])
                for rate in REPORTED
            }
            identical = [
                np.mean(similarity["base", form, name] == base["base", form, name])
                for name in sides
            ]
            rows[-1][form] = {
                "sets": {
                    name: {rate: getattr(one, rate) for rate in REPORTED}
                    for name, one in zip(sides, rates, strict=True)
                },
                "mean": {
                    rate: float(np.mean([getattr(one, rate) for one in rates])) for rate in REPORTED
                },
                "pooled": {rate: getattr(pooled, rate) for rate in REPORTED},
                "change": {
                    rate: None if one is None else [one.low, one.high]
                    for rate, one in change.items()
                },
                "identical": float(np.mean(identical)),
            }
    return rows
