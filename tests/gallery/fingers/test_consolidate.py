"""Windows of one print, put together, are that print again."""

import math

import numpy as np
import pytest

from fpmatch.gallery.fingers.consolidate import Link, consolidate, link_impressions, linked_groups
from fpmatch.gallery.fingers.merge import merge_templates
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.registry import get_matcher
from fpmatch.pointset.geometry.similarity import Similarity
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template

MATCHER = get_matcher("unit-circle")
CURVE = load_calibration("unit-circle")
SIDE = 400.0


@pytest.fixture
def whole(rng):
    """Return the minutiae of a whole finger, about along its level ridges: x, y, angle and kind."""
    places = np.stack(np.meshgrid(np.arange(20, SIDE, 40), np.arange(20, SIDE, 40)), -1)
    xy = places.reshape(-1, 2) + rng.uniform(-12, 12, (100, 2))
    angle = np.pi * rng.integers(0, 2, 100) + rng.uniform(-0.5, 0.5, 100)
    return xy, angle, rng.integers(1, 3, 100)


def window(whole, pose, dpi=500.0, side=240):
    """Return what a small sensor sees of a finger; `pose` maps its pixels to the finger's."""
    xy, angle, kind = whole
    zoom = dpi / 500.0
    seen = pose.inverse().apply(xy)
    inside = ((seen > 0) & (seen < side * zoom)).all(axis=1)
    m = Minutiae(*seen[inside].T, angle[inside] + pose.rotation, kind[inside])
    pixels = math.ceil(side * zoom)
    cells = np.ones((pixels // 16, pixels // 16), bool)
    orientation = np.full(cells.shape, pose.rotation % np.pi)
    field = RidgeField(16.0 * pixels / (pixels // 16 * 16), orientation, cells)
    return Template(m, pixels, pixels, dpi, field)


def poses(rng, dpis=(500.0,) * 4):
    return [
        Similarity(500.0 / dpi, rng.uniform(-0.3, 0.3), *shift)
        for dpi, shift in zip(dpis, [(60, 20), (120, 30), (60, 130), (130, 130)], strict=True)
    ]


def linked(prints, **options):
    return link_impressions([MATCHER.prepare(one) for one in prints], MATCHER, CURVE, **options)


@pytest.mark.parametrize("dpis", [(500.0,) * 4, (500.0, 1000.0, 400.0, 569.0)])
def test_windows_become_the_finger_again(whole, rng, dpis):
    xy, angle, kind = whole
    truth = poses(rng, dpis)
    prints = [window(whole, pose, dpi) for pose, dpi in zip(truth, dpis, strict=True)]
    (made,) = consolidate(prints, linked(prints))
    assert sorted(made.poses) == [0, 1, 2, 3]
    root = next(iter(made.poses))
    to_finger = truth[root].after(made.poses[root].inverse())
    seen = np.zeros(100, bool)
    for k, pose in made.poses.items():
        corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) * prints[k].width
        apart = to_finger.apply(pose.apply(corners)) - truth[k].apply(corners)
        assert np.hypot(*apart.T).max() < 1.0
        local = truth[k].inverse().apply(xy)
        seen |= ((local > 0) & (local < prints[k].width)).all(axis=1)
    minutiae = made.template.minutiae
    assert len(minutiae) == seen.sum() > max(len(p.minutiae) for p in prints)
    distance = np.hypot(*(to_finger.apply(minutiae.xy)[:, None] - xy).transpose(2, 0, 1))
    assert distance.min(axis=1).max() < 1.0
    which = distance.argmin(axis=1)
    turned = minutiae.angle - to_finger.rotation - angle[which]
    assert np.abs(np.angle(np.exp(1j * turned))).max() < 0.02
    assert (minutiae.kind == kind[which]).all()
    assert made.template.dpi == 500.0
    assert made.template.field.mask.sum() > prints[0].field.mask.sum()


def test_impressions_that_match_none_stay_alone(whole, rng):
    xy, angle, kind = whole
    impostor = window((xy[:, ::-1], angle[::-1], kind), Similarity(tx=40.0, ty=40.0))
    prints = [*(window(whole, pose) for pose in poses(rng)), impostor]
    links = linked(prints)
    assert linked_groups(5, links) == [[0, 1, 2, 3], [4]]
    (made,) = consolidate(prints, links)
    assert 4 not in made.poses
    few = {(link.a, link.b) for link in linked(prints, among=[0])}
    assert few == {(link.a, link.b) for link in links if link.a == 0}
    assert consolidate([impostor], []) == consolidate([], []) == []


def test_a_wrong_link_does_not_bend_the_others(whole, rng):
    prints = [window(whole, pose) for pose in poses(rng)]
    links = linked(prints)
    (good,) = consolidate(prints, links)
    weakest = min(links, key=lambda link: link.score)
    wrong = Link(weakest.a, weakest.b, 35.0, weakest.pairs[:, ::-1][:5] % 10)
    (made,) = consolidate(prints, [wrong if link is weakest else link for link in links])
    assert set(made.poses) == set(good.poses)  # the strongest link decides which is the first
    assert len(made.template.minutiae) == len(good.template.minutiae)


def test_what_others_do_not_show_loses_quality_or_is_left_out():
    seen, doubtful, false = [30.0, 100.0, 100.0], [100.0, 30.0, 100.0], [60.0, 60.0, 100.0]
    field = RidgeField(16.0, np.zeros((9, 9)), np.ones((9, 9), bool))

    def print_of(*minutiae):
        x, y, quality = np.array(minutiae).T
        found = Minutiae(x, y, np.zeros(len(x)), quality=quality / 2)
        return Template(found, 144, 144, 500.0, field)

    prints = [print_of(seen, doubtful, false), print_of(seen, doubtful), print_of(seen)]
    merged, _ = merge_templates(prints, [Similarity()] * 3)
    minutiae = merged.minutiae
    quality = dict(zip(map(tuple, minutiae.xy.tolist()), minutiae.quality.tolist(), strict=True))
    assert set(quality) == {(30.0, 100.0), (100.0, 30.0)}
    assert quality[30.0, 100.0] > 60 > quality[100.0, 30.0]


def test_ridges_are_turned_with_their_impression():
    stripes = np.zeros((16, 16), bool)
    stripes[:, 4:8] = stripes[:, 12:] = True  # upright ridges
    bits = np.packbits(
        stripes.reshape(2, 8, 2, 8).swapaxes(1, 2).reshape(2, 2, 64), axis=2, bitorder="little"
    ).view("<u8")[..., 0]
    field = RidgeField(16.0, np.full((2, 2), np.pi / 2), np.ones((2, 2), bool), bits)
    assert (field.bits == stripes).all()
    one = Template(Minutiae([16.0], [16.0], [0.0]), 32, 32, 500.0, field)
    same, _ = merge_templates([one, one], [Similarity()] * 2)
    assert same.field == field
    quarter = Similarity(rotation=math.pi / 2, tx=32.0)  # clockwise on screen
    turned, _ = merge_templates([one], [quarter])
    assert (turned.field.bits == np.rot90(stripes, -1)).all()
    level = np.minimum(turned.field.orientation, np.pi - turned.field.orientation)
    assert level.max() < 1e-3
    assert turned.minutiae.angle[0] == pytest.approx(3 * np.pi / 2)


def test_without_ridge_fields_there_is_none():
    bare = Template(Minutiae([5.0, 9.0], [5.0, 9.0], [0.0, 1.0]), 20, 20)
    empty = Template(Minutiae.empty(), 20, 20)
    merged, _ = merge_templates([bare, empty, bare], [Similarity()] * 3)
    assert merged.field is None
    assert len(merged.minutiae) == 2
