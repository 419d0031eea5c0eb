"""Bad input of every command is one line on stderr and status 2, and leaves nothing behind."""

import shutil

import numpy as np
import pytest

from fpmatch import Minutiae, Template, save_template
from tests.conftest import assert_refused, copied

IMAGES = {
    "gone.png": "no such file",
    "folder.png": "a folder",
    "empty.png": "empty",
    "text.png": "known format",
    "truncated.png": "damaged",
    "tiny.png": "smaller",
    "huge.pgm": "64 megapixels",
}
CASES = {
    "calibrate": [
        ("nowhere -o c.json", "nowhere: no such folder"),
        ("set -o notes.txt/c.json", "c.json: cannot be written"),
        ("set -o c.json --matcher nobody", "unknown matcher 'nobody'"),
    ],
    "convert": [
        ("in.json out.iso --dpi 99", "dpi"),
        ("gone.iso out.csv", "gone.iso: no such file"),
        ("in.json out.doc", "'.doc'"),
        ("in.json in.json/out.csv", "cannot be written"),
    ],
    "enrol": [
        ("new.db 1_1.png --dpi 99", "dpi"),
        ("new.db nowhere", "nowhere: "),
        ("new.db 1_1.png --pattern (", "pattern '(': "),
        ("mysql://host/x 1_1.png", "PostgreSQL"),
    ],
    "evaluate": [
        ("nowhere", "nowhere: no such folder"),
        ("set set", "set: database"),
        ("set --scores notes.txt/s.csv", "s.csv: cannot be written"),
        ("set --report notes.txt", "notes.txt: cannot be made a folder"),
        ("set --baseline nowhere.csv", "nowhere.csv: "),
        ("set --det det.doc", ".svg"),
        ("set --table rates.xls", "a table's name ends with .tex, .csv"),
    ],
    "gallery": [
        ("list no.db --summary", "no.db: no such gallery"),
        ("check prints.db --subject x", "subject x"),
        ("remove prints.db 1 9", "number 9"),
        ("remove prints.db --subject 9", "subject 9"),
    ],
    "identify --workers 1": [
        ("prints.db 1_1.png --dpi 4001", "dpi"),
        ("prints.db nowhere.png", "nowhere.png: "),
        ("prints.db text.png", "text.png: not an image"),
        ("prints.db blank.png", "blank.png: "),
        ("no.db 1_1.png", "no.db: no such gallery"),
        ("prints.db 1_1.png --calibration text.png", "not a calibration"),
    ],
    "extract": [
        ("1_1.png -o out --dpi nan", "dpi"),
        ("1_1.png -o notes.txt", "notes.txt: cannot be made a folder"),
        ("1_1.png set/1_1.png -o out", "1_1"),
    ],
    "explain -o out": [
        ("1_1.png text.png", "text.png: line 1: "),
        ("p.csv notes.txt", "notes.txt: line 1: "),
        ("p.csv q.csv -o notes.txt", "notes.txt/index.html: cannot be written"),
    ],
    "points": [
        ("p.csv notes.txt --pairs pairs.csv", "notes.txt: line 1: "),
        ("p.csv q.csv --matcher best", "unknown matcher 'best'"),
        ("p.csv q.csv --matcher paper:rho=half", "rho is a number, not 'half'"),
        ("p.csv q.csv --tolerance -1", "-1"),
        # outputs are looked at before anything is read
        ("gone.csv gone.csv --plot plot.doc", "plot.doc: "),
        ("gone.csv gone.csv --pairs pairs.xlsx", "a list of pairs is written as .csv"),
    ],
    "score --references set --probes set -o s.csv --workers 1": [
        ("--dpi 1e999", "dpi"),
        ("--references nowhere", "nowhere: "),
        ("--pairs list.csv", "list.csv: line 1: "),
        ("--pairs gone.csv", "gone.csv: "),
        ("-o notes.txt/s.csv", "s.csv: cannot be written"),
        ("--calibration notes.txt", "notes.txt: "),
    ],
    "synth": [
        ("new --seed -1", "seed -1: "),
        ("new --fingers 0", "0 fingers"),
        ("new --impressions 1001", "at most 1000 impressions"),
        ("notes.txt", "notes.txt: cannot be"),
    ],
    "verify": [
        ("1_1.png 1_2.png --probe-dpi 0", "dpi"),
        ("1_1.png 1_2.png --reference-dpi 0", "dpi"),
        *((f"{name} 1_1.png --overlay out.png", reason) for name, reason in IMAGES.items()),
        ("1_1.png 1_2.png --fmr 0", "false match rate"),
        ("1_1.png 1_2.png --threshold 101", "threshold"),
        ("1_1.png 1_2.png --fmr 0.1 --threshold 9", "exclude each other"),
        ("1_1.png 1_2.png --matcher paper:rho=1.1", "rho lies from 0 to 1, not 1.1"),
        ("1_1.png 1_2.png --matcher paper:rho=0.5 --fmr 0.01", "rho decides"),
        ("1_1.png 1_2.png --calibration no.json", "no.json: "),
        # outputs are looked at before anything is read
        ("gone.png 1_1.png --overlay a.jpg", "an overlay is written as .png or .svg"),
        ("gone.png 1_1.png --case-report a.pdf", "a case report is written as .html or .htm"),
        ("gone.png 1_1.png --case-report notes.txt/a.html", "cannot be written: not a directory"),
    ],
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory, prints, gallery):
    """Return a folder with what the cases name, good and bad."""
    folder = tmp_path_factory.mktemp("bad") / "input"
    bad = (name for name in IMAGES if name not in {"gone.png", "folder.png"})
    copied(prints, folder, "1_1.png", "1_2.png", "blank.png", *bad)
    copied(prints, folder / "set", "1_1.png", "2_1.png")
    shutil.copy(gallery, folder / "prints.db")
    for name in ("folder.png", "empty"):
        (folder / name).mkdir()
    rng = np.random.default_rng(9)
    for name in ("p.csv", "q.csv"):
        points = rng.uniform(0, 100, (25, 2))
        points[0] = 200.0  # on the outer boundary
        np.savetxt(folder / name, points, delimiter=",")
    (folder / "notes.txt").write_text("something else entirely\n")
    (folder / "list.csv").write_text("x,y\n")
    save_template(folder / "in.json", Template(Minutiae([10], [5], [0]), 300, 400))
    return folder


@pytest.mark.parametrize(
    ("command", "words", "reason"),
    [(command, words, reason) for command, cases in CASES.items() for words, reason in cases],
)
def test_bad_input_is_one_line(run, folder, monkeypatch, command, words, reason):
    if "--report" in words:
        pytest.importorskip("matplotlib")
    monkeypatch.chdir(folder)
    before = {path.name for path in folder.iterdir()}
    assert_refused(run(*command.split(), *words.split()), reason)
    new = {path.name for path in folder.iterdir()} - before
    assert {name for name in new if not name.startswith("prints.db")} == set()
