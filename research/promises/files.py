"""Attacks by files of unknown origin: pictures, templates, tables, names and labels."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from research.promises.attack import attack
from research.promises.mutants import (
    bombs,
    giants,
    mutants,
    pictures,
    template_files,
    write_mutants,
)
from research.promises.program import PROBE, REFERENCE, SAMPLES
from research.promises.reader import judge, read_files

if TYPE_CHECKING:
    from collections.abc import Iterator

    from research.promises.attack import Tries
    from research.promises.program import Place, Words

NASTY: Final = "\x1b[31m\x1b]0;owned\x07\x9b2J\u202egnp\u2028"
_FORMULAS: Final = ("=cmd|' -C calc'!A0", "+1+1", "-1+1", "@SUM(1)", "\t=1+1", "\r=1", "＝1+1")
_MARKUP: Final = "<script>alert(1)<∕script><img src=x onerror=alert(1)>\"'><svg onload=alert(1)>"
_ACTING: Final = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\u2028]")


@attack("A damaged or hostile picture raises one error")
def damaged_pictures(place: Place) -> Tries:
    """Read damaged pictures of 13 formats by `read_image`, and watch what the process does."""
    yield from map(judge, read_files(place, "image", write_mutants(place, pictures(place), 40)))


@attack("A truncated picture is never read")
def truncated_pictures(place: Place) -> Tries:
    """Cut pictures of 13 formats: refused, or read with a note, or with all pixels."""
    good = pictures(place)
    whole = [place.folder / f"good.{name}" for name in good]
    pixels = {one["text"] for one in read_files(place, "image", whole)}
    for one in read_files(place, "image", write_mutants(place, good, 25, cut=True)):
        silent = one["kind"] == "read" and not one["notes"] and one["text"] not in pixels
        yield f"read in silence: {one}" if silent else judge(one)


@attack("Size of a file and number of pixels are bounded")
def giant_files(place: Place) -> Tries:
    """Read files that state sides of 60,000 pixels, or have 3 GB: no time, at most 300 MB."""
    files = {**giants(), "long.json": b" " * 17_000_000, "long.xyt": b"1 1 1\n" * 20_000}
    paths = [place.write(name, content) for name, content in files.items()]
    paths.append(Path(shutil.copy(PROBE, place.folder / "long.tif")))
    os.truncate(paths[-1], 3_000_000_000)
    for kind in ("image", "template"):
        for one in read_files(place, kind, paths):
            soon = one["kind"] == "refused" and one["seconds"] < 4 and one["grown"] < 300
            yield soon or json.dumps(one)
    for size in ("1x3000000000", "60000x50000"):
        yield place.run("inspect", paths[-1], "--raw", size).refused


@attack("Whatever bytes a reader is given")
def damaged_files(place: Place) -> Tries:
    """Read damaged templates of 15 formats, tables, scores, keys, logs and galleries."""
    damaged = write_mutants(place, template_files(place), 60)
    yield from map(judge, read_files(place, "template", damaged))
    place.gallery(kind="audited")
    scores = (f"{k % 2},{k % 97 / 97}\n" for k in range(3000))
    place.write("scores.csv", f"genuine,similarity\n{''.join(scores)}")
    place.done("calibrate", "scores.csv", "-o", "calibration.json")
    place.write("audit.jsonl", place.done("gallery", "audit", "show", "plain.db", "--lines").out)
    place.write("server.toml", '[a]\nrole = "read"\ntoken = "12345678901234567890"\n')
    sides: Words = ("--references", SAMPLES, "--probes", SAMPLES, "-o", "out.csv")
    commands: dict[str, Words] = {
        "manifest.csv": ("enrol", "new.db"),
        "pairs.txt": ("score", *sides, "--pairs"),
        "scores.csv": ("rates",),
        "calibration.json": ("verify", PROBE, REFERENCE, "--calibration"),
        "keys.txt": ("key",),
        "audit.jsonl": ("gallery", "audit", "verify"),
        "server.toml": ("serve", "--port", 99999, "--settings"),
        "plain.db": ("verify", PROBE, "--subject", 101, "--gallery"),
        "stars.csv": ("points", SAMPLES / "catalogue.csv"),
    }
    for name, words in commands.items():
        source = place.folder / name
        good = (source if source.exists() else SAMPLES / name).read_bytes()
        for content in mutants(good, place.random, 4):
            yield place.run(*words, place.write(name, content)).read_or_refused


@attack("Few bytes that would take long to decode")
def small_bombs(place: Place) -> Tries:
    """Read files of few bytes with many pixels, scans, strips, digits, brackets, or much text."""
    paths = [place.write(name, content) for name, content in bombs().items()]
    for kind in ("image", "template"):
        yield from map(judge, read_files(place, kind, paths))


@attack("No file makes fpmatch start another program")
def other_programs(place: Place) -> Tries:
    """Read pictures and names that start programs elsewhere, with such programs in the path."""
    tools, mark = place.folder / "tools", place.folder / "mark"
    tools.mkdir()
    for name in ("gs", "gswin32c", "convert", "magick", "djpeg", "ppm2tiff", "dcraw", "sh", "file"):
        place.write(f"tools/{name}", f"#!/bin/bash\necho {name} >> {mark}\n").chmod(0o700)
    eps = f"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 300 300\n(%pipe%touch {mark}) (w) file\n"
    svg = f'<svg xmlns="http://www.w3.org/2000/svg"><image href="|touch {mark}"/></svg>'
    mvg = f"push graphic-context\nimage over 0,0 9,9 '|touch {mark}'\n"
    wmf = b"\xd7\xcd\xc6\x9a" + bytes(6) + b"\x90\x01\x90\x01\x60" + bytes(99)
    env = {"PATH": f"{tools}:{os.environ['PATH']}"}
    for name in ("a.tif", "a.eps", f"|touch {mark.name}", f"$(touch {mark.name}).png", "-o"):
        for content in (eps, svg, mvg, wmf):
            place.write(name, content)
            run = place.run("verify", "--", name, PROBE, env=env)
            yield run.refused if not mark.exists() else f"{run} started {mark.read_text()}"


def extreme_templates(place: Place) -> Iterator[str]:
    """Return templates of which one number each is extreme, as JSON."""
    place.done("extract", PROBE, "-o", ".", "--format", "json")
    text = (place.folder / "101_1.json").read_text()
    values: Words = (1e308, 3e38, 2**63, -(2**31), 32768, -1, 0, 0.5, 1e-308, None, "1", [])
    for holder in ("", "minutiae", "ridge_field"):
        for name in json.loads(text)[holder] if holder else json.loads(text):
            for value in values:
                document = json.loads(text)
                within = document[holder] if holder else document
                many = isinstance(within[name], list) and not isinstance(value, list)
                within[name] = [value, *within[name][1:]] if many else value
                yield json.dumps(document)
        yield re.sub(r"\d+\.\d+", "NaN", text, count=1)


@attack("Every number of a template has bounds")
def extreme_numbers(place: Place) -> Tries:
    """Read templates with an extreme number each, enrol those that are read, search for all."""
    paths = [place.write(f"{k}_1.json", text) for k, text in enumerate(extreme_templates(place))]
    results = list(read_files(place, "template", paths))
    yield from map(judge, results)
    read = [one["file"] for one in results if one["kind"] == "read"]
    run = place.done("enrol", "new.db", *read)
    yield place.run("identify", "new.db", PROBE).kept
    place.done("score", "--references", "new.db", "--probes", "new.db", "-o", "scores.csv")
    with (place.folder / "scores.csv").open(newline="") as file:
        yield from (row["similarity"] != "" or f"{row} of {run}" for row in csv.DictReader(file))


@attack("Bad input to a command is one line")
def bad_input(place: Place) -> Tries:
    """Give each command files that are none of its own, and numbers that are none."""
    gallery = place.gallery()
    (place.folder / "folder").mkdir()
    os.mkfifo(place.folder / "pipe")
    files = {
        "empty": b"",
        "noise": place.random.randbytes(3000),
        "nul": b"\0" * 99,
        "text": b"a,b\n1,2",
    }
    inputs = [place.write(name, content) for name, content in files.items()]
    inputs += [place.folder / "folder", place.folder / "none", Path("/dev/zero"), Path("a" * 300)]
    commands: dict[str, Words] = {
        **dict.fromkeys(
            ("inspect", "gallery check", "gallery rewrite", "gallery list --summary"), ()
        ),
        **dict.fromkeys(("verify", "gallery audit verify --expect"), (REFERENCE,)),
        **dict.fromkeys(("extract", "extract --format stages", "extract --gallery"), ("-o", "out")),
        **dict.fromkeys(("identify", "gallery rewrite --encrypt"), ("--", PROBE)),
        **dict.fromkeys(("points", "rates", "evaluate"), ()),
        "convert": ("out.iso",),
    }
    for command, rest in commands.items():
        waits = command.startswith(("points", "rates"))  # as a shell's <(...) needs it
        pipe = [] if waits else [place.folder / "pipe"]
        for name in (*place.random.sample(inputs, 3), *pipe):
            yield place.run(*command.split(), name, *rest, timeout_s=9).refused
    pair: Words = ("verify", PROBE, REFERENCE)
    options: dict[str, Words] = {
        **dict.fromkeys(("--dpi", "--fmr", "--threshold"), pair),
        **dict.fromkeys(("--loss", "-k"), ("identify", gallery, PROBE)),
        "--tolerance": ("points", SAMPLES / "stars.csv", SAMPLES / "catalogue.csv"),
        "--size": ("convert", PROBE, "out.iso"),
        "--min-quality": ("enrol", gallery, PROBE),
    }
    for option, words in options.items():
        for number in place.random.sample(("nan", "-inf", "-1", "1e999", "", "0x10", "1,5"), 2):
            yield place.run(*words, option, number).refused


class _Markup(HTMLParser):
    """Count the elements of a page that a name brought."""

    acts = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Count what would run."""
        self.acts += any(name.startswith("on") or value == "x" for name, value in attrs)

    def handle_data(self, data: str) -> None:
        """Count scripts of the name."""
        self.acts += data.startswith("alert(1)")


