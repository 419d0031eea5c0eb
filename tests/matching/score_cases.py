"""Evidence of alignments that are given, for the tests of evidence and score."""

import math
from dataclasses import replace

import numpy as np
from kernel_cases import aligner_of, impose
from matching_prints import jittered, moved, spread_points, striped_field, template_of
from matching_weights import some_weights

from fpmatch.matching.pipeline.match import evidence_of, evidence_scorer
from fpmatch.matching.prints.prepare import prepare
from fpmatch.matching.reference.neighbourhood import local_similarity

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
ENTRIES = (
    *("pairs", "local", "unpaired", "common", "overlap", "relaxed", "places", "weights"),
    *("fullness", "fewest", "ridges", "cells", "area", "chance"),
)
SHOWN = striped_field(side=25)
NOT_SHOWN = replace(SHOWN, ridges=None)


def entries_of(found):
    return [getattr(found, name) for name in ENTRIES]


def overlay(a, b, partner, transform=IDENTITY, weights=None, scorer=None):
    """Return the evidence of an alignment that is given."""
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    scorer = scorer or evidence_scorer(max(len(a), len(b)), weights or some_weights())
    aligner = impose(aligner_of(a.points, b.points), partner, transform)
    aligner.relax(similarity)
    sides = a.for_kernels(), b.for_kernels()
    return evidence_of(scorer, scorer.score_alignment(*sides, aligner, similarity))


def with_itself(print_, unpaired=0, weights=None):
    """Return the evidence of a print aligned with itself, all minutiae paired but the first."""
    partner = np.arange(len(print_), dtype=np.int32)
    partner[:unpaired] = -1
    return overlay(print_, print_, partner, weights=weights)


def scorer_of(weights, /, *, shown=True, **entries):
    """Return a scorer that holds evidence of which all that is not given is 0."""
    scorer = evidence_scorer(0, weights)
    np.asarray(scorer.evidence)[:] = [entries.get(name, 0.0) for name in ENTRIES]
    scorer.choose_model(shown, shown, math.inf)
    return scorer


def total_of(model, features):
    """Return the weighted sum of features, as the docstring of `score` defines it."""
    middle, spread, weight, _ = model.standard
    return float(model.bias + (weight * (features - middle) / spread).sum())


def some_case(seed):
    """Return two prints, pairs of their minutiae, and a transform."""
    rng = np.random.default_rng(seed)
    points = spread_points(rng, int(rng.integers(0, 14)), size=150.0)
    n = points.shape[1]
    turn, scale = rng.uniform(-0.5, 0.5), rng.uniform(0.94, 1.06)
    shift = complex(*rng.uniform(-30, 30, 2))
    sides = []
    for side in (points, jittered(rng, moved(points, turn, shift, scale), 3.0, 0.1)):
        field = striped_field(side=int(rng.integers(2, 10)), step=rng.choice([12.0, 16.0, 21.7]))
        mask = rng.random(field.mask.shape) < rng.choice([0.6, 0.9, 1.0])
        ridges = field.ridges if rng.random() < 0.7 else None
        quality = rng.integers(0, 101, n)
        chosen = replace(field, mask=mask, ridges=ridges) if rng.random() < 0.85 else None
        sides.append(prepare(template_of(side, quality=quality, field=chosen)))
    likely = np.arange(n) if rng.random() < 0.5 else rng.permutation(n)
    partner = np.where(rng.random(n) < 0.7, likely, -1).astype(np.int32)
    linear = scale * np.exp(1j * turn)
    return *sides, partner, np.array([linear.real, linear.imag, shift.real, shift.imag])
