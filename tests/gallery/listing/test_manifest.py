"""Manifests: every form that spreadsheets write, and one line on whatever is wrong."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fpmatch.errors import DatasetError, ScoringError
from fpmatch.gallery.batch.plan import iterate_pairs
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.listing.manifest import kind_of, number_impressions, read_manifest
from fpmatch.gallery.listing.prints import find_prints


@pytest.fixture
def manifest(tmp_path):
    """Return the function that writes a manifest beside three files."""
    for name in ("a.png", "b, c.png", "d.iso"):
        (tmp_path / name).touch()

    def write(content):
        path = tmp_path / "manifest.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


FULL = "path,subject,finger,impression,dpi\na.png,ada,right index,1,500\n"


@pytest.mark.parametrize(
    "text",
    [
        FULL,
        "\ufeff" + FULL.replace("\n", "\r\n"),
        FULL.replace(",", ";"),
        FULL.replace(",", "\t"),
        '"PATH","Subject","finger","impression","dpi"\n"a.png","ada","right index","1","500"\n,\n',
        "\n dpi, x , path, impression , finger , subject \n500.0,new,a.png, 1 ,right index,ada\n",
    ],
    ids=["plain", "BOM and CRLF", "semicolons", "tabs", "quoted", "other order and columns"],
)
def test_a_print_in_every_form(manifest, text):
    path = manifest(text)
    assert kind_of(path) == "manifest"
    (found,) = read_manifest(path)
    assert (found.path, found.name) == (path.parent / "a.png", "a.png")
    assert found.label == Label("ada", "right index", "1")
    assert found.dpi == 500.0


def test_path_and_subject_are_enough_and_impressions_are_numbered(manifest):
    path = manifest('subject,path,impression\nada,a.png,\nada,"b, c.png",1\nbob,d.iso\n')
    labels = [str(file.label) for file in read_manifest(path)]
    assert labels == ["ada_2", "ada_1", "bob_1"]


def test_resolutions_are_those_of_the_manifest_else_of_the_description(manifest):
    path = manifest('path,subject,dpi\na.png,ada,1000\n"b, c.png",ada,\n')
    assert [file.dpi for file in find_prints([path])] == [1000, None]
    (path.parent / "dataset.toml").write_text("dpi = 569\n")
    assert [file.dpi for file in find_prints([path])] == [1000, 569]
    assert [file.dpi for file in find_prints([path], 500)] == [500, 500]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "line 1: no column path; a manifest has the columns path and subject"),
        ("path,person\na.png,ada\n", "line 1: no column subject"),
        ("path,subject,path\n", "line 1: more than one column path"),
        ("path,subject\n", "the manifest lists no prints"),
        ("path,subject\n\na.png\n", "line 3, column subject: is empty"),
        ("path,subject\n,ada\n", "line 2, column path: is empty"),
        ("path,subject\na.png,ada,more\n", "line 2: 3 values, of 2 columns"),
        ("path,subject\ngone.png,ada\n", "line 2, column path: gone.png: no such file"),
        ('path,subject\n"a\nb",ada\n', r"line 3, column path: a\nb: no such file"),
        ("path,subject\n.,ada\n", "line 2, column path: .: no such file"),
        ("path,subject\na\0b,ada\n", "line 2"),
        ('path,subject\na.png,"a\nb"\n', "line 3, column subject: must be text of one line"),
        ("path,subject,dpi\na.png,ada,fine\n", "line 2, column dpi: 'fine' is not a number"),
        ("path,subject,dpi\na.png,ada,50\n", "line 2, column dpi: resolution of 50 dpi is outside"),
        ("path,subject,dpi\na.png,ada,nan\n", "line 2, column dpi: resolution of nan dpi"),
        (
            "path,subject\na.png,ada\n./a.png,bob\n",
            "line 3, column path: ./a.png is on line 2, too",
        ),
        (
            "path,subject,impression\na.png,ada,1\nd.iso,ada,1\n",
            "line 3, column impression: ada_1 is on line 2, too",
        ),
        (b"path,subject\na.png,ad\xff\n", "not a CSV file in UTF-8"),
        ('path,subject\n"a.png,ada\n', "not a CSV file: unexpected end of data"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(manifest, content, reason):
    path = manifest(content)
    with pytest.raises(DatasetError) as caught:
        read_manifest(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_no_file(tmp_path):
    with pytest.raises(DatasetError, match=r"gone\.csv: cannot be read: no such file"):
        read_manifest(tmp_path / "gone.csv")
    assert kind_of(tmp_path) == "folder"
    for text in ("x,y,theta\n1,2,3\n", "probe,reference\n", "\0path\0", ""):
        (tmp_path / "other.csv").write_text(text)
        assert kind_of(tmp_path / "other.csv") == "file"


@given(
    st.lists(st.builds(Label, st.sampled_from("ab"), st.just(""), st.sampled_from(["", "1", "2"])))
)
def test_numbers_are_new_ones_and_given_impressions_stay(labels):
    found = number_impressions(labels)
    assert all(one == other for one, other in zip(labels, found, strict=True) if one.impression)
    numbered = [new for old, new in zip(labels, found, strict=True) if not old.impression]
    assert len(set(numbered)) == len(numbered)
    assert not set(numbered) & {label for label in labels if label.impression}


CELLS = st.sampled_from(
    ["path", "subject", "dpi", "a.png", "./a.png", "1", "", '"', "x y", "\ufeff", "é"]
)
TABLES = st.lists(st.lists(CELLS, max_size=4), max_size=4).flatmap(
    lambda rows: st.sampled_from([",", ";", "\t", " "]).map(
        lambda mark: "\n".join(mark.join(row) for row in rows).encode()
    )
)


@given(st.one_of(st.binary(max_size=60), TABLES), st.sampled_from([read_manifest, iterate_pairs]))
def test_any_bytes_are_a_table_or_refused_in_one_line(tmp_path_factory, content, read):
    folder = tmp_path_factory.mktemp("any")
    (folder / "a.png").touch()
    (folder / "table").write_bytes(content)
    kind_of(folder / "table")
    refused = ""
    try:
        list(read(folder / "table"))
    except (DatasetError, ScoringError) as error:
        refused = str(error)
    assert not refused or refused.startswith(f"{folder / 'table'}: ")
    assert len(refused.splitlines()) <= 1
