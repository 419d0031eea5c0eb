"""Kernel: lay one print over the other and pair their minutiae, one to one.

Minutiae are columns of an array (4, N): x, y in pixels at 500 dpi with y pointing up, and the unit
vector (c, s) of the direction. A transform is (c, s, x, y): the scale times cosine and sine of the
rotation, and the shift. Interpreted, the class runs as it stands and gives the same pairs.
"""

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.libc.math import sqrt
else:
    from math import sqrt

COMPILED = cython.compiled

# Of the grid in which minutiae near a place are looked up:
CELL_PX = cython.declare(cython.double, 16.0)
MOST_CELLS = cython.declare(cython.int, 32)  # along what the minutiae take up; if need be larger
MOST_REACHED = cython.declare(cython.int, 6)  # cells in a line within the reach of one minutia
MARGIN = cython.declare(cython.double, 0.01)  # px, more than rounding does to a cell's border
STILLNESS = cython.declare(cython.double, 0.6)  # the weight of the belief that skin has not bent
STIFFNESS = cython.declare(cython.double, 800.0)  # px²: of that it bends everywhere alike
MOMENTS = cython.declare(cython.Py_ssize_t, 12)
DIRECTION_ARM2 = cython.declare(cython.double, 900.0)  # px²: see `LightTable.fit`
LEAST_SCALE = cython.declare(cython.double, 0.94)
MOST_SCALE = cython.declare(cython.double, 1.06)
FEWEST_FOR_SCALE = cython.declare(cython.int, 4)
FAR_AWAY = cython.declare(cython.double, 1e12)  # px², farther than any other minutia


