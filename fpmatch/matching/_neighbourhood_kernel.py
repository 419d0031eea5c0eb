"""Kernel: the rings of minutiae on the unit circle, and their nearest neighbours in their frames.

Two steps of describing a print, each a pass over its minutiae: `map_to_circle` places the closed
one-rings on the unit circle by the lengths of their sides (eq. 3), turned so that the point where
the minutia's own direction leaves its ring lies at angle 0; `nearest_in_own_frames` finds each
minutia's nearest neighbours in its first two rings, and where they lie in its own frame.
"""

import cython
import numpy as np
from cython.cimports.libc.math import atan2, cos, sin, sqrt

FULL_TURN = cython.declare(cython.double, 2.0 * np.pi)
LEAST_WEIGHT = cython.declare(cython.double, 1e-9)  # of all neighbours of a minutia together


def map_to_circle(points, centre, start, vertex, circle):
    """Write the places (x, y) of the rings' vertices into the first two rows of `circle`.

    `points` are x, y and the unit vector of the direction (4, N). The ring of ``centre[i]`` is
    ``vertex[start[i]:start[i + 1]]``, counter-clockwise and closed.
    """
    for i in range(centre.shape[0]):
        begin, end = start[i], start[i + 1]
        x, y = points[0, centre[i]], points[1, centre[i]]
        c, s = points[2, centre[i]], points[3, centre[i]]
        # the sides' lengths add up along the ring, and the last vertex before the direction is
        # the one that is seen farthest round from it
        around = 0.0
        largest = -1.0
        last = begin
        for m in range(begin, end):
            following = m + 1 if m + 1 < end else begin
            circle[0, m] = around
            dx = points[0, vertex[following]] - points[0, vertex[m]]
            dy = points[1, vertex[following]] - points[1, vertex[m]]
            around += sqrt(dx * dx + dy * dy)
            dx = points[0, vertex[m]] - x
            dy = points[1, vertex[m]] - y
            angle = atan2(c * dy - s * dx, c * dx + s * dy)
            if angle < 0.0:
                angle += FULL_TURN
            if angle > largest:
                largest = angle
                last = m
        following = last + 1 if last + 1 < end else begin
        dx = points[0, vertex[last]] - x
        dy = points[1, vertex[last]] - y
        share = s * dx - c * dy
        dx = points[0, vertex[following]] - x
        dy = points[1, vertex[following]] - y
        rise = c * dy - s * dx + share
        share = share / rise if rise > 0.0 else 0.0
        share = min(share, 1.0) if share > 0.0 else 0.0
        anchor = circle[0, last]
        angle = circle[0, following] if following > last else around
        anchor += share * (angle - anchor)
        for m in range(begin, end):
            angle = (circle[0, m] - anchor) * (FULL_TURN / around)
            circle[0, m] = cos(angle)
            circle[1, m] = sin(angle)


def nearest_in_own_frames(
    points, edge, start, ring, ring_weight, second_weight, tolerance_px, growth, count, near, frame
):
    """Write `count`, `near` and `frame`, as `Neighbourhoods` describes them.

    `edge` (E, 2) are the joined minutiae. ``ring[start[i]:start[i + 1]]`` is the one-ring
    of minutia i, if it is closed, and `ring_weight` the shape-preserving weights of its vertices.
    Of two neighbours equally near the one of the smaller index comes first. `near` and
    `frame` hold zeros.
    """
    n = count.shape[0]
    size = near.shape[1]
    joined_start = np.zeros(n + 2, np.int32)
    joined = np.empty(2 * edge.shape[0], np.int32)
    met = np.full(n, -1, np.int32)
    weight = np.full(n, second_weight)
    distance = np.empty(size)
    # the minutiae joined with each: `joined_start` runs one ahead while they are filled in
    for e in range(edge.shape[0]):
        joined_start[edge[e, 0] + 2] += 1
        joined_start[edge[e, 1] + 2] += 1
    for i in range(n):
        joined_start[i + 2] += joined_start[i + 1]
    for e in range(edge.shape[0]):
        for k in range(2):
            j = edge[e, k]
            joined[joined_start[j + 1]] = edge[e, 1 - k]
            joined_start[j + 1] += 1
    for i in range(n):
        met[i] = i
        listed = 0
        for e in range(joined_start[i], joined_start[i + 1]):
            via = joined[e]
            # the minutia in the first ring, then those joined with it
            for f in range(joined_start[via] - 1, joined_start[via + 1]):
                j = via if f < joined_start[via] else joined[f]
                if met[j] == i:
                    continue
                met[j] = i
                dx = points[0, j] - points[0, i]
                dy = points[1, j] - points[1, i]
                squared = dx * dx + dy * dy
                if listed < size:
                    listed += 1
                elif not (
                    squared < distance[size - 1]
                    or (squared == distance[size - 1] and j < near[i, size - 1])
                ):
                    continue
                k = listed - 1
                while k > 0 and (
                    squared < distance[k - 1] or (squared == distance[k - 1] and j < near[i, k - 1])
                ):
                    distance[k] = distance[k - 1]
                    near[i, k] = near[i, k - 1]
                    k -= 1
                distance[k] = squared
                near[i, k] = j
        count[i] = listed
        degree = start[i + 1] - start[i]
        for e in range(start[i], start[i + 1]):
            weight[ring[e]] += (1.0 - second_weight) * ring_weight[e] * degree
        total = 0.0
        for k in range(listed):
            total += weight[near[i, k]]
        total = listed / (total if total > LEAST_WEIGHT else LEAST_WEIGHT)
        c = points[2, i]
        s = points[3, i]
        for k in range(listed):
            j = near[i, k]
            dx = points[0, j] - points[0, i]
            dy = points[1, j] - points[1, i]
            tolerance = tolerance_px + growth * sqrt(distance[k])
            frame[i, 0, k] = c * dx + s * dy
            frame[i, 1, k] = c * dy - s * dx
            frame[i, 2, k] = c * points[2, j] + s * points[3, j]
            frame[i, 3, k] = c * points[3, j] - s * points[2, j]
            frame[i, 4, k] = 1.0 / (tolerance * tolerance)
            frame[i, 5, k] = sqrt(weight[j] * total)
        for e in range(start[i], start[i + 1]):
            weight[ring[e]] = second_weight