@attack("No name, label or tag acts on a terminal")
def acting_names(place: Place) -> Tries:
    """Put escapes, formulas and markup into names and labels; search all output, tables, pages."""
    prints = sorted(SAMPLES.glob("10?_?.tif"))
    labels = (NASTY, *_FORMULAS, _MARKUP, "a\nb", "\x7f")
    names = [f"{label}.tif" for label in labels]
    for name, source in zip(names, prints, strict=False):
        shutil.copy(source, place.folder / name)
    with (place.folder / "labels.csv").open("w", newline="", encoding="utf-8") as file:
        rows = [(path, label, label) for path, label in zip(prints[::-1], labels, strict=False)]
        csv.writer(file).writerows([("path", "subject", "finger"), *rows])
    subject = ("--pattern", "(?P<subject>.+)")
    notes = ("--case-number", _MARKUP[:60], "--notes", _MARKUP)
    commands: tuple[Words, ...] = (
        ("enrol", "new.db", "labels.csv"),
        ("enrol", "new.db", "--", *(f"./{name}" for name in names)),
        ("enrol", "new.db", *subject, "--", *(f"./{name}" for name in names)),
        ("verify", names[0], names[8], "--case-report", "report.html", *notes),
        ("verify", names[8], NASTY),
        ("verify", names[0], names[8], "--overlay", "overlay.svg", "--view", "side-by-side"),
        ("inspect", *(f"./{name}" for name in names), "--json"),
        ("inspect", *(f"./{name}" for name in names)),
        ("identify", "new.db", names[0], "--all"),
        ("identify", "new.db", "--probes", ".", "-o", "candidates.csv"),
        ("gallery", "list", "new.db"),
        ("gallery", "list", "new.db", "--failures"),
        ("gallery", "list", "new.db", "--subject", NASTY),
        ("extract", "--gallery", "new.db", "-o", "out"),
        ("score", "--references", ".", "--probes", "new.db", "-o", "s.csv", "--fingers", "f.csv"),
        ("evaluate", ".", *subject, "--report", "report"),
        ("verify", names[0], names[8], "--matcher", NASTY),
        (NASTY,),
    )
    for words in commands:
        run = place.run(*words)
        yield not _ACTING.search(run.out + run.err) or f"{words[:2]}: {run.out + run.err!r}"
    for path in set(place.folder.rglob("*.csv")) - {place.folder / "labels.csv"}:
        for row in csv.reader(path.open(newline="", encoding="utf-8")):
            for cell in row:
                formula = re.match(r"\s*[=+@＝＋＠\t\r]|-(?![\d.]+(e-?\d+)?$)", cell)
                yield not formula or f"{path.name}: {cell!r}"
    for path in (*place.folder.rglob("*.html"), *place.folder.rglob("*.svg")):
        page = _Markup()
        page.feed(path.read_text("utf-8"))
        yield page.acts == 0 or f"{path.name} has {page.acts} elements of a name"


