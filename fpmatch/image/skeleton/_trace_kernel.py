# mypy: ignore-errors
"""Kernel: trace the branches of the nodes of a skeleton (endings, bifurcations).

A trace goes from pixel to neighbouring pixel, edge neighbours before corner neighbours, never to a
neighbour of the pixel before, until it meets another node, ends, or fills its row of `paths`.
"""

import cython

COMPILED = cython.compiled


def trace_branches(
    skeleton: cython.int[:, ::1],
    nodes: cython.int[:, ::1],
    step: cython.int[:, ::1],
    paths: cython.int[:, :, :, ::1],
    made: cython.int[:, ::1],
    target: cython.int[:, ::1],
) -> None:
    """Trace up to ``paths.shape[1]`` branches of each node.

    `skeleton` (0, 1, and 2 + i at node i) has a border of one pixel without ridge; `nodes` holds
    the nodes' (y, x); `step` the eight (dy, dx): E, N, W, S, then the corners from NE on. For node
    i and branch b, ``paths[i, b, :made[i, b]]`` receives the traced (y, x), without the border, and
    ``target[i, b]`` the node that was met, or -1.
    """
    limit: cython.Py_ssize_t = paths.shape[2]
    cython.declare(i=cython.Py_ssize_t, k=cython.Py_ssize_t, next_step=cython.Py_ssize_t)
    cython.declare(branch=cython.Py_ssize_t, walked=cython.Py_ssize_t)
    cython.declare(y=cython.int, x=cython.int, from_y=cython.int, from_x=cython.int)
    for i in range(nodes.shape[0]):
        branch = 0
        for k in range(8):
            y = nodes[i, 0] + step[k, 0]
            x = nodes[i, 1] + step[k, 1]
            if skeleton[y, x] == 0 or branch == paths.shape[1]:
                continue
            # a corner neighbour beside an edge neighbour is the same branch
            if k >= 4 and (skeleton[y, nodes[i, 1]] != 0 or skeleton[nodes[i, 0], x] != 0):
                continue
            from_y = nodes[i, 0]
            from_x = nodes[i, 1]
            walked = 0
            while True:
                paths[i, branch, walked, 0] = y - 1
                paths[i, branch, walked, 1] = x - 1
                walked += 1
                if skeleton[y, x] >= 2 and skeleton[y, x] != 2 + i:
                    target[i, branch] = skeleton[y, x] - 2
                    break
                if walked == limit:
                    break
                next_step = _next_step(skeleton, step, y, x, from_y, from_x)
                if next_step < 0:
                    break
                from_y = y
                from_x = x
                y += step[next_step, 0]
                x += step[next_step, 1]
            made[i, branch] = walked
            branch += 1


@cython.cfunc
@cython.exceptval(check=False)
def _next_step(
    skeleton: cython.int[:, ::1],
    step: cython.int[:, ::1],
    y: cython.int,
    x: cython.int,
    from_y: cython.int,
    from_x: cython.int,
) -> cython.Py_ssize_t:
    """Return the index of the step that continues a trace from one pixel over (y, x), or -1."""
    k: cython.Py_ssize_t
    for k in range(8):
        dy: cython.int = y + step[k, 0] - from_y
        dx: cython.int = x + step[k, 1] - from_x
        if dy * dy + dx * dx > 2 and skeleton[y + step[k, 0], x + step[k, 1]] != 0:
            return k
    return -1
