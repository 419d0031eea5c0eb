"""Attacks by damage and chance: killed programs, damaged rows and files, lost machines."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import time
from typing import TYPE_CHECKING

from research.promises.attack import attack
from research.promises.program import SAMPLES, SQL_CHANGES, database, flipped, sound, templates

if TYPE_CHECKING:
    from research.promises.attack import Tries
    from research.promises.program import Place, Run


@attack("A killed program leaves nothing half-written")
def killed_enrolments(place: Place) -> Tries:
    """Kill enrolments and removals at random moments; check; complete them."""
    want, _ = place.search(place.gallery("whole.db"))
    new, less = place.folder / "new.db", place.gallery("less.db")
    enrolling = place.seconds("enrol", "other.db", SAMPLES)
    removing = place.seconds("gallery", "remove", "other.db", 1, 2)
    for k in range(1, 15, 2):
        place.kill(enrolling, "enrol", new, SAMPLES)
        place.kill(removing, "gallery", "remove", less, k, k + 1)
        for path in (new, less):
            if path.exists():
                run = place.run("gallery", "check", path)
                yield (run.status == 0 and sound(path) and "damaged" not in run.err) or str(run)
    place.done("enrol", new, SAMPLES)
    have, _ = place.search(new)
    ranked = [
        [(one["subject"], one["score"]) for one in result["probes"][0]["candidates"]]
        for result in (want, have)
    ]
    yield ranked[0] == ranked[1] or f"completed, it finds {ranked}"


@attack("One damaged row of a gallery is named")
def damaged_rows(place: Place) -> Tries:
    """Cut, overwrite and replace stored templates; search with and without prepared prints."""
    every, _ = place.search(place.gallery())
    for k in range(8):
        number = place.random.randrange(1, 17)
        gallery = place.gallery()
        good = templates(gallery)[number]
        place.done("gallery", "remove", gallery, number)
        without, _ = place.search(gallery)
        where, noise = place.random.randrange(len(good)), place.random.randbytes(len(good))
        bad = (good[:where], noise, "text", good[:where] + noise[where:])[k % 4]
        for prepared in (True, False):
            gallery = place.gallery()
            if not prepared:
                shutil.rmtree(f"{gallery}.prepared")
            with database(gallery) as opened:
                opened.execute("UPDATE fpmatch_entry SET template = ? WHERE id = ?", (bad, number))
            have, run = place.search(gallery)
            skipped = have["probes"] == without["probes"] and have["damaged"] == 1
            named = skipped and f"{number}" in run.err
            yield named or (prepared and have == every) or f"row {number}, damage {k % 4}: {run}"


@attack("A change of prepared prints is found")
def damaged_prepared(place: Place) -> Tries:
    """Flip bits, cut and overwrite prepared prints: the same candidates, and a note."""
    want, _ = place.search(place.gallery())
    for k in range(20):
        gallery = place.gallery()
        path = place.prepared(gallery)
        good = path.read_bytes()
        where = place.random.randrange(len(good) - 4096)
        noise = good[:where] + place.random.randbytes(4096) + good[where + 4096 :]
        bit = flipped(good, where, 1 << place.random.randrange(8))
        path.write_bytes((good[:where], noise, bit, bit, bit)[k % 5])
        have, run = place.search(gallery)
        yield (have == want and "note" in run.err) or f"changed from byte {where}: {run}"


@attack("An entry with another label, picture or template")
def exchanged_entries(place: Place) -> Tries:
    """Insert, remove, move and change entries by SQLite: an error, a note, or the same answer."""
    words = ("identify", place.gallery(), SAMPLES / "101_1.tif", "--json")
    want = _candidates(place.done(*words))
    for statement in SQL_CHANGES:
        for prepared in (True, False):
            gallery = place.gallery()
            if not prepared:
                shutil.rmtree(f"{gallery}.prepared")
            with database(gallery) as opened:
                opened.execute(statement)
            run = place.run(*words)
            said = "damaged" in run.err and "Traceback" not in run.err
            same = run.status == 0 and _candidates(run) == want
            yield said or same or f"{statement}: {run}"


def _candidates(run: Run) -> object:
    """Return the candidates of one probe."""
    return json.loads(run.out)["probes"][0]["candidates"]


@attack("Prepared prints and an index of another gallery")
def foreign_prepared(place: Place) -> Tries:
    """Put prepared prints of other galleries, under either name, in place of the right ones."""
    want, _ = place.search(place.gallery())
    for count in (4, 8, 12, 15):
        other = place.gallery("other.db")
        place.done("gallery", "remove", other, *range(count + 1, 17))
        place.search(other)
        theirs = max((place.folder / "other.db.prepared").iterdir(), key=os.path.getmtime)
        for rename in (True, False):
            gallery = place.gallery()
            mine, content = place.prepared(gallery), theirs.read_bytes()
            named = content.replace(theirs.name.encode(), mine.name.encode())
            mine.write_bytes(named if rename else content)
            have, run = place.search(gallery)
            yield have == want or f"prepared prints of {count} others: {run}"


@attack("A truncated or changed file of a synthetic database")
def synthetic_files(place: Place) -> Tries:
    """Cut, change and empty each file; the same command makes it again, or names it."""
    words = ("synth", "prints", "--fingers", 2, "--impressions", 2, "--workers", 1)
    place.done(*words)
    paths = sorted(path for path in (place.folder / "prints").rglob("*") if path.is_file())
    good = {path: path.read_bytes() for path in paths}
    for path, content in good.items():
        where = place.random.randrange(len(content))
        bad = (content[:where], flipped(content, where), b"")
        path.write_bytes(place.random.choice(bad))
        run = place.run(*words)
        same = all(one.exists() and one.read_bytes() == good[one] for one in paths)
        yield same or (run.status == 2 and path.name in run.err) or f"{path.name}: {run}"
        path.write_bytes(content)


@attack("A lost Dask scheduler is one line")
def lost_schedulers(place: Place) -> Tries:
    """Kill schedulers before, during and instead of work; complete the file without one."""
    words = ("score", "--references", SAMPLES, "--probes", SAMPLES, "-o")
    want = place.folder / "want.csv"
    place.done(*words, want)
    with socket.create_server(("127.0.0.1", 0)) as silent:  # accepts and never answers
        url = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        yield place.run(*words, "s.csv", "--scheduler", url, timeout_s=120).refused
    yield place.run(*words, "s.csv", "--scheduler", url, timeout_s=120).refused
    for seconds in (2.5, 5.0):
        file, out = place.folder / f"{seconds}.json", place.folder / f"{seconds}.csv"
        one = ("--no-dashboard", "--scheduler-file", file)
        scheduler = place.start(*one, "--port", 0, program=("-m", "distributed.cli.dask_scheduler"))
        worker = place.start(*one, "--nworkers", 1, program=("-m", "distributed.cli.dask_worker"))
        while not file.exists():
            time.sleep(0.1)
        running = place.start(
            *words, out, "--scheduler", file.read_text().split('"address": "')[1].split('"')[0]
        )
        time.sleep(seconds)
        for daemon in (scheduler, worker):
            os.killpg(daemon.pid, signal.SIGKILL)
            daemon.communicate()
        err = running.communicate(timeout=120)[1].decode()
        errors = [line for line in err.splitlines() if "error" in line or "Traceback" in line]
        yield (running.returncode, len(errors)) in ((0, 0), (2, 1)) or err[-300:]
        place.done(*words, out)
        yield out.read_bytes() == want.read_bytes() or "the file of scores is another"
