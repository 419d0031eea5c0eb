"""`python -m research measure wolves`: what it makes, how it searches, and what it prints."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.formats.files import load_template
from fpmatch.gallery.listing.two_prints import find_doubts
from fpmatch.matching.pipeline._kernels._ridge_search_kernel import COMPILED
from fpmatch.matching.pipeline.match import MIN_MINUTIAE
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from research.wolves import candidates, scores, search, templates
from research.wolves.table import factors_kept, format_wolves, share_kept

ROOT = Path(__file__).resolve().parents[2]
FOUND = sorted((ROOT.parent / "shared" / "wolves").glob("*.json"))

SEEDS = st.integers(0, 2**32 - 1)


def print_of(seed, size=30):
    """Return a template of random minutiae along drawn ridges that are everywhere."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(20, 380, (2, size))
    wave = templates.Wave.random(rng, (7.0, 11.0))
    field = templates.drawn_field(wave, lambda x, y: np.ones(x.shape, bool))
    row, column = (np.floor(each / field.step).astype(int) for each in (y, x))
    angle = field.orientation[row, column] + np.pi * rng.integers(0, 2, size)
    return Template(Minutiae(x, y, angle), 400, 400, field=field)


def prints(count, impressions=1):
    """Return prints of so many fingers."""
    finger = np.arange(count * impressions) // impressions
    made = [print_of(k) for k in finger.tolist()]
    return scores.Prints(made, finger, [None] * len(made), [500.0] * len(made))


@pytest.mark.parametrize("degrees", [0, 30, 90, 135])
def test_stripes_run_as_they_are_said_to(degrees):
    wave = templates.Wave(np.radians(degrees), 9.0)
    field = templates.drawn_field(wave, lambda x, _: x < 200)
    turned = np.exp(2j * (field.orientation - wave.orientation))
    assert np.allclose(turned, 1.0, atol=1e-3)
    assert field.mask.sum() == field.mask.size / 25 * 12  # the middles of 12 columns of 25
    # along a ridge the phase stays, across it grows by a turn a period
    c, s = np.cos(wave.orientation), np.sin(wave.orientation)
    along, across = wave.at(50 * c, -50 * s), wave.at(-9 * s, -9 * c)
    assert along == pytest.approx(wave.phase)
    assert abs(across - wave.phase) == pytest.approx(2 * np.pi)


@given(SEEDS, st.integers(2, 250), st.sampled_from([*templates.FEW, *templates.MANY]))
def test_random_templates_have_the_size_that_is_asked_for(seed, size, kind):
    make = {**templates.FEW, **templates.MANY}[kind]
    made = make(size, np.random.default_rng(seed))
    assert len(made.minutiae) == size
    assert made.minutiae.xy.min() >= 0
    assert made.minutiae.xy.max() < templates.FRAME_PX
    assert made == make(size, np.random.default_rng(seed))


def test_a_print_is_moved_to_the_middle_by_whole_cells_with_its_ridges():
    mask = np.zeros((30, 40), bool)
    mask[3:6, 30:35] = True
    orientation = np.where(mask, np.linspace(0, 3, mask.size).reshape(mask.shape), 0.0)
    ridges = np.arange(mask.size, dtype=np.uint64).reshape(mask.shape)
    minutiae = Minutiae([500.0, 520.0], [60.0, 70.0], [0.0, 1.0])
    field = RidgeField(16.0, orientation, mask, ridges)
    moved = candidates.centred(Template(minutiae, 640, 480, 500.0, field))
    right, down = np.round((moved.minutiae.xy - minutiae.xy)[0] / 16.0).astype(int)
    assert np.allclose(moved.minutiae.xy - minutiae.xy, [16 * right, 16 * down])
    assert np.abs(moved.minutiae.xy.mean(axis=0) - 200).max() <= 8.0
    row, column = np.argwhere(mask).T
    for name in ("mask", "ridges", "orientation"):
        there = getattr(moved.field, name)[row + down, column + right]
        assert np.array_equal(there, getattr(field, name)[mask])
    assert moved.field.mask.sum() == mask.sum()


