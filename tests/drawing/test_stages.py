import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from fpmatch.drawing.stages import stage_picture, value_range, write_stages
from fpmatch.errors import ImageError, OutputError

NAMES = [
    "input", "normalised", "mask", "orientation", "coherence", "period", "enhanced", "binary",
    "skeleton", "some other stage",
]  # fmt: skip


PLANES = arrays.arrays(
    st.sampled_from([np.bool_, np.uint8, np.int32, np.float32, np.float64]),
    arrays.array_shapes(min_dims=2, max_dims=2, max_side=20),
)
EVEN = st.sampled_from([np.full((12, 14), value, np.float32) for value in (np.nan, np.inf, 0.0)])


@given(name=st.sampled_from(NAMES), array=PLANES | EVEN)
def test_any_plane_of_numbers_is_a_picture(name, array):
    picture = stage_picture(name, array)
    assert picture.dtype == np.uint8
    assert picture.shape == (*array.shape, 3)


@pytest.mark.parametrize("name", ["input", "binary", "minutiae", "whatever"])
@pytest.mark.parametrize(
    "array",
    [np.zeros(4), np.zeros((0, 5, 2)), np.zeros((2, 2, 2)), np.zeros((2, 3), complex)],
    ids=["1-d", "empty", "3-d", "complex"],
)
def test_arrays_that_cannot_be_drawn_are_refused_by_name(name, array):
    with pytest.raises(ImageError, match=f"stage {name}: "):
        stage_picture(name, array)


def test_ridges_are_dark_in_every_stage(whorl):
    assert (stage_picture("input", whorl) == whorl[..., None]).all()
    wave = 127 - whorl.astype(np.float32)  # high on ridges, as normalised and enhanced prints are
    ridge = (whorl < 60) & np.pad(np.ones((200, 180), bool), 20)
    valley = (whorl > 200) & np.pad(np.ones((200, 180), bool), 20)
    for name, array in (
        ("input", whorl), ("normalised", wave), ("enhanced", wave), ("binary", whorl < 127),
        ("skeleton", whorl < 127),
    ):  # fmt: skip
        picture = stage_picture(name, array).mean(axis=2)
        assert picture[ridge].mean() + 100 < picture[valley].mean(), name


def test_contrast_is_stretched_despite_outliers():
    field = np.linspace(3.0, 3.1, 2500).reshape(50, 50)
    field[0, 0] = 1e9
    picture = stage_picture("anything", field)
    assert picture[1:].min() < 10
    assert picture.max() == 255


def test_unknown_places_are_white():
    field = np.linspace(7, 12, 400).reshape(20, 20)
    field[:, :10] = np.nan
    for name in ("period", "coherence"):
        picture = stage_picture(name, field)
        assert (picture[:, :4] == 255).all(), name
        assert (picture[:, 12:].min(axis=2) < 255).all(), name


def test_needles_lie_along_orientations_where_they_are_known():
    assert (stage_picture("orientation", np.full((12, 12), np.nan)) == 255).all()
    dark = stage_picture("orientation", np.full((12, 12), np.pi / 4)).max(axis=2) < 120
    rows, columns = np.nonzero(dark)
    assert np.corrcoef(rows, columns)[0, 1] < -0.8  # rising to the right, as y points down


def test_a_mask_tints_the_outside(whorl):
    mask = np.zeros(whorl.shape, bool)
    mask[:, :110] = True
    picture = stage_picture("mask", mask, whorl)
    assert (picture[:, :110, 0] == whorl[:, :110]).all()
    assert (picture[:, 110:, 2] > picture[:, 110:, 0]).all()
    assert (stage_picture("mask", mask[:10, :10], whorl) == 255).all()  # another size: no backdrop


def test_minutiae_are_marked_where_they_lie(whorl):
    rows = np.array([[60.0, 80.0, 0.0, 1, 90], [150.0, 40.0, np.pi / 2, 2, 50]], np.float32)
    bare = stage_picture("minutiae", rows[:0], whorl)
    marked = stage_picture("minutiae", rows, whorl)
    assert marked.shape == (480, 440, 3)
    differs = (marked != bare).any(axis=2)
    ys, xs = np.nonzero(differs)
    near = [np.hypot(xs - x, ys - y) < 25 for x, y in ((121, 161), (301, 81))]
    assert min(map(np.sum, near)) > 50
    assert (near[0] | near[1]).all()
    assert differs[161, 121 + 14]  # the tick points to the right
    assert not differs[161, 121 - 14]


@pytest.mark.parametrize(
    ("name", "array", "words"),
    [
        ("minutiae", np.zeros((7, 5)), "7 found"),
        ("mask", np.array([[True, False]]), "50 % set"),
        ("input", np.array([[3, 200]], np.uint8), "3 to 200"),
        ("orientation", np.array([[0.5, np.nan]]), "0.50 to 0.50 rad"),
        ("enhanced", np.array([[np.nan]]), "no values"),
    ],
)
def test_ranges_of_values(name, array, words):
    assert value_range(name, array) == words


def test_files_are_numbered_and_their_names_cannot_leave_the_folder(tmp_path):
    stages = {"input": np.eye(4), "../../etc: x": np.eye(4), "minutiae": np.empty((0, 5))}
    folder = tmp_path / "a" / "b"
    written = write_stages(stages, folder)
    names = ["01_input.png", "02__etc_x.png", "03_minutiae.png"]
    assert [p.name for p in written] == sorted(p.name for p in folder.iterdir()) == names
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


def test_an_error_leaves_what_was_there(tmp_path, whorl):
    with pytest.raises(ImageError, match="stage odd: "):
        write_stages({"input": whorl, "odd": np.zeros(3)}, tmp_path / "out")
    with pytest.raises(OutputError, match="no stage"):
        write_stages({}, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    (tmp_path / "out").write_bytes(b"")
    with pytest.raises(OutputError, match="out: "):
        write_stages({"a": np.eye(4)}, tmp_path / "out")
    assert (tmp_path / "out").read_bytes() == b""