@attack("Names that are not UTF-8")
def strange_names(place: Place) -> Tries:
    """Give commands files whose names are arbitrary bytes, in three locales and encodings."""
    gallery = place.gallery()
    for name in (b"\xff\xfe_1.tif", b"\x80\x1b[2J.tif", b"a\nb\r.tif", "ñ\U0001f600.tif".encode()):
        path = Path(os.fsdecode(os.fsencode(place.folder) + b"/" + name))
        path.write_bytes(PROBE.read_bytes() + name)
        for words in (
            ("verify", path, REFERENCE),
            ("inspect", path),
            ("extract", path, "-o", "stages", "--format", "stages"),
            ("identify", gallery, path),
            ("enrol", "new.db", path, "--pattern", "(?P<subject>[^/]+)"),
            ("verify", path, REFERENCE, "--overlay", "overlay.png"),
        ):
            env = {"LC_ALL": place.random.choice(("C", "C.UTF-8", "POSIX"))}
            env["PYTHONIOENCODING"] = place.random.choice(("ascii", "utf-8", "latin-1"))
            yield place.run(*words, env=env).kept


@attack("Matching of points takes bounded work")
def arrangements(place: Place) -> Tries:
    """Match 3,000 points, or minutiae, in rings, grids, lines, heaps and powers within 30 s."""
    turn, grid = np.linspace(0, 60, 3000), np.stack(np.divmod(np.arange(3000), 55), 1) * 1.0
    sets = {
        "grid": grid,
        "hexagons": grid @ [[1, 0], [0.5, 0.866]],
        "circle": np.stack([np.cos(turn), np.sin(turn)], 1),
        "line": np.stack([turn, turn], 1),
        "one": np.ones((3000, 2)),
        "heaps": grid // 9 + 1e-6 * grid,
        "powers": np.stack([1.2 ** (turn * 10), turn], 1),
        "large": grid * 1e300,
        "small": grid * 1e-300,
    }
    for name, points in sets.items():
        np.savetxt(place.folder / f"{name}.csv", points, delimiter=",")
    for name in sets:
        for other in (name, place.random.choice(list(sets))):
            run = place.run("points", f"{name}.csv", f"{other}.csv", timeout_s=30)
            yield run.read_or_refused
    for spacing in (3, 9, 20):
        rows = (f"{spacing * (k % 60)},{spacing * (k // 60)},0" for k in range(3000))
        path = place.write("lattice.csv", "\n".join(["x,y,theta", *rows]))
        yield place.run("verify", path, path, timeout_s=30).read_or_refused