PRINTS = prints(2)


@given(SEEDS, st.booleans(), st.booleans())
def test_changes_keep_a_template_within_its_limits(seed, ridges, against):
    rng = np.random.default_rng(seed)
    wanted = tuple(scores.FORMS[0 if each else 1] for each in (ridges, against))
    spaces = candidates.search_spaces(PRINTS, images=False)
    space = {(one.form, one.against): one for one in spaces}[wanted]
    candidate = space.start(rng)
    assert set(candidate.fingers) <= {0, 1}
    for _ in range(10):
        candidate = space.change(candidate, rng)
        template = candidate.template()
        assert MIN_MINUTIAE <= len(template.minutiae) <= candidates.MOST_MINUTIAE
        assert 0 <= template.minutiae.xy.min() <= template.minutiae.xy.max() < 400
        assert (template.field is not None) == ridges


class Nearness:
    """The objective of candidates that are numbers: the nearer to 100, the better."""

    def of(self, candidate):
        return -abs(candidate.value - 100.0)


NUMBERS = search.SearchSpace(
    "number",
    1,
    "",
    "",
    lambda rng: SimpleNamespace(value=rng.uniform(0, 10), fingers=()),
    lambda candidate, rng: SimpleNamespace(value=candidate.value + rng.normal(), fingers=()),
)


def test_a_search_rises_and_is_the_same_for_the_same_seed():
    def reached(steps, seed=1):
        return search.evolve(NUMBERS, Nearness(), search.Budget(0.0, steps), (seed,))[1]

    found = [reached(steps) for steps in (0, 50, 900)]
    assert found == sorted(found)
    assert found[0] < -85
    assert found[2] > -30
    assert reached(50) == found[1] != reached(50, seed=2)
    assert list(search.Budget(0.0).steps_of()) == []  # ends with its time


def test_prints_of_the_same_finger_are_not_counted():
    known = prints(4, impressions=2)
    references = scores.References.of(known, scores.FORMS[0])

    def measured(*probe, **options):
        probes = [scores.Probe(*probe)]
        return scores.measured("whole", 30, probes, scores.FORMS, references, **options)

    row = measured(known.templates[0], 0)
    assert row.check.impostors == 6
    assert row.check.reached == (0, 0, 0)
    impostor = measured(known.templates[2])
    assert impostor.check.reached[2] == 2  # of finger 1, which is among the unseen
    assert (impostor.worst_share, impostor.highest > 60) == (0.5, True)
    wolf = measured(known.templates[2], adversarial=True)
    assert (wolf.check.impostors, wolf.check.reached[2]) == (4, 2)  # unseen prints alone


def test_the_objective_leaves_out_the_fingers_that_parts_are_of():
    known = prints(6)
    objective = search.Objective.on(known, scores.FORMS[0])
    candidate = candidates.TemplateCandidate(known.templates[2])
    assert objective.of(candidate) > 1 / 3
    assert objective.of(candidates.TemplateCandidate(known.templates[2], (2,))) < 0.1


def test_no_score_above_the_last_counts_more():
    weight = search.weight_of(np.array([20.0, 30.0, search.LAST, 99.0]))
    assert weight.tolist() == pytest.approx([0.1, 1.0, 10**0.1, 10**0.1])


@pytest.mark.slow
@pytest.mark.skipif(not FOUND, reason="the templates that were found are not there")
def test_found_templates_are_named_and_reach_a_score_at_most_three_times_as_often_as_stated():
    unseen, found = scores.Prints.made(4000, 4242), [load_template(path) for path in FOUND]
    assert all(map(find_doubts, found))
    alone = [scores.Probe(scores.in_form(one, scores.FORMS[1])) for one in found]
    for form in scores.FORMS:
        references = scores.References.of(unseen, form)
        for path, probe in zip(FOUND, alone, strict=True):
            row = scores.measured("found", 0, [probe], (scores.FORMS[1], form), references)
            assert factors_kept(row.as_json() | {"adversarial": True}), (path.name, form)


