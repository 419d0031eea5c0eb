r"""Names of files that are not UTF-8 or contain control characters, in every command.

Each command of ``fpmatch`` has a case here; a new one without fails the first test.
"""

import csv
import io
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from fpmatch.cli.group import fpmatch as main
from fpmatch.printable import as_file_name, json_text, printable
from tests.conftest import leaves, rows_of

# Bytes that are not UTF-8, an escape sequence that clears the screen, an end of a line, a C1
# control, a formula, a right-to-left override, a tab, a blank.
HOSTILE = (
    b"101_\xff_1",
    b"\x1b[2J\x1b]0;owned\x07_2",
    b"line\nfpmatch: error: no_3",
    "\x9b31m\u202egpj\u2028_4".encode(),
    b"=1+1\t_5",
    b" _6",
    b"101_\xff_7",
)
SUBJECT = r"(?P<subject>.*)_(?P<impression>\d)"
CONTROLS = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028-\u202e\ud800-\udfff]")


def file_in(folder, name, suffix):
    return Path(os.fsdecode(os.fsencode(folder) + b"/" + name + suffix))


@pytest.fixture(scope="module")
def place(tmp_path_factory, prints):
    """Return a folder of a hostile name with prints, templates, points and lists of such names."""
    folder = file_in(tmp_path_factory.mktemp("names"), b"d\xff\x1b[2J\nx", b"")
    try:
        folder.mkdir()
        for k, name in enumerate(HOSTILE):
            source = ("1_1.png", "2_1.png", "1_2.png")[k % 3]
            shutil.copy(prints / source, file_in(folder, name, b".png"))
    except OSError:
        pytest.skip("this file system refuses such names")
    return folder


@pytest.fixture(scope="module")
def images(place):
    return sorted(place.glob("*.png"))


@pytest.fixture
def out(tmp_path):
    """Return a folder for results, of a hostile name."""
    folder = file_in(tmp_path, b"out\xfe\x1b[31m", b"")
    folder.mkdir()
    return folder


@pytest.fixture(scope="module")
def stored(place, images):
    """Return a gallery, templates, points and lists, all of hostile names, in `place`'s parent."""
    folder = file_in(place.parent, b"made\xff\n", b"")
    folder.mkdir()

    def run(*words):
        done = CliRunner().invoke(main, [*map(str, words)], prog_name="fpmatch")
        assert done.exit_code == 0, done.output
        return done

    gallery = file_in(folder, b"g\xff\x1b[2J", b".db")
    two = (file_in(place, name, b".png") for name in HOSTILE[:2])
    run("enrol", gallery, *two, "--pattern", SUBJECT, "--workers", 1)
    run("extract", *images, "-o", folder / "templates")
    scores = file_in(folder, b"s\xff\x1b", b".csv")
    run("score", "--references", place, "--probes", place, "-o", scores, "--workers", 1)
    points = file_in(folder, b"p\xff\x1b", b".csv")
    points.write_text("x,y\n" + "".join(f"{k * 7 % 13},{k * k % 17}\n" for k in range(12)))
    manifest = file_in(folder, b"m\xff\x1b", b".csv")
    with manifest.open("w", newline="") as stream:
        table = csv.writer(stream)
        table.writerow(["path", "subject"])
        for k, image in enumerate(images):
            table.writerow([printable(image), f"s{k}"])
    key = file_in(folder, b"k\xff\x1b", b"")
    run("key", key, "--new")
    template = min((folder / "templates").glob("*.json"))
    return {
        **{"gallery": gallery, "key": key, "template": template},
        **{"scores": scores, "points": points, "manifest": manifest},
    }