@attack("No matcher or format is imported from the folder")
def modules_in_folder(place: Place) -> Tries:
    """Run commands and workers where modules and plug-ins lie that leave a mark."""
    gallery, mark = place.gallery(), place.folder / "mark"
    (place.folder / "bin").mkdir()
    code = "import sys; from fpmatch.cli import main; sys.exit(main())"
    program = place.write("bin/fpmatch", code)
    evil = f"open({str(mark)!r}, 'a').write(__name__ + ' ')\nMATCHER = CODEC = object()\n"
    for name in ("evil", "numpy", "PIL", "cv2", "click", "sitecustomize", "json", "fpmatch"):
        place.write(f"{name}.py", evil)
    (place.folder / "evil-1.dist-info").mkdir()
    place.write("evil-1.dist-info/METADATA", "Metadata-Version: 2.1\nName: evil\nVersion: 1\n")
    kinds = ("fpmatch.matchers", "fpmatch.formats", "fpmatch.commands")
    points = "".join(f"[{kind}]\nevil = evil:MATCHER\n" for kind in kinds)
    place.write("evil-1.dist-info/entry_points.txt", points)
    for words in (
        ("verify", PROBE, REFERENCE),
        ("verify", PROBE, REFERENCE, "--matcher", "evil"),
        ("verify", PROBE, REFERENCE, "--matcher", "evil:MATCHER"),
        ("convert", PROBE, "out", "--format", "evil"),
        ("enrol", "new.db", SAMPLES, "--workers", 2),
        ("identify", gallery, "--probes", SAMPLES, "-o", "out.csv", "--workers", 2),
        ("serve", "--gallery", gallery, "--port", 99999),
        ("doctor",),
    ):
        place.run(*words, program=(program,))
        yield not mark.exists() or f"{words[0]} imported {mark.read_text()}"
