from __future__ import annotations

import numpy as np

from fpmatch.drawing.fonts import text_width
from fpmatch.drawing.overlay.labels import place_labels
from fpmatch.drawing.scene.items import Box

PANEL = Box(0, 0, 600, 600)
RIGHT = (1.0, 0.0)


def box_of(label):
    return Box(label.x, label.y - 10, text_width(label.text, label.size), 10)


def test_a_lone_label_stands_behind_its_tick():
    (label,) = place_labels(["7"], [(300.0, 300.0)], [RIGHT], [], PANEL, (0, 0, 0))
    assert box_of(label).right < 300


def test_labels_keep_off_obstacles_and_the_edge():
    wall = Box(0, 280, 299, 40)
    (label,) = place_labels(["7"], [(300.0, 300.0)], [RIGHT], [wall], PANEL, (0, 0, 0))
    assert box_of(label).overlap(wall) < 1
    (label,) = place_labels(["7"], [(1.0, 1.0)], [RIGHT], [], PANEL, (0, 0, 0))
    assert box_of(label).x >= 0
    assert box_of(label).y >= -1


def test_labels_of_neighbours_do_not_cover_each_other(rng):
    grid = np.stack(np.meshgrid(np.arange(60, 540, 40), np.arange(60, 540, 40)), -1).reshape(-1, 2)
    points = [(float(x), float(y)) for x, y in grid + rng.uniform(-8, 8, grid.shape)]
    labels = place_labels(
        [str(n) for n in range(len(points))], points, [RIGHT] * len(points), [], PANEL, (0, 0, 0)
    )
    boxes = [box_of(label) for label in labels]
    assert len(boxes) == len(points)
    assert not [1 for i, a in enumerate(boxes) for b in boxes[:i] if a.overlap(b) > 1]
