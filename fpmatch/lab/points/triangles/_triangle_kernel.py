# mypy: ignore-errors
"""Kernel: the triangles of a mesh with their shapes, and the triangles of one-rings with gaps.

A triangle's shape is the complex number z of its third corner where its longest side is mapped to
0..1: invariant under similarity transforms.
"""

import cython

if cython.compiled:
    from cython.cimports.libc.math import exp, sqrt
else:
    from math import exp, sqrt

COMPILED = cython.compiled


@cython.locals(a=cython.int, b=cython.int)
def describe_triangles(
    point, triangle, near_tie, shortest, outliers, corner, shape, side, negative_information,
):  # fmt: skip
    """Describe each triangle by each side that is longest to within `near_tie`; return how many.

    ``corner[k]`` receives the ends of that side and the apex, counter-clockwise, ``shape[:, k]``
    the real and imaginary part of z, ``side[k]`` the side's length. Sides under `shortest` are
    left out. ``-negative_information[k]`` is the value of a match of the triangle, which grows
    with its size, times the probability exp(-outliers·circle) that no outlier, of which there are
    `outliers` to a unit of area, lies in its circumcircle and splits it. Where
    ``negative_information`` has no entries, it is not computed.
    """
    pi = 3.141592653589793
    k = 0
    for i in range(triangle.shape[0]):
        longest2 = 0.0
        for r in range(3):
            a, b = triangle[i, r], triangle[i, (r + 1) % 3]
            dx, dy = point[0, b] - point[0, a], point[1, b] - point[1, a]
            longest2 = max(longest2, dx * dx + dy * dy)
        for r in range(3):
            a, b, c = triangle[i, r], triangle[i, (r + 1) % 3], triangle[i, (r + 2) % 3]
            dx, dy = point[0, b] - point[0, a], point[1, b] - point[1, a]
            side2 = dx * dx + dy * dy
            least2 = max(longest2 * near_tie * near_tie, shortest * shortest)
            if side2 <= 0.0 or side2 < least2:
                continue
            ex, ey = point[0, c] - point[0, a], point[1, c] - point[1, a]
            zx, zy = (ex * dx + ey * dy) / side2, (ey * dx - ex * dy) / side2
            if zy <= 0.0:
                continue
            corner[k, 0], corner[k, 1], corner[k, 2] = a, b, c
            shape[0, k], shape[1, k], side[k] = zx, zy, sqrt(side2)
            if negative_information.shape[0] > 0:
                radius2 = side2 * (zx * zx + zy * zy) * ((zx - 1.0) * (zx - 1.0) + zy * zy)
                negative_information[k] = -side2 * exp(-outliers * pi * radius2 / (4.0 * zy * zy))
            k += 1
    return k


@cython.locals(i=cython.Py_ssize_t)
def ring_triangles(point, ring_start, ring, reach, triangle):
    """Write every triangle of a point and two near neighbours of its ring once; return how many.

    They are Delaunay triangles of the set without some of its points; `reach` is how many
    positions in the ring the two may be apart. Corners are counter-clockwise; flat triangles are
    left out.
    """
    count = 0
    for i in range(ring_start.shape[0] - 1):
        degree: cython.Py_ssize_t = ring_start[i + 1] - ring_start[i]
        for apart in range(1, (reach if reach < degree // 2 else degree // 2) + 1):
            for e in range(degree if 2 * apart < degree else apart):
                j: cython.int = ring[ring_start[i] + e]
                k: cython.int = ring[ring_start[i] + (e + apart) % degree]
                # where the neighbours are joined too, the smallest corner writes the triangle
                if (i > j or i > k) and _joined(ring_start, ring, j, k):
                    continue
                area = (point[0, j] - point[0, i]) * (point[1, k] - point[1, i])
                area -= (point[1, j] - point[1, i]) * (point[0, k] - point[0, i])
                if area == 0.0 or count == triangle.shape[0]:
                    continue
                triangle[count, 0] = i
                triangle[count, 1] = j if area > 0.0 else k
                triangle[count, 2] = k if area > 0.0 else j
                count += 1
    return count


@cython.locals(d=cython.Py_ssize_t)
def _joined(ring_start, ring, j, k):
    """Return whether two points are neighbours, from the ring of the one that has fewer."""
    if ring_start[k + 1] - ring_start[k] < ring_start[j + 1] - ring_start[j]:
        j, k = k, j
    joined: cython.bint = False
    for d in range(ring_start[j], ring_start[j + 1]):
        joined = joined or ring[d] == k
    return joined


@cython.locals(a=cython.int, b=cython.int)
def polygon_area(point, corner):
    """Return the area of a polygon, its corners counter-clockwise."""
    x0, y0 = point[0, corner[0]], point[1, corner[0]]
    area = 0.0
    for e in range(1, corner.shape[0] - 1):
        a, b = corner[e], corner[e + 1]
        area += (point[0, a] - x0) * (point[1, b] - y0) - (point[1, a] - y0) * (point[0, b] - x0)
    return 0.5 * area


def triangle_areas(point, triangle, area):
    """Write the area of each triangle, its corners counter-clockwise."""
    for i in range(triangle.shape[0]):
        a, b, c = triangle[i, 0], triangle[i, 1], triangle[i, 2]
        area[i] = 0.5 * (
            (point[0, b] - point[0, a]) * (point[1, c] - point[1, a])
            - (point[1, b] - point[1, a]) * (point[0, c] - point[0, a])
        )


def nearest_two(point, ring_start, ring, first2, second2):
    """Write the squared distances of each point to the two nearest points of its ring."""
    for i in range(ring_start.shape[0] - 1):
        first = second = 1e300
        for e in range(ring_start[i], ring_start[i + 1]):
            j: cython.int = ring[e]
            dx, dy = point[0, j] - point[0, i], point[1, j] - point[1, i]
            d2 = dx * dx + dy * dy
            if d2 < first:
                first, second = d2, first
            elif d2 < second:
                second = d2
        first2[i], second2[i] = first, second


@cython.locals(i=cython.Py_ssize_t, behind=cython.Py_ssize_t, longest=cython.Py_ssize_t)
def longest_run(ordered, alike):
    """Return how many of sorted values differ by less than the factor `alike`, at most."""
    behind = longest = 0
    for i in range(ordered.shape[0]):
        while ordered[behind] * alike < ordered[i]:
            behind += 1
        longest = max(longest, i + 1 - behind)
    return longest
