"""Error rates of fitted models on the samples that they are fitted to, or on others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.lab.evaluation.rates.error_rates import error_rates
from research.training.score_fit import best_hypotheses
from research.training.score_samples import LOCAL_HYPOTHESES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.pipeline.score_model import ScoreModel
    from research.training.score_samples import ScoreSample


def rates_of(samples: Sequence[ScoreSample], models: Sequence[ScoreModel]) -> dict[str, Any]:
    """Return the error rates of databases, each scored by its own model, in percent.

    `samples`: the databases. `models`: one for each. The result is under ``"sets"``, ``"mean"`` and
    ``"pooled"`` the EER and the FNMR at an FMR of 0.1 %.
    """
    scores = [_sums(*row) for row in zip(samples, models, strict=True)]
    sets = [_rates(*row) for row in scores]
    mean = {name: round(float(np.mean([one[name] for one in sets])), 3) for name in sets[0]}
    pooled = _rates(*(np.concatenate(kind) for kind in zip(*scores, strict=True)))
    named = {one.name: row for one, row in zip(samples, sets, strict=True)}
    return {"mean": mean, "pooled": pooled, "sets": named}


def _greatest(
    every: NDArray[np.float64], model: ScoreModel, *, coarse: bool = False
) -> NDArray[np.float64]:
    """Return the greatest sum of each comparison; minus infinity where there is no hypothesis."""
    if not every.shape[1]:
        return np.full(len(every), -np.inf)
    return best_hypotheses(every, model.standard, model.bias, coarse=coarse)[1]


def _sums(
    sample: ScoreSample, model: ScoreModel
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the sums of the genuine and the impostor comparisons; least where nothing was found.

    They are in the order of the similarities, which are those of ``log(1 + e^sum)``.
    """
    local, by_ridges = np.split(sample.features, [LOCAL_HYPOTHESES], axis=1)
    total = _greatest(local, model)
    coarse = _greatest(sample.coarse, model, coarse=True)
    total = np.where(coarse > model.refine_threshold, total, coarse)
    total = np.maximum(total, _greatest(by_ridges, model))
    total = np.where(
        np.isfinite(total), total, np.min(total, where=np.isfinite(total), initial=0.0)
    )
    least = float(total.min(initial=0.0)) - 1.0
    kinds = (total[sample.genuine], total[~sample.genuine])
    genuine, impostor = (
        np.append(kind, np.full(count, least))
        for kind, count in zip(kinds, sample.nothing, strict=True)
    )
    return genuine, impostor


def _rates(genuine: NDArray[np.float64], impostor: NDArray[np.float64]) -> dict[str, float]:
    rates = error_rates(genuine, impostor)
    return {
        "eer": round(100.0 * (rates.eer or 0.0), 3),
        "fmr1000": round(100.0 * (rates.fmr1000 or 0.0), 3),
    }