@given(SEEDS)
def test_composed_images_change_within_their_limits(seed):
    rng = np.random.default_rng(seed)
    bare = scores.Prints([Template(Minutiae.empty(), 1, 1)], np.array([0]), [None], [None])
    image = candidates.ImageCandidate.random(rng, bare, 64)
    for _ in range(5):
        image = candidates.changed_image(image, rng)
        assert 1 <= len(image.patches) <= candidates.MOST_PATCHES
    pixels = image.pixels()
    assert (pixels.shape, pixels.dtype, image.fingers) == ((64, 64), np.uint8, ())


def row(**other):
    figures = [{"score": 40.0, "reached": 1, "share": 0.005, "factor": 50.0}]
    usual = {"kind": "crop", "size": 64, "probes": "with ridges", "references": "minutiae alone"}
    counts = {"templates": 2, "impostors": 200, "highest": 41.25, "worst_share": 0.02}
    return {**usual, **counts, "scores": figures, "adversarial": False, **other}


def test_a_row_is_within_its_limits_or_beyond():
    assert not factors_kept(row())
    assert not share_kept(row())
    assert factors_kept(row(adversarial=True))  # one of 200, by chance
    many = [{"score": 40.0, "reached": 4, "share": 0.02, "factor": 200.0}]
    assert not factors_kept(row(adversarial=True, scores=many))
    thrice = [{"score": 30.0, "reached": 36, "share": 0.003, "factor": 3.0}]
    assert factors_kept(row(adversarial=True, scores=thrice, impostors=12000))
    assert not factors_kept(row(scores=thrice, impostors=12000))
    none = [{"score": 40.0, "reached": 0, "share": 0.0, "factor": 0.0}]
    assert factors_kept(row(scores=none))
    assert share_kept(row(worst_share=0.01))


def test_the_table_has_a_row_a_kind_and_size():
    rows = [row(), row(probes="minutiae alone"), row(kind="wolf", adversarial=True)]
    lines = format_wolves(rows).splitlines()
    assert len(lines) == 4
    assert lines[2] == "| crop | 64 | 50 | 2.00 % | 50 | 2.00 % |"
    assert lines[3] == "| wolf | 64 | 50 | 2.00 % |  |  |"


@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason="minutes where kernels are interpreted")
def test_the_command_prints_and_writes_what_it_measures(run_research, tmp_path):
    wanted = ["--kind", "fragment", "--kind", "wolf image"]
    few = ["--templates", 2, "--steps", 0, "--workers", 1]
    into = ["--json", tmp_path / "w.json"]
    kept = ["--keep", tmp_path / "kept"]
    done = run_research("measure", "wolves", ROOT / "sample_data", *wanted, *few, *into, *kept)
    assert done.exit_code in {0, 1}, done.stderr
    document = json.loads((tmp_path / "w.json").read_text())
    found = [(r["kind"], r["size"], r["probes"], r["references"]) for r in document["rows"]]
    assert len(found) == len(set(found)) == 8 * 4 + 3
    assert done.stdout.startswith("| templates | size |")
    assert {r["impostors"] for r in document["rows"] if r["kind"] == "fragment"} == {2 * 12}
    for path in (tmp_path / "kept").glob("*.json"):
        assert len(load_template(path).minutiae) >= MIN_MINUTIAE


@pytest.mark.parametrize("folder", ["nowhere", "docs"])
def test_bad_input_is_one_line(run_research, tmp_path, folder):
    done = run_research("measure", "wolves", tmp_path / folder, "--json", tmp_path / "w.json")
    assert (done.exit_code, len(done.stderr.splitlines())) == (2, 1)
    assert done.stderr.startswith("research measure wolves: error: ")
    assert not (tmp_path / "w.json").exists()