@cython.final
@cython.cclass
class LightTable:
    """A table on which print A is laid over print B.

    There is room for `size_a` and `size_b` minutiae and for `seeds` seeds; `parameters` are an
    `fpmatch.matching.align.AlignmentParameters`. ``laid[:4]`` are the minutiae of A as moved by
    the transform at hand, ``laid[4:]`` their places once bent with the skin; ``partner[i]`` the
    index in B of what minutia i of A is paired with, or -1, and ``weight[i]`` how well it fits;
    ``paired[:pairs]`` lists those of A that are paired.
    """

    def __init__(self, size_a, size_b, seeds, parameters) -> None:
        p = parameters
        self.size_a = 0
        self.size_b = 0
        self.a = np.empty((4, size_a))
        self.b = np.empty((4, size_b))
        self.laid = np.empty((6, size_a))
        self.apart = np.empty((size_a, size_a))
        self.pull = np.empty((size_a, size_a))
        self.known = np.zeros(size_a, np.int32)
        self.reach = np.empty(size_a)
        self.moments = np.empty((MOMENTS, size_a))
        self.own_moments = np.empty(MOMENTS)
        self.nearest = np.empty(size_a)
        self.pairs = 0
        self.best_pairs = 0
        self.paired = np.empty(size_a, np.int32)
        self.partner = np.full(size_a, -1, np.int32)
        self.weight = np.zeros(size_a)
        self.rival = np.empty(size_b, np.int32)
        self.rival_weight = np.empty(size_b)
        self.best_partner = np.full(size_a, -1, np.int32)
        self.best_weight = np.zeros(size_a)
        self.best_bent = np.empty((4, size_a))
        self.transforms = np.empty((seeds, 4))
        self.support = np.empty(seeds)
        self.spent = np.zeros(seeds, np.int32)
        self.chosen = np.empty(seeds, np.int32)
        self.sketched = np.empty((p.candidates, size_a), np.int32)
        self.sketches = 0
        self.min_cosine = p.min_cosine
        self.candidates = p.candidates
        self.first_seeds = p.first_seeds
        self.seed_near = p.seed_reach_px
        self.seed_spread = p.seed_reach_per_px
        self.seed_far = p.seed_reach_limit_px
        self.rigid_rounds = p.rigid_rounds
        self.rigid_reach = p.rigid_reach_px
        self.bend_rounds = p.bend_rounds
        self.bend_scale = -0.5 / (p.bend_sigma_px * p.bend_sigma_px)
        self.bend_near = p.bend_reach_px
        self.bend_spread = p.bend_reach_per_px
        self.bend_far = p.bend_reach_limit_px
        self.farthest = max(self.seed_far, self.rigid_reach, self.bend_far)
        self.start = np.zeros((MOST_CELLS + MOST_REACHED) ** 2 + 1, np.int32)
        self.item = np.empty(MOST_REACHED * MOST_REACHED * size_b, np.int32)
        self.columns = 0
        self.rows = 0
        self.x0 = 0.0
        self.y0 = 0.0
        self.per_px = 0.0

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def put_a(self, points: cython.double[:, ::1], size: cython.Py_ssize_t) -> cython.int:
        """Take the first `size` columns of `points` as print A."""
        row: cython.Py_ssize_t
        i: cython.Py_ssize_t
        self.size_a = size
        for row in range(4):
            for i in range(size):
                self.a[row, i] = points[row, i]
        return 0

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def put_b(self, points: cython.double[:, ::1], size: cython.Py_ssize_t) -> cython.int:
        """Take the first `size` columns of `points` as print B, and note where they are near.

        Each cell of a grid lists, in their order, all minutiae within any reach of it.
        """
        j: cython.Py_ssize_t
        cell: cython.Py_ssize_t
        cells: cython.Py_ssize_t
        filling: cython.int
        row: cython.int
        column: cython.int
        first_column: cython.int
        last_column: cython.int
        first_row: cython.int
        last_row: cython.int
        count: cython.int
        behind: cython.int
        x1: cython.double
        y1: cython.double
        side: cython.double
        reach: cython.double = self.farthest + MARGIN
        self.size_b = size
        self.columns = 0
        self.rows = 0
        if size == 0:
            return 0
        self.x0 = x1 = points[0, 0]
        self.y0 = y1 = points[1, 0]
        for j in range(size):
            self.b[0, j] = points[0, j]
            self.b[1, j] = points[1, j]
            self.b[2, j] = points[2, j]
            self.b[3, j] = points[3, j]
            self.x0 = points[0, j] if points[0, j] < self.x0 else self.x0
            self.y0 = points[1, j] if points[1, j] < self.y0 else self.y0
            x1 = points[0, j] if points[0, j] > x1 else x1
            y1 = points[1, j] if points[1, j] > y1 else y1
        side = x1 - self.x0 if x1 - self.x0 > y1 - self.y0 else y1 - self.y0
        side = side / MOST_CELLS
        side = side if side > CELL_PX else CELL_PX
        side = side if side > 0.5 * reach else 0.5 * reach
        self.per_px = 1.0 / side
        self.x0 -= reach
        self.y0 -= reach
        self.columns = self._line(x1 + reach - self.x0) + 1
        self.rows = self._line(y1 + reach - self.y0) + 1
        cells = self.columns * self.rows
        for cell in range(cells + 1):
            self.start[cell] = 0
        for filling in range(2):
            for j in range(size):
                first_column = self._line(points[0, j] - reach - self.x0)
                last_column = self._line(points[0, j] + reach - self.x0)
                first_row = self._line(points[1, j] - reach - self.y0)
                last_row = self._line(points[1, j] + reach - self.y0)
                for row in range(first_row, last_row + 1):
                    for column in range(first_column, last_column + 1):
                        cell = row * self.columns + column
                        if filling:
                            self.item[self.start[cell]] = cython.cast(cython.int, j)
                        self.start[cell] += 1
            if not filling:
                # to the starts of the cells, from which on they run ahead while the cells fill
                behind = 0
                for cell in range(cells):
                    count = self.start[cell]
                    self.start[cell] = behind
                    behind += count
                self.start[cells] = behind
        for cell in range(cells - 1, 0, -1):
            self.start[cell] = self.start[cell - 1]
        self.start[0] = 0
        return 0

    @cython.cfunc
    @cython.inline
    @cython.nogil
    @cython.exceptval(check=False)
    def _line(self, place: cython.double) -> cython.int:
        """Return the row or column of the grid at a distance from its first."""
        return cython.cast(cython.int, place * self.per_px)

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def propose(self, seeds: cython.int[:, ::1], count: cython.Py_ssize_t) -> cython.int:
        """List the candidates that the first `count` seeds lead to; return their number."""
        self.best_pairs = 0
        self.sketches = 0
        self.support_of_seeds(seeds, 0, count)
        return self.choose(count)

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def propose_more(
        self, seeds: cython.int[:, ::1], known: cython.Py_ssize_t, count: cython.Py_ssize_t
    ) -> cython.int:
        """List those that `count` seeds lead to where `known` have proposed; return their number.

        What the table has kept stays.
        """
        self.sketches = 0
        self.support_of_seeds(seeds, known, count)
        return self.choose(count)

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def sketch(self, k: cython.Py_ssize_t) -> cython.double:
        """Pair under the k-th candidate's own transform, rigidly; return the weight of the pairs.

        It is the first round of `take`.
        """
        n: cython.Py_ssize_t = self.chosen[k]
        self.c = self.transforms[n, 0]
        self.s = self.transforms[n, 1]
        self.x = self.transforms[n, 2]
        self.y = self.transforms[n, 3]
        return self.begin()

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def begin(self) -> cython.double:
        """Pair rigidly under the transform at hand; return the weight of the pairs."""
        i: cython.Py_ssize_t
        total: cython.double
        for i in range(self.size_a):
            self.reach[i] = self.rigid_reach
        self.move()
        total = self.pair(0)
        for i in range(self.size_a):
            self.laid[4, i] = self.laid[0, i]
            self.laid[5, i] = self.laid[1, i]
        return total

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def take(self, k: cython.Py_ssize_t) -> cython.double:
        """Refine the k-th candidate; return the weight of its pairs.

        Nothing is paired where it begins with the same pairs as one taken before it.
        """
        i: cython.Py_ssize_t
        e: cython.Py_ssize_t
        differing: cython.int
        self.sketch(k)
        for e in range(self.sketches):
            differing = 0
            for i in range(self.size_a):
                differing += self.sketched[e, i] != self.partner[i]
            if differing == 0:
                self.pairs = 0
                return 0.0
        for i in range(self.size_a):
            self.sketched[self.sketches, i] = self.partner[i]
        self.sketches += 1
        return self.finish()

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def support_of_seeds(
        self, seeds: cython.int[:, ::1], first: cython.Py_ssize_t, last: cython.Py_ssize_t
    ) -> cython.int:
        """Let seeds, pairs of minutiae (i, j), propose a transform each; refine it once; weigh it.

        These are those from number `first` up to, not including, `last`.

        The seed's own directions give the rotation, its positions the shift. Minutiae are paired
        within a reach that grows with the distance from the seed; the transform fitted to these
        pairs goes to ``transforms[k]``, the sum of the pairs' weights to ``support[k]``.
        """
        k: cython.Py_ssize_t
        i: cython.Py_ssize_t
        p: cython.Py_ssize_t
        q: cython.Py_ssize_t
        r: cython.double
        px: cython.double
        py: cython.double
        a: cython.double[:, ::1] = self.a
        b: cython.double[:, ::1] = self.b
        reach: cython.double[::1] = self.reach
        near: cython.double = self.seed_near
        spread: cython.double = self.seed_spread
        far: cython.double = self.seed_far
        for k in range(first, last):
            p = seeds[k, 0]
            q = seeds[k, 1]
            self.c = a[2, p] * b[2, q] + a[3, p] * b[3, q]
            self.s = a[2, p] * b[3, q] - a[3, p] * b[2, q]
            self.x = b[0, q] - self.c * a[0, p] + self.s * a[1, p]
            self.y = b[1, q] - self.s * a[0, p] - self.c * a[1, p]
            px = a[0, p]
            py = a[1, p]
            for i in range(self.size_a):
                r = (a[0, i] - px) * (a[0, i] - px) + (a[1, i] - py) * (a[1, i] - py)
                r = near + spread * sqrt(r)
                reach[i] = r if r < far else far
            self.move()
            self.support[k] = self.pair(0)
            self.fit()
            self.transforms[k, 0] = self.c
            self.transforms[k, 1] = self.s
            self.transforms[k, 2] = self.x
            self.transforms[k, 3] = self.y
        return 0

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def choose(self, count: cython.Py_ssize_t) -> cython.int:
        """List up to `candidates` seeds of most support in `chosen`; return their number.

        Of those that led to the same transform, and of those of equal support, the first comes.
        """
        k: cython.Py_ssize_t
        n: cython.Py_ssize_t
        best: cython.Py_ssize_t
        found: cython.int = 0
        same: cython.int
        most: cython.double
        for k in range(count):
            self.spent[k] = 0
        while found < self.candidates:
            best = -1
            most = -1.0
            for k in range(count):
                if not self.spent[k] and self.support[k] > most:
                    most = self.support[k]
                    best = k
            if best < 0:
                break
            self.spent[best] = 1
            same = 0
            for k in range(found):
                n = self.chosen[k]
                if (
                    self.transforms[n, 0] == self.transforms[best, 0]
                    and self.transforms[n, 1] == self.transforms[best, 1]
                    and self.transforms[n, 2] == self.transforms[best, 2]
                    and self.transforms[n, 3] == self.transforms[best, 3]
                ):
                    same = 1
            if not same:
                self.chosen[found] = cython.cast(cython.int, best)
                found += 1
        return found

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def finish(self) -> cython.double:
        """Refit and re-pair in turn, first rigidly, then bending with the skin; return the weight.

        The pairs at hand are those of the first rigid round.
        """
        i: cython.Py_ssize_t
        r: cython.int
        total: cython.double = 0.0
        self.fit()
        for r in range(1, self.rigid_rounds):
            self.move()
            total = self.pair(0)
            self.fit()
        self.move()
        for i in range(self.size_a):
            self.known[i] = 0
            self.laid[4, i] = self.laid[0, i]
            self.laid[5, i] = self.laid[1, i]
        for r in range(self.bend_rounds):
            self.bend()
            total = self.pair(4)
        return total

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def bend(self) -> cython.int:
        """Bend print A with the skin, and set the reach of its minutiae.

        Every minutia is displaced as the other pairs are: by the residual, where it lies, of the
        plane fitted to theirs by weighted least squares, the near ones weighing the most. Its reach
        grows with the distance from the nearest other pair.
        """
        i: cython.Py_ssize_t
        k: cython.Py_ssize_t
        p: cython.Py_ssize_t
        e: cython.Py_ssize_t
        g: cython.double
        w: cython.double
        x: cython.double
        y: cython.double
        rx: cython.double
        ry: cython.double
        mx: cython.double
        my: cython.double
        sxx: cython.double
        sxy: cython.double
        syy: cython.double
        n: cython.Py_ssize_t = self.size_a
        near: cython.double = self.bend_near
        spread: cython.double = self.bend_spread
        far: cython.double = self.bend_far
        laid: cython.double[:, ::1] = self.laid
        pull: cython.double[:, ::1] = self.pull
        apart: cython.double[:, ::1] = self.apart
        own: cython.double[::1] = self.own_moments
        m: cython.double[:, ::1] = self.moments
        nearest: cython.double[::1] = self.nearest
        reach: cython.double[::1] = self.reach
        for e in range(MOMENTS):
            for i in range(n):
                m[e, i] = 0.0
        for i in range(n):
            nearest[i] = FAR_AWAY
        for p in range(self.pairs):
            k = self.paired[p]
            if not self.known[k]:
                self._know(k)
            w = self.weight[k]
            x = laid[0, k]
            y = laid[1, k]
            rx = w * (self.b[0, self.partner[k]] - x)
            ry = w * (self.b[1, self.partner[k]] - y)
            own[0] = w
            own[1] = w * x
            own[2] = w * y
            own[3] = w * x * x
            own[4] = w * x * y
            own[5] = w * y * y
            own[6] = rx
            own[7] = rx * x
            own[8] = rx * y
            own[9] = ry
            own[10] = ry * x
            own[11] = ry * y
            for e in range(MOMENTS):
                w = own[e]
                for i in range(n):
                    m[e, i] += w * pull[k, i]
            for i in range(n):
                nearest[i] = apart[k, i] if apart[k, i] < nearest[i] else nearest[i]
        for i in range(n):
            # about minutia i
            x = laid[0, i]
            y = laid[1, i]
            mx = m[1, i] - x * m[0, i]
            my = m[2, i] - y * m[0, i]
            sxx = m[3, i] - x * (m[1, i] + mx) + STIFFNESS
            sxy = m[4, i] - x * m[2, i] - y * mx
            syy = m[5, i] - y * (m[2, i] + my) + STIFFNESS
            # what is left of mass and residuals once the slopes have taken their part
            g = 1.0 / (sxx * syy - sxy * sxy)
            rx = (syy * mx - sxy * my) * g
            ry = (sxx * my - sxy * mx) * g
            g = 1.0 / (m[0, i] + STILLNESS - rx * mx - ry * my)
            w = 1.0 + rx * x + ry * y
            laid[4, i] = x + (w * m[6, i] - rx * m[7, i] - ry * m[8, i]) * g
            laid[5, i] = y + (w * m[9, i] - rx * m[10, i] - ry * m[11, i]) * g
            g = near + spread * sqrt(nearest[i])
            reach[i] = g if g < far else far
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def _know(self, k: cython.Py_ssize_t) -> cython.int:
        """Note how far minutia k is from the others, and how much they are drawn by it."""
        i: cython.Py_ssize_t
        dx: cython.double
        dy: cython.double
        g: cython.double
        p: cython.double
        px: cython.double = self.laid[0, k]
        py: cython.double = self.laid[1, k]
        scale: cython.double = self.bend_scale / -64.0
        laid: cython.double[:, ::1] = self.laid
        apart: cython.double[:, ::1] = self.apart
        pull: cython.double[:, ::1] = self.pull
        for i in range(self.size_a):
            dx = px - laid[0, i]
            dy = py - laid[1, i]
            apart[k, i] = dx * dx + dy * dy
        for i in range(self.size_a):
            # e^(-64g) is 1/(e^g)^64, where a few terms of the series are as good as all
            g = scale * float(apart[k, i])
            p = 1.0 + g * (1 / 5.0) * (1.0 + g * (1 / 6.0) * (1.0 + g * (1 / 7.0)))
            p = 1.0 + g * (1.0 + g * (1 / 2.0) * (1.0 + g * (1 / 3.0) * (1.0 + g * (1 / 4.0) * p)))
            p *= p
            p *= p
            p *= p
            p *= p
            p *= p
            p *= p
            pull[k, i] = 1.0 / p
        self.apart[k, k] = FAR_AWAY
        self.pull[k, k] = 0.0
        self.known[k] = 1
        return 0

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def move(self) -> cython.int:
        """Lay print A as the transform says; directions turn, their length stays one."""
        i: cython.Py_ssize_t
        a: cython.double[:, ::1] = self.a
        laid: cython.double[:, ::1] = self.laid
        c: cython.double = self.c
        s: cython.double = self.s
        x: cython.double = self.x
        y: cython.double = self.y
        scale: cython.double = sqrt(c * c + s * s)
        for i in range(self.size_a):
            laid[0, i] = x + c * a[0, i] - s * a[1, i]
            laid[1, i] = y + s * a[0, i] + c * a[1, i]
        c /= scale
        s /= scale
        for i in range(self.size_a):
            laid[2, i] = c * a[2, i] - s * a[3, i]
            laid[3, i] = s * a[2, i] + c * a[3, i]
        return 0

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def pair(self, row: cython.Py_ssize_t) -> cython.double:
        """Pair minutiae of A with those of B, each with the one it fits best, where it is mutual.

        Those of A lie where rows `row` and ``row + 1`` of `laid` say. A pair at distance d within
        the reach r of its minutia, with directions at cosine t, weighs
        ``(1 - d²/2r²)·(t - min_cosine)/(1 - min_cosine)``. The sum of the weights is returned.
        """
        i: cython.Py_ssize_t
        j: cython.Py_ssize_t
        e: cython.Py_ssize_t
        cell: cython.Py_ssize_t
        best_j: cython.Py_ssize_t
        x: cython.double
        y: cython.double
        place: cython.double
        line: cython.double
        d2: cython.double
        r2: cython.double
        cosine: cython.double
        value: cython.double
        best: cython.double
        total: cython.double = 0.0
        found: cython.Py_ssize_t = 0
        least: cython.double = self.min_cosine
        scale: cython.double = 1.0 / (1.0 - least)
        for j in range(self.size_b):
            self.rival[j] = -1
            self.rival_weight[j] = 0.0
        for i in range(self.size_a):
            self.partner[i] = -1
            self.weight[i] = 0.0
            x = self.laid[row, i]
            y = self.laid[row + 1, i]
            place = (x - self.x0) * self.per_px
            line = (y - self.y0) * self.per_px
            if not (0.0 <= place < self.columns and 0.0 <= line < self.rows):
                continue
            cell = cython.cast(cython.Py_ssize_t, line) * self.columns
            cell += cython.cast(cython.Py_ssize_t, place)
            best = 0.0
            best_j = -1
            r2 = self.reach[i] * self.reach[i]
            for e in range(self.start[cell], self.start[cell + 1]):
                j = self.item[e]
                d2 = (self.b[0, j] - x) * (self.b[0, j] - x)
                d2 += (self.b[1, j] - y) * (self.b[1, j] - y)
                cosine = self.laid[2, i] * self.b[2, j] + self.laid[3, i] * self.b[3, j]
                # both told at once, for that one of them fails nearly always, but either often not
                if not (cython.cast(cython.int, d2 < r2) & cython.cast(cython.int, cosine > least)):
                    continue
                value = (1.0 - 0.5 * d2 / r2) * (cosine - least) * scale
                if value > best:
                    best = value
                    best_j = j
                if value > self.rival_weight[j]:
                    self.rival_weight[j] = value
                    self.rival[j] = cython.cast(cython.int, i)
            if best_j >= 0:
                self.partner[i] = cython.cast(cython.int, best_j)
                self.weight[i] = best
                self.paired[found] = cython.cast(cython.int, i)
                found += 1
        self.pairs = 0
        for e in range(found):
            i = self.paired[e]
            if self.rival[self.partner[i]] == i:
                total += self.weight[i]
                self.paired[self.pairs] = cython.cast(cython.int, i)
                self.pairs += 1
            else:
                self.partner[i] = -1
                self.weight[i] = 0.0
        return total

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.cdivision(True)
    @cython.exceptval(check=False)
    def fit(self) -> cython.int:
        """Fit the similarity transform to the pairs by weighted least squares; return their number.

        The directions of the pairs count as well as their positions do at 30 px from the middle,
        so that few pairs, or pairs close together, leave the rotation no freedom. With fewer than
        two pairs the transform stays as it is. The scale is held within 6 % of one.
        """
        i: cython.Py_ssize_t
        j: cython.Py_ssize_t
        p: cython.Py_ssize_t
        n: cython.int = self.pairs
        w: cython.double
        total: cython.double = 0.0
        amx: cython.double = 0.0
        amy: cython.double = 0.0
        bmx: cython.double = 0.0
        bmy: cython.double = 0.0
        cosine: cython.double = 0.0
        sine: cython.double = 0.0
        spread: cython.double = 0.0
        turn_c: cython.double = 0.0
        turn_s: cython.double = 0.0
        dx: cython.double
        dy: cython.double
        ex: cython.double
        ey: cython.double
        length: cython.double
        scale: cython.double
        for p in range(n):
            i = self.paired[p]
            j = self.partner[i]
            w = self.weight[i]
            total += w
            amx += w * self.a[0, i]
            amy += w * self.a[1, i]
            bmx += w * self.b[0, j]
            bmy += w * self.b[1, j]
        if n < 2 or total <= 0.0:
            return n
        amx /= total
        amy /= total
        bmx /= total
        bmy /= total
        for p in range(n):
            i = self.paired[p]
            j = self.partner[i]
            w = self.weight[i]
            dx = self.a[0, i] - amx
            dy = self.a[1, i] - amy
            ex = self.b[0, j] - bmx
            ey = self.b[1, j] - bmy
            cosine += w * (dx * ex + dy * ey)
            sine += w * (dx * ey - dy * ex)
            spread += w * (dx * dx + dy * dy)
            turn_c += w * (self.a[2, i] * self.b[2, j] + self.a[3, i] * self.b[3, j])
            turn_s += w * (self.a[2, i] * self.b[3, j] - self.a[3, i] * self.b[2, j])
        scale = sqrt(cosine * cosine + sine * sine) / spread if spread > 0.0 else 1.0
        if n < FEWEST_FOR_SCALE:
            scale = 1.0
        if scale < LEAST_SCALE:
            scale = LEAST_SCALE
        if scale > MOST_SCALE:
            scale = MOST_SCALE
        cosine += DIRECTION_ARM2 * turn_c
        sine += DIRECTION_ARM2 * turn_s
        length = sqrt(cosine * cosine + sine * sine)
        if length <= 0.0:
            return n
        self.c = scale * cosine / length
        self.s = scale * sine / length
        self.x = bmx - self.c * amx + self.s * amy
        self.y = bmy - self.s * amx - self.c * amy
        return n

    @cython.ccall
    @cython.nogil
    @cython.boundscheck(False)
    @cython.wraparound(False)
    @cython.exceptval(check=False)
    def keep(self) -> cython.int:
        """Keep the alignment at hand as the best; return the number of its pairs."""
        i: cython.Py_ssize_t
        self.best_pairs = self.pairs
        self.best_c = self.c
        self.best_s = self.s
        self.best_x = self.x
        self.best_y = self.y
        for i in range(self.size_a):
            self.best_partner[i] = self.partner[i]
            self.best_weight[i] = self.weight[i]
            self.best_bent[0, i] = self.laid[4, i]
            self.best_bent[1, i] = self.laid[5, i]
            self.best_bent[2, i] = self.laid[2, i]
            self.best_bent[3, i] = self.laid[3, i]
        return self.pairs
