"""Templates without images: reproducible, on their finger, where the maps of images take them."""

import zlib

import numpy as np
import pytest

from fpmatch.lab.synthesis.database import Plan
from fpmatch.lab.synthesis.master import MasterParameters
from fpmatch.lab.synthesis.orientation import PatternClass
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.lab.synthesis.warp import Warp
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.pointset.geometry.similarity import Similarity
from research.templates import impressions
from research.templates.fingers import draw_fingers
from research.templates.impressions import ExtractionParameters, draw_impressions
from research.templates.making import make_templates
from research.templates.numbers import TURN, keys_of, uniform
from research.templates.ridges import STEP_PX
from research.templates.warps import draw_warps

MASTER = (560, 440)
NOTHING_LOST = ExtractionParameters(
    missed=0, doubtful=10, place_px=0, direction=0, kind=0, spurious=0, spurious_in_doubt=0,
    most_doubt=2, orientation_deg=0, phase=0,
)  # fmt: skip
# the first numbers of SplitMix64 with the seed 1234567, as published with other implementations
SPLITMIX = (6457827717110365317, 3203168211198807973, 9817491932198370423)


def same(a, b):
    return a.minutiae == b.minutiae and a.field == b.field and (a.width, a.dpi) == (b.width, b.dpi)


def test_each_template_is_the_same_alone_and_among_others():
    together = list(make_templates(7, range(3, 38), impressions=2))
    for finger in (3, 35, 37):
        alone = list(make_templates(7, [finger], impressions=2))
        assert all(map(same, alone, together[2 * (finger - 3) :]))


def test_templates_are_as_they_were_when_galleries_were_measured():
    """Templates of commit f3b85a33, which made them with compiled kernels."""
    made = list(make_templates(11, [5, 6], 2, sensors=["capacitive-300x300"]))
    assert [len(t.minutiae) for t in made] == [33, 34, 24, 31]
    assert [int(t.field.mask.sum()) for t in made] == [306, 230, 160, 184]
    first = made[0].minutiae
    assert first.xy[:5].tolist() == [[22, 13], [19, 40], [65, 29], [20, 55], [157, 47]]
    assert first.kind[:5].tolist() == [1, 2, 1, 1, 1]
    ridges = [zlib.crc32(t.field.ridges.tobytes()) for t in made]
    assert ridges == [1614806550, 3985917806, 4038208498, 2872594260]


def test_impressions_of_a_finger_match_and_those_of_others_do_not():
    prints = [MATCHER.prepare(t) for t in make_templates(3, range(8), 2, preset="easy")]
    for k in range(0, len(prints), 2):
        mates = MATCHER.compare(prints[k], prints[k + 1]).similarity
        others = [MATCHER.compare(prints[k], p).similarity for p in prints[k + 2 :]]
        assert mates > max([8.0, *others])


def test_placements_have_the_distribution_of_drawn_ones():
    p = PRESETS["normal"].placement
    keys = keys_of(3, np.arange(4000), 1, 131)
    warps = draw_warps(keys, MASTER, SENSORS["optical-388x374"], p)
    rotation = np.degrees(np.angle(warps.turn))
    assert np.abs(rotation).max() <= p.rotation_deg[1]
    assert abs(rotation.mean()) < 0.7
    off = warps.centre - complex(388, 374) / 2
    far = np.maximum(abs(off.real), abs(off.imag)) > p.shift[1] + 1
    assert 0.5 * p.cut_off < far.mean() <= 1.1 * p.cut_off


def test_minutiae_lie_and_point_where_the_warp_of_images_takes_them(monkeypatch):
    fingers = draw_fingers(3, np.arange(12, dtype=np.uint64))
    plan = Plan(3, PRESETS["stretched"], (SENSORS["optical-388x374"],), 1)
    drawn = []

    def draw(*arguments):
        drawn.append(draw_warps(*arguments))
        return drawn[-1]

    monkeypatch.setattr(impressions, "draw_warps", draw)
    numbers = np.array([1], np.uint64)
    made = draw_impressions(plan, fingers, numbers, plan.sensor_of(1), NOTHING_LOST)
    for k, template in enumerate(made):
        w = type(drawn[0])(*(column[k, 0] for column in drawn[0]))
        placement = Similarity(w.scale, np.angle(w.turn), w.shift.real, w.shift.imag)
        centre, slide = ((float(v.real), float(v.imag)) for v in (w.centre, w.slide))
        warp = Warp(placement, centre, (w.half_width, w.half_height), np.angle(w.twist), slide)
        x, y, direction = fingers.minutiae[k].T
        start = np.column_stack([x, y])
        angle = direction * (2 * np.pi / TURN)
        ahead = start + np.column_stack([np.cos(angle), -np.sin(angle)])
        there = warp.from_master(start)
        dx, dy = (warp.from_master(ahead) - there).T
        m = template.minutiae
        nearest = np.hypot(*(m.xy[:, None] - there[None]).transpose(2, 0, 1)).argmin(axis=1)
        assert np.abs(m.xy - there[nearest]).max() < 0.8  # pixels are whole
        off = np.exp(1j * m.angle) / np.exp(1j * np.arctan2(-dy, dx)[nearest])
        assert np.abs(np.degrees(np.angle(off))).max() < 4
        assert len(np.unique(nearest)) == len(m) > 8


@pytest.mark.parametrize("pattern", PatternClass)
def test_minutiae_lie_on_their_finger_along_its_ridges(pattern):
    batch = draw_fingers(5, np.arange(6, dtype=np.uint64), MasterParameters(pattern=pattern))
    for k, minutiae in enumerate(batch.minutiae):
        x, y, direction = minutiae.T
        assert len(minutiae) > 30
        i, j = (np.floor(v / STEP_PX).astype(int) for v in (y, x))
        assert batch.inside[k, i, j].all()
        turned = direction - batch.level[k, i, j] + TURN / 4
        off = np.mod(turned, TURN / 2) - TURN / 4
        assert np.median(np.abs(off)) * 360 / TURN < 6


def test_a_stream_is_splitmix64_of_a_key_of_its_own():
    first = uniform(np.array([1234567], np.uint64), 3)[0]
    assert first.dtype == np.float32
    assert np.array_equal(first, [(n >> 40) / 2**24 for n in SPLITMIX])
    kinds = [(a, b, c, d) for a in range(4) for b in range(4) for c in range(4) for d in range(4)]
    keys = np.concatenate([keys_of(*kind) for kind in kinds])
    assert len(np.unique(keys)) == len(kinds)
    correlation = np.corrcoef(uniform(keys, 500))
    assert np.abs(correlation - np.eye(len(kinds))).max() < 0.25
