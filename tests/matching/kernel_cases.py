"""What the compiled kernels make of pairs and prints that are given."""

import numpy as np

from fpmatch.matching.matchers.unit_circle import index_neighbours, view_of
from fpmatch.matching.parameters import USUAL
from fpmatch.matching.pipeline._kernels._pipeline_kernel import Pipeline
from fpmatch.matching.pipeline.evidence import Evidence, load_weights
from fpmatch.matching.reference.neighbourhood import local_similarity

IDENTITY = (1.0, 0.0, 0.0, 0.0)


def pipeline_for(*prints, weights=None, parameters=USUAL):
    """Return a pipeline of its own for these prints."""
    return Pipeline(max(1, *map(len, prints)), parameters, weights or load_weights())


def match(a, b, pipeline):
    """Match print A with print B, in the order of their content; return -ln(FMR), or None."""
    pipeline.load(view_of(a))
    index_neighbours(pipeline, a)
    estimate = pipeline.match(view_of(b), False)
    return None if pipeline.best < 0 else estimate


def impose(aligner, a, b, partner, transform):
    """Let given pairs under a given transform be the current ones of an aligner, measured."""
    aligner.load(a.points, len(a), b.points, len(b))
    np.asarray(aligner.partner)[: len(partner)] = partner
    np.asarray(aligner.weight)[: len(partner)] = partner >= 0
    aligner.pairs = np.count_nonzero(partner >= 0)
    aligner.c, aligner.s, aligner.x, aligner.y = map(float, transform)
    with np.errstate(over="ignore", invalid="ignore"):
        aligner.predict(True)
    return aligner


def overlay(a, b, partner, transform=IDENTITY, *, weights=None, pipeline=None):
    """Return the evidence of an alignment that is given, the ridges compared."""
    similarity = local_similarity(a.neighbourhoods, b.neighbourhoods)
    pipeline = pipeline or pipeline_for(a, b, weights=weights)
    aligner = impose(pipeline.aligner, a, b, partner, transform)
    aligner.relaxation.load(a.points, len(a), b.points, len(b), similarity)
    sides, scorer = (view_of(a), view_of(b)), pipeline.scorer
    scorer.choose_model(*sides)
    scorer.weigh(*sides, aligner, similarity, True, 0)
    aligner.keep(0)
    estimate = scorer.estimate(*sides, aligner, 0)
    return Evidence(*scorer.evidence, scorer.total, estimate)
