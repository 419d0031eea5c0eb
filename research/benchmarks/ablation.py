#!/usr/bin/env python3
"""Measure what each part of the default matcher is worth, by taking it out.

    .venv/bin/python research/benchmarks/ablation.py DIR... [--json FILE] [--variant NAME]...
        [--keep FOLDER]

`research.experiments.ablation` measures the variants that are listed here.
"""

import sys
from typing import Final

import repository  # noqa: F401

from research.experiments.ablation import Variant, ablation_command, run_worker

PARAMETERS: Final = "fpmatch/matching/pipeline/parameters.py"
MESH: Final = "fpmatch/matching/pipeline/_kernels/_pair_mesh_kernel.py"
RING: Final = "fpmatch/pointset/paper/_one_ring_kernel.py"
EVIDENCE: Final = "fpmatch/matching/pipeline/_kernels/_evidence_kernel.py"
SCORE: Final = "fpmatch/matching/pipeline/parameters.py"
PIPELINE: Final = "fpmatch/matching/pipeline/_kernels/_pipeline_kernel.py"
AMOUNT: Final = "fpmatch/matching/pipeline/_kernels/_amount_kernel.py"
BOUND: Final = ("min(2.0 + (total - low) / high, limit)", "(2.0 + (total - low) / high)")
SEARCH: Final = ("if doubtful and not self._is_confident(best):", "if False:")
BEYOND: Final = ('0.8, "share of the rarity', '0.0, "share of the rarity')
RAISED: Final = ("least / squares if 0.0 < squares < least else 1.0", "1.0")
NOISE_OF_PLACES: Final = (
    "            self.place[k] = self.place[k] / around_a - self.other_place[k] / around_b\n",
    """            v = self.ring[k]
            dx = sin(12.9898 * self.ax[v] + 78.233 * self.by[v]) * 43758.5453
            self.place[k] = 0.5 * (dx - cython.cast(cython.Py_ssize_t, dx))
""",
)
WEIGHTS_END: Final = "        weight[s] += side * whole\n    return True\n"
RANDOM_WEIGHTS: Final = """        weight[s] += side * whole
    whole = 0.0
    for line in range(begin, end):
        own = 12.9898 * px[vertex[line]] + 78.233 * py[vertex[line]] + 37.719 * x + 4.581 * y
        own = own * 43.7585453
        own = own - cython.cast(cython.Py_ssize_t, own)
        weight[line] = 0.01 + (own if own > 0.0 else -own)
        whole += weight[line]
    for line in range(begin, end):
        weight[line] /= whole
    return True
"""
EQUAL_WEIGHTS: Final = """        weight[s] += side * whole
    for line in range(begin, end):
        weight[line] = 1.0 / degree
    return True
"""
FIND_RING: Final = """        v: cython.Py_ssize_t = self.vertex_of[i]
        if v < 0:
            self._cavity(a[0, i], a[1, i])
        else:
            self._chain(self.fan_from, self.fan_to, self.fan_start[v], self.fan_start[v + 1])
        return self.ring_size
"""
NEAREST_RING: Final = """        own: cython.Py_ssize_t = self.vertex_of[i]
        k: cython.Py_ssize_t
        n: cython.Py_ssize_t = 0
        dx: cython.double
        dy: cython.double
        far: cython.double
        turn: cython.double
        # the six nearest vertices, then in the order of their directions
        for v in range(self.vertices):
            if v == own:
                continue
            dx = self.ax[v] - a[0, i]
            dy = self.ay[v] - a[1, i]
            far = dx * dx + dy * dy
            if n < 6:
                n += 1
            elif far >= self.place[n - 1]:
                continue
            k = n - 1
            while k > 0 and self.place[k - 1] > far:
                self.place[k] = self.place[k - 1]
                self.ring[k] = self.ring[k - 1]
                k -= 1
            self.place[k] = far
            self.ring[k] = cython.cast(cython.int, v)
        for k in range(n):
            v = self.ring[k]
            dx = self.ax[v] - a[0, i]
            dy = self.ay[v] - a[1, i]
            far = fabs(dx) + fabs(dy)
            turn = dy / far if far > 0.0 else 0.0
            self.place[k] = turn if dx >= 0.0 else (2.0 - turn if dy >= 0.0 else -2.0 - turn)
        for own in range(1, n):
            far = self.place[own]
            v = self.ring[own]
            k = own
            while k > 0 and self.place[k - 1] > far:
                self.place[k] = self.place[k - 1]
                self.ring[k] = self.ring[k - 1]
                k -= 1
            self.place[k] = far
            self.ring[k] = cython.cast(cython.int, v)
        self.ring_size = cython.cast(cython.int, n)
        return self.ring_size
"""
NEIGHBOURS: Final = """        mesh = triangulate_checked(points[:2, first:end].T.copy())
        closed = mesh.interior.view(np.uint8)
"""
NEAREST_NEIGHBOURS: Final = """        from types import SimpleNamespace
        from scipy.spatial import cKDTree
        near, of = np.empty((0, 1)), end - first
        if of:
            xy = points[:2, first:end].T
            near = cKDTree(xy).query(xy, min(7, of))[1].reshape(of, -1)
        pairs = np.stack([np.repeat(np.arange(of), near.shape[1]), near.ravel()], 1)
        pairs = np.sort(pairs, axis=1)
        pairs = np.unique(pairs[pairs[:, 0] < pairs[:, 1]], axis=0).astype(np.int32)
        mesh = SimpleNamespace(
            edges=np.ascontiguousarray(pairs),
            ring_start=np.zeros(of + 1, np.int32),
            ring=np.empty(0, np.int32),
        )
        closed = np.zeros(of, np.uint8)
"""
PREDICTED: Final = (
    """                if measured and self.vertex_of[i] >= 0:
                    self._measure_one(a, i, b, partner[i])
                continue
""",
    """                if measured and self.vertex_of[i] >= 0:
                    self._measure_one(a, i, b, partner[i])
""",
)
REACH_OF_TRANSFORM: Final = (
    "            self.nearest[i] = FAR_AWAY\n",
    "            self.nearest[i] = 50.0\n",  # px: a reach of 16 px everywhere
)

