import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from fpmatch.lab.synthesis.master import (
    PERIOD_LEVELS,
    MasterParameters,
    PeriodParameters,
    SilhouetteParameters,
    fingertip_silhouette,
    make_master,
    ridge_period,
)
from fpmatch.lab.synthesis.orientation import (
    SINGULAR_RANGES,
    PatternClass,
    draw_singular_points,
    ridge_orientation,
    zero_pole_turning,
)

SMALL = MasterParameters(shape=(224, 176))
ARRAYS = ("orientation", "period", "relief", "silhouette", "cores", "deltas")
DIGEST_CODE = """
import hashlib
from fpmatch.lab.synthesis.master import MasterParameters, make_master
m = make_master(3, 8, MasterParameters(shape=(224, 176)))
arrays = [getattr(m, name) for name in {names}] + [m.minutiae.xy, m.minutiae.angle, m.minutiae.kind]
print(m.pattern, hashlib.sha256(b"".join(a.tobytes() for a in arrays)).hexdigest())
"""


@pytest.fixture(scope="module")
def masters():
    return [make_master(3, finger, SMALL) for finger in range(4)]


def digest_in_a_process(**environment):
    command = [sys.executable, "-c", DIGEST_CODE.format(names=ARRAYS)]
    env = {**os.environ, **environment}
    return subprocess.run(
        command, capture_output=True, text=True, check=True, timeout=300, env=env
    ).stdout


def test_two_processes_make_the_same_finger_though_one_has_an_older_processor():
    older = {  # whose cosines differ from the newer one's in the last bit
        "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX2 FMA3 AVX512F AVX512_SKX",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F",
    }
    one, two = digest_in_a_process(), digest_in_a_process(**older)
    assert one == two
    assert len(one.split()[-1]) == 2 * hashlib.sha256().digest_size


def test_fingers_and_seeds_differ_in_everything(masters):
    others = [*masters[1:], make_master(4, 0, SMALL)]
    for other in others:
        for name in ("orientation", "period", "relief", "silhouette"):
            assert not np.array_equal(getattr(masters[0], name), getattr(other, name))
        assert masters[0].minutiae != other.minutiae


def test_minutiae_lie_on_the_print_along_its_ridges(masters):
    for master in masters:
        found = master.minutiae
        row, column = found.y.astype(int), found.x.astype(int)
        assert master.silhouette[row, column].all()
        assert np.abs(np.sin(found.angle - master.orientation[row, column])).max() < 1e-5
        assert set(found.kind.tolist()) <= {1, 2}


def period_of(seed, p=None):
    return ridge_period((200, 160), np.random.default_rng(seed), p or PeriodParameters())


@given(st.integers(0, 2**32))
def test_a_period_map_is_natural_and_smooth(seed):
    period = period_of(seed)
    assert (period.dtype, period.shape) == (np.float32, (200, 160))
    assert 5.5 < period.min() <= period.max() < 13.5
    assert np.abs(np.diff(period, axis=0)).max() < 0.3
    assert not np.mod(period * PERIOD_LEVELS, 1).any()


@given(st.integers(64, 160), st.integers(64, 160), st.integers(0, 2**32))
def test_any_outline_is_one_piece_off_the_border(rows, columns, seed):
    rng = np.random.default_rng(seed)
    inside = fingertip_silhouette((rows, columns), rng, SilhouetteParameters())
    assert (inside.shape, inside.dtype) == ((rows, columns), np.bool_)
    assert ndimage.label(inside)[1] == ndimage.label(~inside)[1] == 1
    assert not inside[[0, -1]].any()
    assert not inside[:, [0, -1]].any()
    assert 0.45 < inside.mean() < 0.85


SHAPE = (280, 220)
SIZE = 0.5
CENTRE = (110.0, 140.0)

patterns = pytest.mark.parametrize("pattern", PatternClass)


def field_of(pattern, seed=0):
    rng = np.random.default_rng(seed)
    points = draw_singular_points(pattern, CENTRE, rng, SIZE)
    return ridge_orientation(pattern, points, SHAPE, rng, SIZE), points


@given(st.sampled_from(PatternClass), st.integers(0, 2**32), st.floats(0.2, 1.2))
def test_points_are_those_of_the_class_and_lie_in_their_places(pattern, seed, size):
    points = draw_singular_points(pattern, CENTRE, np.random.default_rng(seed), size)
    count = {PatternClass.ARCH: 0, PatternClass.WHORL: 2}.get(pattern, 1)
    assert points.cores.shape == points.deltas.shape == (count, 2)
    if count:
        assert points.cores[:, 1].max() < points.deltas[:, 1].min()
    farthest = max(np.abs(SINGULAR_RANGES[pattern].deltas).ravel(), default=0)
    assert np.abs(points.deltas - CENTRE).max(initial=0) <= size * farthest + 1e-9
    to_the_right = (points.deltas - points.cores)[:, 0] > 0
    assert pattern is not PatternClass.LEFT_LOOP or to_the_right.all()
    assert pattern is not PatternClass.RIGHT_LOOP or not to_the_right.any()


def turns(angles):
    """Return how far orientations turn along a closed line, in units of π."""
    steps = np.mod(np.diff(angles) + np.pi / 2, np.pi) - np.pi / 2
    return float(steps.sum() / np.pi)


def index_at(orientation, x, y, radius=7.0):
    around = np.linspace(0, 2 * np.pi, 200)
    column = np.rint(x + radius * np.cos(around)).astype(int)
    return turns(orientation[np.rint(y - radius * np.sin(around)).astype(int), column])


@patterns
def test_cores_and_deltas_are_where_they_were_put(pattern):
    for seed in range(3):
        orientation, points = field_of(pattern, seed)
        for places, index in zip(points, (1, -1), strict=True):
            for x, y in places:
                assert index_at(orientation, x, y) == pytest.approx(index, abs=1e-3)


@given(st.integers(0, 2**32))
def test_the_index_of_every_point_survives_every_correction(seed):
    cores, deltas = [-5 + 60j, 8 - 10j], [-100 - 110j, 95 - 120j]
    expected = [*((core, 3.0, 1) for core in cores), *((delta, 3.0, -1) for delta in deltas)]
    for point, radius, index in [*expected, (40 + 30j, 3.0, 0), (0j, 900.0, 0)]:
        circle = point + radius * np.exp(1j * np.linspace(0, 2 * np.pi, 401))
        rng = np.random.default_rng(seed)
        turning = zero_pole_turning(circle[None], cores, deltas, rng)
        assert turns(turning[0]) == pytest.approx(index)
