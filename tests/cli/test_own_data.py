"""People's own data at the command line: manifests, folders, patterns, pairs, galleries."""

import json
import shutil

import pytest

from .conftest import assert_refused, copied, rows_of


@pytest.fixture
def scans(prints, tmp_path):
    """Return a folder of the prints under other names, with a manifest and folders of fingers."""
    folder = tmp_path / "scans"
    folder.mkdir()
    rows = ["path,subject,finger,dpi\n"]
    for source in sorted(prints.glob("*_*.png")):
        finger, number = source.stem.split("_")
        name = f"{finger}-left index-{'ab'[int(number) - 1]}.png"
        shutil.copy(source, folder / name)
        rows.append(f"{name},{finger},left index,500\r\n")
        below = tmp_path / "people" / finger / "left index"
        below.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, below)
    (folder / "manifest.csv").write_text("".join(rows), newline="")
    return folder


def evaluated(run, *words):
    result = run("evaluate", "--workers", 1, "--bootstrap", 0, "--json", *words)
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    return [(row["genuine"], row["impostor"], row["eer"]) for row in document["sets"]], result


def test_evaluate_takes_every_form(run, prints, scans, tmp_path):
    expected, _ = evaluated(run, prints)
    pattern = r"(?P<subject>\d)-(?P<finger>[a-z ]+)-(?P<impression>[ab])"
    for words in (
        (scans / "manifest.csv",),
        (scans, "--pattern", pattern),
        (tmp_path / "people",),
        (tmp_path / "people", "--by-folder"),
    ):
        found, result = evaluated(run, *words)
        assert found == expected
        assert result.stderr == ""
    database = tmp_path / "own.db"
    assert run("enrol", database, scans / "manifest.csv", "--workers", 1).exit_code == 0
    assert evaluated(run, database)[0] == expected


def test_a_gallery_of_a_manifest_has_its_fingers_and_finds_its_probes(run, scans, tmp_path):
    database, manifest = tmp_path / "own.db", scans / "manifest.csv"
    document = json.loads(run("enrol", database, manifest, "--workers", 1, "--json").stdout)
    assert document["failed"] == 0
    listed = json.loads(run("gallery", "list", database, "--json").stdout)
    labels = {(e["subject"], e["finger"], e["impression"]) for e in listed}
    assert ("1", "left index", "1") in labels
    found = json.loads(run("identify", database, manifest, "--json").stdout)
    assert len(found["probes"]) == document["enrolled"] == len(listed)
    by_folder = tmp_path / "folders.db"
    assert run("enrol", by_folder, tmp_path / "people", "--workers", 1).exit_code == 0
    listed = json.loads(run("gallery", "list", by_folder, "--json").stdout)
    assert {(e["subject"], e["finger"]) for e in listed} == {label[:2] for label in labels}


def test_score_knows_genuine_pairs_from_lists_and_manifests(run, prints, scans, tmp_path):
    out, listed = tmp_path / "scores.csv", tmp_path / "list.txt"
    words = ("-o", out, "--workers", 1)
    copy = tmp_path / "copy.csv"
    copy.write_text((scans / "manifest.csv").read_text().replace("\n1-", "\nscans/1-"))
    copy.write_text("\n".join(line for line in copy.read_text().split("\n") if line[:1] != "2"))
    assert (
        run("score", "--references", scans / "manifest.csv", "--probes", copy, *words).exit_code
        == 0
    )
    for row in rows_of(out):
        assert row["probe"].startswith("scans/")
        assert row["genuine"] == str(int(row["reference"][0] == row["probe"][len("scans/")]))
    listed.write_text(f"1_1 2_1 1\n1_1 {prints.name}/1_2.png 0\n")
    sides = ("--references", prints, "--probes", prints, "--pairs", listed)
    assert run("score", *sides, *words).exit_code == 0
    assert [(r["reference"], r["genuine"]) for r in rows_of(out)] == [
        ("2_1.png", "1"),
        ("1_2.png", "0"),
    ]
    sides = ("--references", scans, "--probes", tmp_path / "people")
    assert run("score", *sides, *words).exit_code == 0
    assert {row["genuine"] for row in rows_of(out)} == {""}


def test_a_list_of_pairs_with_labels_needs_no_fingers_in_names(run, scans, tmp_path):
    listed = tmp_path / "list.txt"
    names = "1-left index-a.png", "1-left index-b.png", "2-left index-a.png"
    listed.write_text(
        f"probe;reference;genuine\n{names[0]};{names[1]};1\n{names[0]};{names[2]};0\n"
    )
    (row,), _ = evaluated(run, scans, "--pairs", listed)
    assert row[:2] == (1, 1)
    text = run("evaluate", scans, "--pairs", listed, "--workers", 1).stdout
    assert text.splitlines()[1].split()[:3] == ["scans", "1", "1"]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("path,subject\ngone.png,1\n", "manifest.csv: line 2, column path: gone.png: no such file"),
        (
            "path,subject,dpi\n1_1.png,1,x\n",
            "manifest.csv: line 2, column dpi: 'x' is not a number",
        ),
        ("path,subject\n1_1.png,1\n1_1.png,2\n", "line 3, column path: 1_1.png is on line 2, too"),
    ],
)
def test_a_wrong_manifest_stops_every_command_before_any_work(
    run, prints, tmp_path, content, reason
):
    manifest = copied(prints, tmp_path / "some", "1_1.png") / "manifest.csv"
    out = tmp_path / "out.csv"
    manifest.write_text(content)
    for words in (
        ("evaluate", manifest, "--scores", out),
        ("calibrate", manifest, "-o", out),
        ("score", "--references", manifest, "--probes", prints, "-o", out),
        ("enrol", out, manifest),
    ):
        assert_refused(run(*words), reason)
        assert not out.exists()
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith("out")] == []


def test_options_that_exclude_each_other(run, prints, tmp_path):
    listed = tmp_path / "list.txt"
    listed.write_text("1_1 1_2\n")
    result = run("evaluate", prints, "--pairs", listed, "--enrol", 1)
    assert (result.exit_code, "--enrol goes with none" in result.stderr) == (2, True)
    assert_refused(run("evaluate", prints, prints, "--pairs", listed), "goes with one database")
    assert_refused(run("evaluate", prints, "--pattern", "("), "pattern '('")
    assert_refused(run("evaluate", tmp_path / "gone", "--by-folder"), "gone: no such folder")


def test_resolutions_that_differ_are_noted_by_every_command(run, scans, tmp_path):
    manifest = scans / "manifest.csv"
    manifest.write_text(
        manifest.read_text().replace("index-b.png,1,left index,500", "index-b.png,1,left index,480")
    )
    note = "480 dpi, where most prints have 500 dpi"
    for words in (
        ("evaluate", manifest, "--bootstrap", 0),
        ("score", "--references", manifest, "--probes", manifest, "-o", tmp_path / "out.csv"),
        ("enrol", tmp_path / "own.db", manifest),
    ):
        result = run(*words, "--workers", 1, "--json")
        assert (result.exit_code, result.stderr.count(note)) == (0, 1)
        (noted,) = json.loads(result.stdout)["notes"]
        assert noted["note"] == note
        assert noted["prints"][0].endswith("1-left index-b.png")