RIDGE_FEATURES: Final = ("ridges", "area of the ridges", "ridges by area")
MESH_FEATURES: Final = (
    "places on the circle",
    "weights in the ring",
    "fullness of the rings",
    "triangles turned over",
    "strain",
)

VARIANTS: Final = (
    Variant("base"),
    Variant("places on the circle by noise", ((MESH, *NOISE_OF_PLACES),)),
    Variant("weights random", ((RING, WEIGHTS_END, RANDOM_WEIGHTS),)),
    Variant(
        "places and weights by noise",
        ((MESH, *NOISE_OF_PLACES), (RING, WEIGHTS_END, RANDOM_WEIGHTS)),
    ),
    Variant("weights equal", ((RING, WEIGHTS_END, EQUAL_WEIGHTS),)),
    Variant(
        "nearest neighbours instead of Delaunay",
        (
            (MESH, FIND_RING, NEAREST_RING),
            ("fpmatch/matching/prints/neighbourhood.py", NEIGHBOURS, NEAREST_NEIGHBOURS),
        ),
    ),
    Variant("no prediction by the mesh", ((MESH, *PREDICTED), (MESH, *REACH_OF_TRANSFORM))),
    Variant(
        "no relaxation", ((PARAMETERS, "_rounds: int = parameter(5", "_rounds: int = parameter(0"),)
    ),
    Variant("no evidence of the mesh", without=MESH_FEATURES),
    Variant(
        "neither prediction nor evidence of the mesh",
        ((MESH, *PREDICTED), (MESH, *REACH_OF_TRANSFORM)),
        MESH_FEATURES,
    ),
    Variant("no ridges", without=RIDGE_FEATURES),
    Variant("no search by the ridges", ((PIPELINE, *SEARCH),)),
    Variant("sums not conditioned on how much was compared", conditioned=False),
    Variant("no bound on what few pairs can say", ((EVIDENCE, *BOUND),)),
    Variant("pairs not held against chance", ((SCORE, *BEYOND),)),
    Variant("poor minutiae by their quality alone", ((AMOUNT, *RAISED),)),
)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--worker"]:
        run_worker(VARIANTS, *sys.argv[2:])
    else:
        ablation_command(VARIANTS, __file__)()
