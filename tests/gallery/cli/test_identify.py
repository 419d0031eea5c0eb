import json

import pytest
from PIL import Image

from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing import prints as listing
from fpmatch.prints.reading import ASSUMED_DPI
from tests.conftest import assert_refused, copied, rows_of


def test_candidates_as_json(run, gallery, prints, tmp_path):
    folder = copied(prints, tmp_path / "probes", "empty.png", probe="1_1.png")
    words = ("--threshold", 60, "--json", "--workers", 1)
    result = run("identify", gallery, folder, *words)
    assert result.exit_code == 1
    assert f"fpmatch: error: {folder}/empty.png: the file is empty\n" in result.stderr
    document = json.loads(result.stdout)
    assert (document["compared"], document["fingers"], document["listed"]) == (3, 2, "subjects")
    assert document["failures"] == [f"{folder}/empty.png: the file is empty"]
    (probe,) = document["probes"]
    assert probe["probe"] == f"{folder}/probe.png"
    (best,) = probe["candidates"]
    assert (best["rank"], best["subject"], best["impressions"]) == (1, "1", 2)
    assert best["expected_false_matches"] == pytest.approx(2 * best["fmr"])
    assert best["impression_score"] >= best["score"] > 60
    assert best["extrapolated"] is True


def test_a_candidate_that_is_the_same_image_is_named(run, gallery, prints, tmp_path):
    Image.open(prints / "1_1.png").save(tmp_path / "copy.bmp", dpi=(500, 500))
    result = run("identify", gallery, tmp_path / "copy.bmp", prints / "1_2.png", "--workers", 1)
    notes = [line for line in result.stderr.splitlines() if "the same image as entry" in line]
    same = "the same image as entry"
    assert [note.removeprefix("fpmatch: note: ") for note in notes] == [
        f"{tmp_path}/copy.bmp: {same} 1, 1_1: its score proves nothing",
        f"{prints}/1_2.png: {same} 3, 1_2: its score proves nothing",
    ]


def test_a_probe_that_is_changed_while_it_is_read_is_not_searched_for(
    run, gallery, prints, tmp_path, monkeypatch
):
    [probe] = copied(prints, tmp_path / "probes", "1_1.png").iterdir()
    read = listing.read_one_print

    def changed(file, *rest):
        made = read(file, *rest)
        probe.write_bytes(probe.read_bytes() + b"more")
        return made

    monkeypatch.setattr(listing, "read_one_print", changed)
    result = run("identify", gallery, probe, "--workers", 1)
    assert_refused(result, f"{probe}: was changed while it was read")


def test_no_candidate_and_an_assumed_resolution_are_said(run, prints, tmp_path):
    open_gallery(tmp_path / "empty.db", create=True).close()
    probe = prints / "untagged.tif"
    result = run("identify", tmp_path / "empty.db", probe, "--matcher", "paper", "--workers", 1)
    assert (result.exit_code, f"{probe}: {ASSUMED_DPI}" in result.stderr) == (0, True)
    assert result.stdout.endswith(", no candidate\n")


@pytest.fixture
def people(run, prints, tmp_path):
    """Return a gallery of two people, of whose fingers one is of both."""
    folder = tmp_path / "people"
    folder.mkdir()
    sources = {"ada_left": "1_1", "ada_right": "2_1", "bob_left": "2_1", "bob_right": "1_1"}
    for name, source in sources.items():
        data = (prints / f"{source}.png").read_bytes() + name.encode()
        (folder / f"{name}.png").write_bytes(data)
    db = tmp_path / "people.db"
    pattern = r"(?P<subject>[a-z]+)_(?P<finger>[a-z]+)"
    assert run("enrol", db, folder, "--pattern", pattern, "--workers", 1).exit_code == 0
    return db


def test_a_person_is_listed_once(run, people, prints):
    words = ("identify", people, prints / "1_1.png", "--json", "--workers", 1)
    listed = json.loads(run(*words).stdout)["probes"][0]["candidates"]
    named = [(one["rank"], one["subject"], one["finger"]) for one in listed]
    assert named == [(1, "ada", "left"), (2, "bob", "right")]
    chance = min(one["expected_false_matches"] for one in listed)
    assert json.loads(run(*words, "--by-chance", chance).stdout)["probes"][0]["candidates"] == []


