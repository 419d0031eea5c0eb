# Types of the kernel, and what other kernels may use of it.
from fpmatch.matching.pipeline._kernels._pair_mesh_kernel cimport PairMesh
from fpmatch.matching.pipeline._kernels._relaxation_kernel cimport Relaxation


cdef class MinutiaGrid:
    cdef readonly int[::1] start, item
    cdef readonly double x0, y0, per_px, reach
    cdef readonly int columns, rows

    cpdef int load(self, double[:, ::1] points, Py_ssize_t size) noexcept nogil
    cdef int _line(self, double place) noexcept nogil


cdef class Aligner:
    cdef readonly Py_ssize_t size_a, size_b
    cdef readonly Relaxation relaxation
    cdef readonly PairMesh mesh
    cdef readonly MinutiaGrid grid
    cdef readonly double[:, ::1] a, b, predicted
    cdef readonly double[::1] reach, weight, rival_weight
    cdef public int pairs
    cdef readonly int[::1] partner, former, paired, rival, kept_pairs
    cdef readonly int[:, ::1] kept_partner
    cdef readonly double[:, ::1] kept_weight, kept_transform
    cdef readonly double[:, :, ::1] kept_predicted
    cdef public double c, s, x, y
    cdef readonly double min_cosine, reach_px, reach_per_px, reach_limit_px
    cdef readonly int hypotheses, coarse_rounds, rounds, rows
    cdef Py_ssize_t measured_row

    cpdef int load(
        self, double[:, ::1] a, Py_ssize_t size_a, double[:, ::1] b, Py_ssize_t size_b
    ) noexcept nogil
    cpdef int relax(self, float[:, ::1] similarity) noexcept nogil
    cpdef int start_hypothesis(self, Py_ssize_t k) noexcept nogil
    cpdef int refine(self, Py_ssize_t k) noexcept nogil
    cpdef int start_from(self, Py_ssize_t i, Py_ssize_t j, Py_ssize_t row) noexcept nogil
    cpdef int keep(self, Py_ssize_t row) noexcept nogil
    cdef int _list_pairs(self) noexcept nogil
    cdef int _first_fit(self) noexcept nogil
    cpdef int grow(self, int rounds, bint measured) noexcept nogil
    cpdef int measure(self) noexcept nogil
    cdef int _predict(self, bint measured) noexcept nogil
    cpdef double pair(self) noexcept nogil
    cpdef int fit(self) noexcept nogil
    cpdef int copy_kept(
        self, Py_ssize_t row, double[::1] transform, int[::1] partner, double[::1] weight
    )
