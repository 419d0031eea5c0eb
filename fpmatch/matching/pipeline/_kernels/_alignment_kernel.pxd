# Types of the kernel, and what other kernels may use of it.
from fpmatch.matching.pipeline._kernels._minutia_grid_kernel cimport MinutiaGrid
from fpmatch.matching.pipeline._kernels._pair_mesh_kernel cimport PairMesh
from fpmatch.matching.pipeline._kernels._relaxation_kernel cimport Relaxation


cdef class Aligner:
    cdef readonly Py_ssize_t size_a, size_b
    cdef readonly Relaxation relaxation
    cdef readonly PairMesh mesh
    cdef readonly MinutiaGrid grid
    cdef readonly double[:, ::1] a, b, predicted, best_predicted
    cdef readonly double[::1] reach, weight, rival_weight, best_weight
    cdef public int pairs, best_pairs
    cdef readonly int[::1] partner, former, paired, rival, best_partner
    cdef int[:, ::1] coarse_partner
    cdef double[:, ::1] coarse_weight, coarse_transform
    cdef public double c, s, x, y
    cdef readonly double best_c, best_s, best_x, best_y
    cdef readonly double min_cosine, reach_px, reach_per_px, reach_limit_px
    cdef readonly int hypotheses, coarse_rounds, rounds
    cdef Py_ssize_t at_hand

    cpdef int load_a(self, double[:, ::1] points, Py_ssize_t size) noexcept nogil
    cpdef int load_b(self, double[:, ::1] points, Py_ssize_t size) noexcept nogil
    cpdef int relax(self, float[:, ::1] similarity) noexcept nogil
    cpdef int start_hypothesis(self, Py_ssize_t k) noexcept nogil
    cpdef int refine(self, Py_ssize_t k) noexcept nogil
    cpdef int start_from(self, Py_ssize_t i, Py_ssize_t j) noexcept nogil
    cdef int _save_coarse(self, Py_ssize_t k) noexcept nogil
    cdef int _list_pairs(self) noexcept nogil
    cdef int _first_fit(self) noexcept nogil
    cpdef int grow(self, int rounds, bint measured) noexcept nogil
    cpdef int measure(self) noexcept nogil
    cdef int _predict(self, bint measured) noexcept nogil
    cpdef int impose(
        self, int[::1] partner, double c, double s, double x, double y
    ) noexcept nogil
    cpdef double pair(self) noexcept nogil
    cpdef int fit(self) noexcept nogil
    cpdef int save_best(self) noexcept nogil
    cpdef int copy_best(
        self, double[::1] transform, int[::1] partner, double[::1] weight,
        double[:, ::1] predicted,
    )
