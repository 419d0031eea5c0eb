# mypy: ignore-errors
"""Kernel: the similarities of a probe to many prints."""

import cython
from cython.cimports.fpmatch.matching.pipeline._kernels._evidence_kernel import as_similarity
from cython.cimports.fpmatch.matching.pipeline._kernels._pipeline_kernel import Pipeline
from cython.cimports.fpmatch.matching.prints._kernels._template_view_kernel import TemplateView


@cython.locals(k=cython.Py_ssize_t)
def compare_each(
    pipeline: Pipeline,
    views: list,
    order: cython.const[cython.schar][::1],
    similarity: cython.double[::1],
):
    """Fill the similarities of the probe of a pipeline to prints.

    Where ``order[k]`` is negative the print comes before the probe, where it is positive after;
    where it is 0, the similarity is not touched. Other threads may run meanwhile.
    """
    for k in range(order.shape[0]):
        if order[k] != 0:
            view: TemplateView = views[k]
            with cython.nogil:
                similarity[k] = compare(pipeline, view, order[k] < 0)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def compare(pipeline: Pipeline, view: TemplateView, before_probe: cython.bint) -> cython.double:
    """Return the similarity of the probe of a pipeline to another print."""
    if view.size == 0 or pipeline.probe.size == 0:
        return 0.0
    estimate: cython.double = pipeline.rejected(view, before_probe)
    if not estimate < 0.0:
        estimate = pipeline.match(view, before_probe)
        if pipeline.best < 0:
            return 0.0
    return as_similarity(estimate)