# What each command is run with: names of fixtures and of files in `out`; expected exit status,
# None for 0 or 1.
CASES = {
    "verify": [
        ("{0} {1} --overlay {out}/o.png --case-report {out}/c.html", None),
        ("{template} {1} --json --overlay {out}/o.svg --view side-by-side", None),
        ("--gallery {gallery} --subject {subject} {0} --json", None),
        ("--gallery {gallery} --subject {missing} {0}", 2),
        ("{missing} {1}", 2),
        ("{0} {1} --calibration {missing}", 2),
        ("{0} {1} --{missing}", 2),
        ("{0} {1} --overlay {0}/{missing}/x.png", 2),
    ],
    "explain": [("{0} {1} -o {out}/e", 0), ("{points} {points} -o {out}/e", 0)],
    "extract": [
        ("{all} -o {out}/t --json", 0),
        ("{0} -o {out}/t --format stages", 0),
        ("--gallery {gallery} -o {out}/e --format iso2005 --subject {subject}", 0),
    ],
    "convert": [("{template} {out}/t.iso", 0), ("{0} {out}/t.xyt", 0)],
    "inspect": [("{all} {template}", 0), ("{missing} {0} {scores} --json", 1)],
    "enrol": [
        ("{out}/new.db {dir} --pattern {pattern} --workers 1", 1),
        ("{out}/new.db {manifest} --workers 1 --json", 1),
        ("{out}/new.db {dir}/.. --workers 1 --json", None),
    ],
    "identify": [
        ("{gallery} {dir} --workers 1 --json", 0),
        ("{gallery} {manifest} --workers 1", 0),
        ("{gallery} --probes {dir} -o {out}/c.csv --workers 1", 0),
    ],
    "gallery list": [
        ("{gallery} --summary --json", 0),
        ("{gallery} --subject {subject}", 0),
        ("{gallery} --failures --json", 0),
    ],
    "gallery check": [("{gallery}", None), ("{gallery} --json", None)],
    "gallery remove": [("{copy} --subject {subject}", 0), ("{copy} --subject {missing}", 2)],
    "gallery rewrite": [("{copy}", 0), ("{copy} --encrypt --key file:{key} --json", 0)],
    "gallery audit show": [("{missing}", 2), ("{scores}", 2)],
    "gallery audit verify": [("{missing}", 2), ("{scores}", 2)],
    "gallery audit switch": [("{missing} on", 2), ("{scores} on", 2)],
    "score": [
        ("--references {dir} --probes {dir} -o {out}/s.csv --workers 1", 0),
        ("--references {manifest} --probes {manifest} -o {out}/s.csv --workers 1", 0),
        ("--references {gallery} --probes {dir} -o {out}/s.csv", 0),
    ],
    "serve": [("--settings {missing}", 2), ("--gallery {scores}", 2)],
    "evaluate": [
        ("{dir} --pattern {pattern} --report {out}/r --scores {out}/s.csv --bootstrap 0", 0),
        ("{manifest} --workers 1 --json --bootstrap 0", 0),
    ],
    "rates": [("{own} --json --report {out}/r --bootstrap 0", 0), ("{missing}", 2)],
    "synth": [("{out}/synth --fingers 1 --impressions 1 --workers 1 --json", 0)],
    "calibrate": [("{scores} -o {out}/c.json", 2)],
    "points": [("{points} {points} --plot {out}/p.svg --pairs {out}/p.csv --json", 0)],
    "key": [("{out}/{missing} --new --json", 0)],
    "doctor": [("--json", None), ("{missing}", 2)],
}


def test_every_command_has_a_case():
    assert set(CASES) == set(leaves(main))


@pytest.mark.parametrize(
    ("command", "words", "expected"),
    [
        pytest.param(command, *case, marks=() if k else pytest.mark.smoke)
        for command, cases in CASES.items()
        for k, case in enumerate(cases)  # the first of each command is a `smoke` test
    ],
)
def test_hostile_names_go_through(command, words, expected, run, place, images, stored, out):
    missing = "no\udcff\x1b[2J\nsuch"
    copy = out / "copy.db"
    shutil.copy(stored["gallery"], copy)
    own = out / "own.csv"
    if "{own}" in words:
        run("evaluate", place, "--pattern", SUBJECT, "--workers", 1, "--scores", own)
    values = {
        **stored,
        **{"dir": place, "out": out, "copy": copy, "own": own},
        **{"missing": missing, "subject": "101_\udcff", "pattern": SUBJECT},
    }
    given = []
    for word in words.split():
        given += map(str, images) if word == "{all}" else [word.format(*images, **values)]
    done = run(*command.split(), *given)
    assert done.exit_code in ({0, 1} if expected is None else {expected}), done.output
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    for text in (done.stdout, done.stderr):
        assert not CONTROLS.search(text), text
    if done.exit_code == 2 and command != "extract":
        lines = done.stderr.splitlines()
        assert len([line for line in lines if "error" in line.lower()]) == 1, lines
    if "--json" in given and done.exit_code < 2:
        json_text(json.loads(done.stdout)).encode("ascii")
    for made in out.rglob("*"):
        if made.suffix in {".json", ".html", ".svg"}:
            assert not CONTROLS.search(made.read_text(encoding="utf-8")), made
        if made.suffix == ".csv":
            rows = csv.reader(io.StringIO(made.read_text(encoding="utf-8"), newline=""))
            cells = [cell for row in rows for cell in row]
            assert not any(map(CONTROLS.search, cells)), made
            assert not any(cell.startswith(("=", "@")) for cell in cells), made


def test_names_are_the_same_in_every_form(run, images, stored):
    """A row of a file of scores leads back to its file, by the list of pairs and by Python."""
    names = {row["probe"] for row in rows_of(stored["scores"])}
    assert {as_file_name(name) for name in names} == {image.name for image in images}
    listed = json.loads(run("gallery", "list", stored["gallery"], "--json").stdout)
    assert [Path(as_file_name(one["source"])).name for one in listed] == [
        os.fsdecode(name + b".png") for name in HOSTILE[:2]
    ]


def test_a_stream_that_cannot_show_a_name_stops_nothing(place, images):
    done = subprocess.run(
        [sys.executable, "-m", "fpmatch", "inspect", *images, file_in(place, b"\xc3\xa9", b"")],
        capture_output=True,
        env={**os.environ, "PYTHONIOENCODING": "ascii:strict"},
        timeout=60,
        check=False,
    )
    assert done.returncode == 1, done.stderr
    assert len(done.stdout.splitlines()) == len(images)
    assert rb"101_\xff_1.png" in done.stdout
    assert done.stderr.count(b"fpmatch: error:") == 1
