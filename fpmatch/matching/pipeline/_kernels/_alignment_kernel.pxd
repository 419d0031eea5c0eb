# Types of the kernel, and what other kernels may use of it.
from fpmatch.matching.pipeline._kernels._pair_mesh_kernel cimport PairMesh
from fpmatch.matching.pipeline._kernels._relaxation_kernel cimport Relaxation

# of `matching.constants`
cdef double DIRECTION_ARM2, LEAST_SCALE, MOST_SCALE
cdef int FEWEST_FOR_SCALE


cdef class Aligner:
    cdef readonly Py_ssize_t size_a, size_b
    cdef readonly Relaxation relaxation
    cdef readonly PairMesh mesh
    cdef double[:, ::1] a, b, sorted
    cdef readonly double[:, ::1] predicted
    cdef double[::1] reach, rival_weight
    cdef readonly double[::1] weight
    cdef readonly int[::1] partner, kept_pairs
    cdef int[::1] former, order, rival
    cdef readonly int[:, ::1] kept_partner
    cdef readonly double[:, ::1] kept_weight, kept_transform
    cdef double[:, :, ::1] kept_predicted
    cdef public int pairs
    cdef public double c, s, x, y
    cdef double min_cosine, reach_px, reach_per_px, reach_limit_px
    cdef readonly int hypotheses, rows
    cdef int coarse_rounds, rounds
    cdef Py_ssize_t measured_row

    cpdef int load(
        self, double[:, ::1] a, Py_ssize_t size_a, double[:, ::1] b, Py_ssize_t size_b
    ) noexcept nogil
    cpdef int start_hypothesis(self, Py_ssize_t k) noexcept nogil
    cpdef int refine(self, Py_ssize_t k) noexcept nogil
    cpdef int start_from(self, Py_ssize_t i, Py_ssize_t j, Py_ssize_t row) noexcept nogil
    cpdef int keep(self, Py_ssize_t row) noexcept nogil
    cdef int _first_fit(self) noexcept nogil
    cpdef int grow(self, int rounds, bint measured) noexcept nogil
    cpdef int predict(self, bint measured) noexcept nogil
    cdef int _pair(self) noexcept nogil
    cdef int _fit(self) noexcept nogil
