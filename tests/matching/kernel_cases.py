"""What the compiled kernels make of pairs and prints that are given."""

import numpy as np

from fpmatch.matching.pipeline.match import Workspace, make_aligner
from fpmatch.matching.pipeline.parameters import USUAL


def aligner_of(a, b):
    """Return an aligner that holds two prints, minutiae (4, N) and (4, M)."""
    aligner = make_aligner(a.shape[1], b.shape[1])
    aligner.load(a, a.shape[1], b, b.shape[1])
    return aligner


def impose(aligner, partner, transform):
    """Let given pairs under a given transform be the alignment at hand, measured."""
    listed = np.flatnonzero(partner >= 0)
    np.asarray(aligner.partner)[: len(partner)] = partner
    np.asarray(aligner.weight)[: len(partner)] = partner >= 0
    np.asarray(aligner.paired)[: len(listed)] = listed
    aligner.pairs = len(listed)
    aligner.c, aligner.s, aligner.x, aligner.y = map(float, transform)
    aligner.measure()
    return aligner


def match(a, b, scorer=None, parameters=USUAL):
    """Match print A with print B, in the order of their content; None if nothing is paired."""
    workspace = Workspace(max(len(a), len(b)), scorer, parameters)
    workspace.load(a)
    return workspace.match(b, reference_first=False)
