"""Bad input of every command is one line on stderr and status 2, and leaves nothing behind."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from fpmatch import Minutiae, Template, extract, save_template
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
POINTS = {
    "few.csv": ("1,2\n3,4\n", "few.csv: fewer than three points"),
    "huge.csv": ("1e300,0\n0,1e300\n-1e300,2e300\n", "huge.csv: coordinates"),
    "word.csv": ("1,2\n3,4\nx,6\n", "word.csv, line 3: "),
    "none.csv": ("", "none.csv: "),
}
CASES = {
    "calibrate": [
        ("nowhere -o c.json", "nowhere: no such folder"),
        ("notes.txt -o c.json", "notes.txt: line 1: "),
        ("scores.csv -o c.json", "too few"),
        ("empty -o c.json", "empty: holds no prints"),
        ("set -o notes.txt/c.json", "c.json: cannot be written"),
        ("set -o c.json --matcher nobody", "unknown matcher 'nobody'"),
    ],
    "convert": [
        ("gone.iso out.csv", "gone.iso: no such file"),
        ("in.json out.doc", "'.doc'"),
        ("in.json in.json/out.csv", "cannot be written"),
    ],
    "enrol": [
        ("new.db nowhere", "nowhere: "),
        ("new.db empty", "empty: "),
        ("new.db 1_1.png --pattern (", "pattern '(': "),
        ("new.db 1_1.png --pattern x", "(?P<subject>"),
        ("notes.txt 1_1.png", "notes.txt: not a gallery"),
        ("mysql://host/x 1_1.png", "PostgreSQL"),
    ],
    "evaluate": [
        ("nowhere", "nowhere: no such folder"),
        ("notes.txt", "notes.txt: line 1: no column path"),
        ("empty", "empty: holds no prints"),
        ("set set", "set: database"),
        ("set --matcher nobody", "unknown matcher 'nobody'"),
        ("set --scores notes.txt/s.csv", "s.csv: cannot be written"),
        ("set --report notes.txt", "notes.txt: cannot be made a folder"),
        ("set --baseline nowhere.csv", "nowhere.csv: "),
        ("set --ground-truth", "1.json: no such file"),
        ("set --det det.doc", ".svg"),
        ("set --table rates.xls", "a table's name ends with .tex, .csv"),
    ],
    "evaluate-identification --workers 1": [
        ("set --background nowhere", "nowhere: no such"),
        ("set --det det.doc", ".svg"),
    ],
    "gallery": [
        ("list no.db --summary", "no.db: no such gallery"),
        ("check prints.db --subject x", "subject x"),
        ("remove prints.db 1 9", "number 9"),
        ("remove prints.db --subject 9", "subject 9"),
    ],
    "identify --workers 1": [
        ("prints.db nowhere.png", "nowhere.png: "),
        ("prints.db text.png", "text.png: not an image"),
        ("prints.db blank.png", "blank.png: "),
        ("no.db 1_1.png", "no.db: no such gallery"),
        ("prints.db 1_1.png --calibration text.png", "not a calibration"),
    ],
    "extract": [
        ("1_1.png -o notes.txt", "notes.txt: cannot be made a folder"),
        ("1_1.png set/1_1.png -o out", "1_1"),
    ],
    "explain -o out": [
        ("1_1.png text.png", "text.png: "),
        ("p.csv word.csv", "word.csv, line 3: "),
        ("p.csv q.csv -o notes.txt", "notes.txt/index.html: cannot be written"),
        ("p.csv q.csv --pair 99", "--pair 99: "),
    ],
    "points": [
        *((f"{name} q.csv --pairs pairs.csv", reason) for name, (_, reason) in POINTS.items()),
        ("p.csv few.csv --pairs pairs.csv", "few.csv: "),
        ("p.csv q.csv --matcher best", "unknown matcher 'best'"),
        ("p.csv q.csv --matcher paper:rho=half", "rho is a number, not 'half'"),
        ("p.csv q.csv --matcher triangles:rho=0.5", "no parameter 'rho'"),
        ("p.csv q.csv --tolerance -1", "-1"),
        # outputs are looked at before anything is read
        ("gone.csv gone.csv --plot plot.gif", "plot.gif: "),
        ("gone.csv gone.csv --pairs pairs.xlsx", "a list of pairs is written as .csv"),
    ],
    "score --references set --probes set -o s.csv --workers 1": [
        ("--references nowhere", "nowhere: "),
        ("--probes empty", "empty: "),
        ("--pairs list.csv", "list.csv: line 1: "),
        ("--pairs gone.csv", "gone.csv: "),
        ("-o scores.xlsx", "scores.xlsx: "),
        ("-o notes.txt/s.csv", "s.csv: cannot be written"),
        ("--matcher nobody", "unknown matcher 'nobody'"),
        ("--calibration notes.txt", "notes.txt: "),
        ("--fingers f.csv --threshold 40", "no threshold"),
    ],
    "synth": [
        ("new --fingers 0", "0 fingers"),
        ("new --seed -1", "seed -1: "),
        ("new --size 10x400", "side"),
        ("new --size 400x400 --dpi 50", "50 dpi"),
        ("set", "holds files but no"),
        ("notes.txt", "notes.txt: cannot be"),
        ("set --templates", "set: is a folder, not a gallery"),
    ],
    "verify": [
        *((f"{name} 1_1.png --overlay out.png", reason) for name, reason in IMAGES.items()),
        ("1_1.png 1_2.png --fmr 0", "false match rate"),
        ("1_1.png 1_2.png --threshold 101", "threshold"),
        ("1_1.png 1_2.png --fmr 0.1 --threshold 9", "exclude each other"),
        ("1_1.png 1_2.png --matcher best", "unknown matcher 'best'"),
        ("1_1.png 1_2.png --matcher paper:rho=1.1", "rho lies from 0 to 1, not 1.1"),
        ("1_1.png 1_2.png --matcher paper:rho=0.5 --fmr 0.01", "rho decides"),
        ("1_1.png 1_2.png --matcher unit-circle:rho=0.5", "has no parameter 'rho'"),
        ("1_1.png 1_2.png --matcher unit-circle:round=2", "Did you mean 'rounds'?"),
        ("1_1.png 1_2.png --calibration no.json", "no.json: "),
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
    for name, (text, _) in POINTS.items():
        (folder / name).write_text(text)
    (folder / "notes.txt").write_text("something else entirely\n")
    (folder / "list.csv").write_text("x,y\n")
    (folder / "scores.csv").write_text("set,probe,reference,genuine,similarity\na,1_1,2_1,0,0.5\n")
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


def damaged_batch(prints, folder):
    """Return prints and templates in files, and the names of those that are damaged."""
    folder.mkdir()
    template = extract(prints / "1_1.png")
    for k, suffix in enumerate((".json", ".csv", ".iso", ".ansi", ".png")):
        for number in (1, 2, 3, 4):
            path = folder / f"{number}_{k}{suffix}"
            if suffix == ".png":
                shutil.copy(prints / "1_1.png", path)
            else:  # no copies
                minutiae = template.minutiae.take(np.arange(k + 1, len(template.minutiae)))
                save_template(path, replace(template, minutiae=minutiae))
            whole = path.read_bytes()
            if number == 1:  # a CSV that is cut after a line is whole
                half = whole[: len(whole) // 2]
                path.write_bytes(half[: half.rfind(b",") + 1] or half)
            elif number == 2:
                path.write_bytes(np.random.default_rng(1).bytes(len(whole)))
            elif number == 3:
                path.write_bytes(b"<html>404</html>\n")
    files = sorted(folder.iterdir())
    return files, {file.name for file in files if file.name[0] != "4"}


@pytest.mark.parametrize(
    ("command", "status"),
    [
        ("inspect {files} --json", 1),
        ("extract {files} -o out --json", 2),
        ("enrol new.db {files} --workers 1 --json", 1),
        ("score --references {folder} --probes {folder} -o s.csv --workers 1 --json", 1),
    ],
)
def test_a_batch_is_done_to_the_end_and_exactly_the_damaged_files_are_named(
    run, prints, tmp_path, monkeypatch, command, status
):
    monkeypatch.chdir(tmp_path)
    files, damaged = damaged_batch(prints, tmp_path / "set")
    words = command.format(files=" ".join(map(str, files)), folder=tmp_path / "set")
    result = run(*words.split())
    assert result.exit_code == status, result.stderr
    lines = result.stderr.splitlines()
    if "inspect" not in command:
        lines = list(map(str, json.loads(result.stdout)["failures"]))
    named = {file.name for file in files if any(file.name in line for line in lines)}
    images = {name for name in damaged if name.endswith(".png")}
    assert named == (images if "{folder}" in command else damaged)
