# mypy: ignore-errors
"""Kernel: the estimates of -ln(FMR) of a probe and many prints."""

import cython
from cython.cimports.fpmatch.matching.pipeline._kernels._pipeline_kernel import Pipeline
from cython.cimports.fpmatch.matching.prints._kernels._template_view_kernel import TemplateView

UNPAIRED = cython.declare(cython.double, float("-inf"))  # the estimate where nothing is paired


@cython.locals(k=cython.Py_ssize_t)
def compare_each(
    pipeline: Pipeline,
    views: list,
    order: cython.const[cython.schar][::1],
    estimate: cython.double[::1],
):
    """Fill the estimates of -ln(FMR) of the probe of a pipeline and prints.

    Where ``order[k]`` is negative the print comes before the probe, where it is positive after;
    where it is 0, the estimate is not touched. It is minus infinity where nothing is paired. Other
    threads may run meanwhile.
    """
    for k in range(order.shape[0]):
        if order[k] != 0:
            view: TemplateView = views[k]
            with cython.nogil:
                estimate[k] = compare(pipeline, view, order[k] < 0)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def compare(pipeline: Pipeline, view: TemplateView, before_probe: cython.bint) -> cython.double:
    """Return the estimate of -ln(FMR) of the probe of a pipeline and another print."""
    if view.size == 0 or pipeline.probe.size == 0:
        return UNPAIRED
    estimate: cython.double = pipeline.rejected(view, before_probe)
    if not estimate < 0.0:
        estimate = pipeline.match(view, before_probe)
        if pipeline.best < 0:
            return UNPAIRED
    return estimate
