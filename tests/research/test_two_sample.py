import numpy as np
import pytest

from research.experiments.two_sample import (
    NAMES,
    SIDE_PX,
    accuracy,
    describe,
    format_accuracies,
    patches_of,
    two_sample,
)

PERIOD = 8.6


def ridges(side=SIDE_PX, share=0.5, angle=0.0):
    """Return dark ridges of a share of their period, along a direction in radians."""
    y, x = np.mgrid[:side, :side]
    phase = (x * np.sin(angle) + y * np.cos(angle)) / PERIOD % 1
    soft = np.clip((np.abs(phase - 0.5) - share / 2) * PERIOD + 0.5, 0, 1)
    return np.rint(20 + 200 * soft).astype(np.uint8)


def side_of(rng, fingers=10, patches=20, **shifts):
    """Return patches of some fingers, each with an offset of its own."""
    made = {}
    for finger in range(fingers):
        values = rng.standard_normal((patches, len(NAMES))) + rng.standard_normal(len(NAMES))
        for name, shift in shifts.items():
            values[:, NAMES.index(name)] += shift
        made[finger] = values
    return made


def value(patch, name):
    return describe(patch)[NAMES.index(name)]


def test_statistics_say_what_they_are_named_for():
    plain, thin = ridges(), ridges(share=0.3)
    assert len(describe(plain)) == len(NAMES)
    assert np.exp(value(plain, "period")) == pytest.approx(PERIOD, rel=0.1)
    assert value(thin, "ridge share") < value(plain, "ridge share") < 0.6
    assert value(thin, "ridge width") < value(plain, "ridge width") - 0.1
    wide = ridges(share=0.7)
    pitted = wide.copy()
    for n in range(1, 4):
        crest = round((n + 0.5) * PERIOD)
        for column in range(6, SIDE_PX - 6, 7):
            pitted[crest - 1 : crest + 1, column : column + 2] = 220
    assert value(wide, "pores") == 0 < value(pitted, "pores")
    assert value(pitted, "noise of ridges") > value(wide, "noise of ridges")


def test_patches_are_turned_so_that_their_ridges_are_level():
    angle = 0.6
    grey = ridges(200, angle=angle)
    inside = np.ones(grey.shape, bool)
    turned = patches_of(grey, inside, np.full(grey.shape, angle, np.float32))
    assert len(turned) > 4
    level = describe(ridges())
    for name in ("period", "ridge share", "roughness of edges"):
        k = NAMES.index(name)
        assert turned[:, k] == pytest.approx(level[k], abs=0.1), name
    assert patches_of(grey, ~inside, np.zeros(grey.shape, np.float32)).shape == (0, len(NAMES))


def test_a_blank_patch_has_finite_statistics():
    assert np.isfinite(describe(np.full((SIDE_PX, SIDE_PX), 9, np.uint8))).all()


def test_patches_of_one_kind_are_not_separated_though_fingers_differ():
    rng = np.random.default_rng(3)
    share, _ = accuracy(side_of(rng), side_of(rng))
    assert share == pytest.approx(0.5, abs=0.12)


def test_patches_of_two_kinds_are_separated_and_the_statistic_is_named():
    rng = np.random.default_rng(4)
    share, names = accuracy(side_of(rng), side_of(rng, pores=8.0))
    assert share > 0.75
    assert names[0] == "pores"


def test_tables_have_a_column_a_database_and_a_dash_where_fingers_are_few():
    rng = np.random.default_rng(5)
    others = {"far": side_of(rng, period=9.0), "one": side_of(rng, fingers=1)}
    result = two_sample(side_of(rng), others)
    head, _, row = format_accuracies([{"name": "made", "two_sample": result}]).splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in (head, row)]
    assert cells[0][1:4] == ["far", "one", "all"]
    assert cells[1][2] == "-"
    assert int(cells[1][1].split()[0]) > 75
