"""People's own data at the command line: manifests, folders, patterns, pairs, galleries."""

import shutil

import pytest

from tests.conftest import rows_of


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


def test_score_knows_genuine_pairs_from_lists_and_manifests(run, prints, scans, tmp_path):
    out, listed, copy = (tmp_path / name for name in ("scores.csv", "list.txt", "copy.csv"))

    def scored(references, probes, *words):
        given = ("--references", references, "--probes", probes, "-o", out, "--workers", 1)
        assert run("score", *given, *words).exit_code == 0
        return rows_of(out)

    copy.write_text((scans / "manifest.csv").read_text().replace("\n1-", "\nscans/1-"))
    copy.write_text("\n".join(line for line in copy.read_text().split("\n") if line[:1] != "2"))
    for row in scored(scans / "manifest.csv", copy):
        assert row["probe"].startswith("scans/")
        assert row["genuine"] == str(int(row["reference"][0] == row["probe"][len("scans/")]))
    listed.write_text(f"1_1 2_1 1\n1_1 {prints.name}/1_2.png 0\n")
    rows = scored(prints, prints, "--pairs", listed)
    assert [(r["reference"], r["genuine"]) for r in rows] == [("2_1.png", "1"), ("1_2.png", "0")]
    assert {row["genuine"] for row in scored(scans, tmp_path / "people")} == {""}
