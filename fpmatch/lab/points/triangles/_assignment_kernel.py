# mypy: ignore-errors
"""Kernel: the best one-to-one pairing of two overlaid point sets.

Of all pairings within a distance t, the one with the least Σ(d² - t²) over its pairs: many pairs,
and near ones; leaving a pair out costs t². Points are assigned one after the other along shortest
augmenting paths. After a number of visits that only crowded points and wide tolerances need, each
path is sought among few points; the pairing is then nearly the best.
"""

import cython

COMPILED = cython.compiled

# Points visited until paths are kept short: these, and so many for each point.
_MAX_VISITS = cython.declare(cython.longlong, 2_000_000)
_MAX_VISITS_PER_POINT = cython.declare(cython.longlong, 200)
_SHORT = cython.declare(cython.longlong, 500)  # points visited for one path then


@cython.locals(visits=cython.longlong, end=cython.int, end_edge=cython.int, e=cython.Py_ssize_t)
def assign(start, near, cost, least_gain, edge, owner, path, work):
    """Assign candidates to points at the least cost in all; return how many have one.

    ``edge[i]`` receives the candidate of point i, or -1 (during the search, its entry in ``near``);
    ``owner`` receives the point of each candidate. Improvements under `least_gain` are rounding.
    ``path`` (N,) and ``work`` (5, N) are work space.
    """
    came_from, came_by, stamp = work[0], work[1], work[2]
    queue, waits = work[3], work[4]  # a ring buffer, and whether a point is in it
    size = edge.shape[0]
    assigned: cython.int = 0
    visits, most = 0, _MAX_VISITS + _MAX_VISITS_PER_POINT * size
    for s in range(size):
        edge[s] = stamp[s] = -1
        waits[s] = 0
    for s in range(owner.shape[0]):
        owner[s] = -1
    for s in range(size):
        # cheapest way to give s a candidate, or to leave s or a point that it displaces without one
        i: cython.int = s
        end, end_edge, best = i, -1, 0.0
        path[i], stamp[i], came_from[i] = 0.0, i, -1
        queue[0], head, waiting = i, 0, 1
        last = max(most, visits + _SHORT)
        while waiting > 0 and visits < last:
            visits += 1
            i = queue[head]
            waits[i] = 0
            head = head + 1 if head + 1 < size else 0
            waiting -= 1
            for e in range(start[i], start[i + 1]):
                j = near[e]
                k = owner[j]
                if k == i:
                    continue
                length = path[i] + cost[e]
                if k < 0:
                    if length < best - least_gain:
                        best, end, end_edge = length, i, e
                    continue
                length -= cost[edge[k]]
                if k == s or (stamp[k] == s and length >= path[k] - least_gain):
                    continue
                path[k], stamp[k] = length, s
                came_from[k], came_by[k] = i, e
                if length < best - least_gain:
                    best, end, end_edge = length, k, -1
                if waits[k] == 0:
                    waits[k] = 1
                    tail = head + waiting
                    queue[tail if tail < size else tail - size] = k
                    waiting += 1
        if end == s and end_edge < 0:
            continue
        # back along the path: each point takes the candidate of the one it displaces
        i, k = end, end_edge
        while i >= 0:
            j = edge[i]
            edge[i] = k
            if k >= 0:
                owner[near[k]] = i
            if i == s:
                break
            k, i = came_by[i], came_from[i]
    for s in range(size):
        if edge[s] >= 0:
            edge[s] = near[edge[s]]
            assigned += 1
    return assigned


@cython.locals(e=cython.Py_ssize_t)
def find_candidates(p, grid, move, t2, most, start, near, cost):
    """Write the points of Q within t of each moved point of P, nearest first, at most `most`.

    Those of point i are the entries ``start[i]`` to ``start[i + 1]`` of ``near``; their cost is
    d² - t², at most 0.
    """
    start[0] = 0
    for i in range(p.shape[1]):
        x = move[2] + move[0] * p[0, i] - move[1] * p[1, i]
        y = move[3] + move[1] * p[0, i] + move[0] * p[1, i]
        start[i + 1] = start[i] + grid.within(x, y, t2, most, near, cost, start[i])
        for e in range(start[i], start[i + 1]):
            cost[e] -= t2
    return start[p.shape[1]]
