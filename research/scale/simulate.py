"""Simulation of searches of a sharded gallery: queues, replicas, and the loss of a machine.

Probes arrive as a Poisson process. Each is sent to every shard, to the replica with the shortest
queue, and is answered when the last shard has answered. A machine serves one search at a time with
all its cores. The time of a search is lognormal: one factor for the probe, one for the machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from research.scale.constants import Assumptions
    from research.scale.plan import Plan

PROBES: Final = 20_000
QUANTILES: Final = (0.5, 0.95, 0.99)


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """The fate of each probe: seconds from arrival to answer, and whether all answered."""

    arrival: NDArray[np.float64]
    latency: NDArray[np.float64]
    whole: NDArray[np.bool_]

    def quantiles(self, chosen: NDArray[np.bool_] | slice = slice(None)) -> list[float]:
        """Return `QUANTILES` of the latency of some probes."""
        return [float(value) for value in np.quantile(self.latency[chosen], QUANTILES)]


def simulate(
    plan: Plan,
    a: Assumptions,
    *,
    rate: float,
    probes: int = PROBES,
    down: tuple[float, float] | None = None,
    replicas: int | None = None,
) -> Run:
    """Simulate some probes, `rate` a second, on the machines of a plan.

    The first machine serves nothing in the seconds from ``down[0]`` to ``down[1]``; what it was
    doing is lost, and asked of the next replica. Where no replica is left, the answer is of the
    other shards.
    """
    rng = np.random.default_rng(0)
    count = plan.replicas if replicas is None else replicas
    gaps = rng.exponential(1.0 / rate, probes)
    arrival = np.cumsum(gaps)
    of_probe = plan.service_s * np.exp(rng.normal(-(a.spread**2) / 2, a.spread, probes))
    backlog = np.zeros((count, plan.shards))
    latency, whole = np.empty(probes), np.ones(probes, bool)
    columns = np.arange(plan.shards)
    was_down = False
    for k in range(probes):
        np.maximum(backlog - gaps[k], 0.0, out=backlog)
        is_down = down is not None and down[0] <= arrival[k] < down[1]
        if is_down and not was_down and count > 1:
            backlog[1:, 0] += backlog[0, 0] / (count - 1)
        if is_down:
            backlog[0, 0] = np.inf
        elif was_down:
            backlog[0, 0] = 0.0
        was_down = is_down
        chosen = backlog.argmin(axis=0)
        noise = np.exp(rng.normal(-(a.jitter**2) / 2, a.jitter, plan.shards))
        done = backlog[chosen, columns] + of_probe[k] * noise
        lost = np.isinf(done)
        backlog[chosen, columns] = done
        whole[k] = not lost.any()
        latency[k] = done[~lost].max(initial=0.0)
    overhead = (a.front_ms + a.network_ms) / 1e3
    return Run(arrival, latency + overhead, whole)


def load_rows(plan: Plan, a: Assumptions, factors: tuple[float, ...]) -> list[dict[str, Any]]:
    """Return quantiles of the latency at multiples of the searches that are planned for."""
    rows = []
    for factor in factors:
        run = simulate(plan, a, rate=factor * plan.searches_s)
        used = factor * plan.utilisation
        rows.append({"factor": factor, "utilisation": used, "quantiles_s": run.quantiles()})
    return rows


def loss_row(plan: Plan, a: Assumptions, *, replicas: int, down_s: float) -> dict[str, Any]:
    """Return what the loss of a machine does, at the searches that so many replicas are for."""
    rate = plan.searches_s * replicas / plan.replicas
    probes = max(PROBES, min(10 * PROBES, round(3 * down_s * rate)))
    begin = probes / rate / 3
    end = min(begin + down_s, 2 * begin)
    run = simulate(plan, a, rate=rate, probes=probes, down=(begin, end), replicas=replicas)
    meanwhile = (run.arrival >= begin) & (run.arrival < end)
    before = run.arrival < begin
    return {
        "replicas": replicas,
        "down_s": down_s,
        "before_s": run.quantiles(before),
        "meanwhile_s": run.quantiles(meanwhile) if meanwhile.any() else run.quantiles(before),
        "partial": float((~run.whole[meanwhile]).mean()) if meanwhile.any() else 0.0,
    }