def test_two_fingers_are_searched_together(run, people, prints, tmp_path):
    probes = []
    for finger, name in (("left", "1_1"), ("right", "2_1")):
        probes.append(tmp_path / f"{finger}.csv")
        probes[-1].write_text(f"path,subject,finger\n{prints}/{name}.png,unknown,{finger}\n")
    words = ("identify", people, prints / "1_1.png", "--with", prints / "2_1.png", "--workers", 1)
    result = run("identify", people, probes[0], "--with", probes[1], "--workers", 1)
    assert (result.exit_code, result.stderr) == (0, "")
    _, _, first, second, note = result.stdout.splitlines()
    assert first.split()[-4:][::2] == ["ada_left", "ada_right"]
    assert second.split()[-4::2] == ["bob_left", "bob_right"]
    assert note.strip().startswith("* extrapolated: measured up to 1 in ")
    document = json.loads(run(*words, "--json").stdout)
    assert (document["subjects"], document["fingers"]) == (2, ["", ""])
    assert document["probes"] == [f"{prints}/1_1.png", f"{prints}/2_1.png"]
    tied = [(one["rank"], one["subject"], one["score"]) for one in document["candidates"]]
    assert tied == [(1, "ada", tied[0][2]), (2, "bob", tied[0][2])]
    found = document["candidates"][1]["fingers"]
    assert [(f["probe"], f["finger"]) for f in found] == [
        (document["probes"][0], "right"),
        (document["probes"][1], "left"),
    ]


def test_candidates_in_a_file_are_those_that_are_shown(run, gallery, prints, tmp_path):
    folder = copied(prints, tmp_path / "probes", "empty.png", probe="1_1.png", other="2_1.png")
    words = ("--workers", 1, "-k", 2, "--json")
    shown = run("identify", gallery, folder, *words)
    output = tmp_path / "c.csv"
    result = run("identify", gallery, "--probes", folder, "-o", output, *words)
    assert (result.exit_code, shown.exit_code) == (1, 1)
    assert result.stderr == f"fpmatch: failed: {folder}/empty.png: the file is empty\n"
    document = json.loads(result.stdout)
    assert (document["probes"], document["rows"], document["failed"]) == (3, 5, 1)
    assert document["failures"] == [{"probe": f"{folder}/empty.png", "reason": "the file is empty"}]
    rows = rows_of(output)
    assert [(row["probe"], row["reason"]) for row in rows if row["reason"]] == [
        (f"{folder}/empty.png", "the file is empty")
    ]
    for probe in json.loads(shown.stdout)["probes"]:
        found = [row for row in rows if row["probe"] == probe["probe"]]
        assert [(row["id"], row["score"], row["fmr"]) for row in found] == [
            (str(one["id"]), str(one["score"]), str(one["fmr"])) for one in probe["candidates"]
        ]


def test_a_file_of_no_probe_that_can_be_read_ends_with_status_2(run, gallery, prints, tmp_path):
    folder = copied(prints, tmp_path / "probes", "empty.png", "text.png")
    result = run("identify", gallery, "--probes", folder, "-o", tmp_path / "c.jsonl")
    assert result.exit_code == 2
    named = [line.split(": ")[2] for line in result.stderr.splitlines()]
    assert named == [f"{folder}/empty.png", f"{folder}/text.png"]


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ((), "Missing argument 'PROBE...'"),
        (("p.png", "q.png", "--with", "q.png"), "--with goes with one PROBE, not with 2"),
        (("p.png", "-o", "c.csv", "--with", "q.png"), "-o excludes"),
        (("p.png", "--workers", 2, "--scheduler", "tcp://x:1"), "exclude each other"),
        (("p.png", "--scheduler", "tcp://x:1"), "--scheduler goes with -o"),
        (("p.png", "-o", "c.csv", "--scheduler", "nonsense"), "no Dask scheduler answers"),
        (("p.png", "-o", "c.txt"), "candidates are written as .csv"),
        (("p.png", "-o", "prints.db/c.csv"), "not a directory"),
    ],
)
def test_what_a_file_of_candidates_needs(run, gallery, prints, monkeypatch, words, reason):
    if "nonsense" in words:
        pytest.importorskip("distributed", reason="Dask (extra dask) is not installed")
    monkeypatch.setattr("fpmatch.gallery.engine.executors.CONNECT_S", 0.3)
    monkeypatch.chdir(gallery.parent)
    files = {"p.png": prints / "1_1.png", "q.png": prints / "2_1.png"}
    result = run("identify", gallery, *(files.get(word, word) for word in words))
    assert result.exit_code == 2
    assert reason in result.stderr
    assert "Traceback" not in result.stderr
