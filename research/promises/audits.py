"""Attacks on audits, by bad dependencies, and on revocable templates."""

from __future__ import annotations

import base64
import json
import re
import shutil
import tomllib
from contextlib import suppress
from hashlib import sha256
from sqlite3 import DatabaseError
from typing import TYPE_CHECKING, Final

import numpy as np

from research.commands import ROOT
from research.promises.attack import attack
from research.promises.program import (
    PROBE,
    REFERENCE,
    SAMPLES,
    SQL_CHANGES,
    database,
    templates,
    traces,
)
from research.promises.web import served

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from research.promises.attack import Tries
    from research.promises.program import Place, Words

_FULL: Final = (
    "CREATE TRIGGER full BEFORE INSERT ON fpmatch_audit BEGIN SELECT RAISE(ABORT, 'full'); END"
)
_TOKEN: Final = "0123456789abcdef0123"
_COMMANDS: Final[dict[str, Words]] = {
    "identify": ("identify", "plain.db", PROBE),
    "verify": ("verify", "--gallery", "plain.db", "--subject", "101", PROBE),
    "list": ("gallery", "list", "plain.db"),
    "check": ("gallery", "check", "plain.db"),
    "export": ("extract", "--gallery", "plain.db", "-o", "out"),
    "read templates": ("score", "--references", "plain.db", "--probes", SAMPLES, "-o", "s.csv"),
    "enrol": ("enrol", "plain.db", "201_1.tif"),
    "remove": ("gallery", "remove", "plain.db", 5),
    "compact": ("gallery", "rewrite", "plain.db"),
    "rotate keys": ("gallery", "rewrite", "--encrypt", "plain.db"),
}


def _audited(place: Place) -> Path:
    """Return an audited gallery, and write a print that it does not have."""
    place.write("201_1.tif", PROBE.read_bytes() + b"\0")
    return place.gallery(kind="audited")


def _lines(gallery: Path) -> list[str]:
    with database(gallery) as opened:
        rows = opened.execute("SELECT line FROM fpmatch_audit ORDER BY number").fetchall()
    return [line for (line,) in rows]


@attack("Every change, search, comparison, listing and export")
def events_of_commands(place: Place) -> Tries:
    """Run ten commands with room for events, and without: then nothing is done or shown."""
    gallery = _audited(place)
    with database(gallery) as opened:
        opened.execute(_FULL)
    before, files = templates(gallery), {*place.folder.iterdir(), place.folder / "s.csv.unfinished"}
    for words in _COMMANDS.values():
        run = place.run(*words)
        nothing = (
            templates(gallery) == before and not run.out and files >= {*place.folder.iterdir()}
        )
        yield run.refused if nothing else f"done without an event: {run}"
    with database(gallery) as opened:
        opened.execute("DROP TRIGGER full")
    for action, words in _COMMANDS.items():
        count = len(_lines(gallery))
        run = place.run(*words)
        actions = [json.loads(line)["action"] for line in _lines(gallery)[count:]]
        yield (action in actions and run.status < 2) or f"{run}: {actions}"


@attack("An answer of the server is sent only when its event is stored")
def events_of_answers(place: Place) -> Tries:
    """Send requests where the audit of the gallery takes no event, or the log is on a full disk."""
    gallery, sent = _audited(place), {"authorization": f"Bearer {_TOKEN}"}
    asked = ["POST /identify", "GET /gallery/prints?subject=102", "POST /gallery/2/compare"]
    asked += ["POST /gallery/verify", "POST /enrol", "DELETE /gallery/16"]
    for log in ((), ("--audit-log", "/dev/full")):
        with served(place, *log, "--token", _TOKEN) as web:
            with database(gallery) as opened:
                opened.execute("DROP TRIGGER full" if log else _FULL)
            for what in (*asked, *(["POST /verify", "POST /compare"] if log else [])):
                before = templates(gallery)
                answer = web.ask(what, headers=sent)
                nothing = templates(gallery) == before and answer.status in (500, 503)
                yield nothing or f"{what} {log}: {answer}"


def _verify(place: Place, what: str, *words: object) -> bool | str:
    """Return whether an attack on an audit is noticed."""
    run = place.run("gallery", "audit", "verify", *words)
    noticed = run.status == 2 and "Traceback" not in run.err
    return noticed or f"{what} is not noticed: {run}: {run.out}"


def _unlocked(place: Place) -> tuple[Path, list[str]]:
    """Return a gallery with some events, whose triggers are removed, and its lines."""
    gallery = _audited(place)
    for action in ("identify", "list", "remove", "check", "verify"):
        place.done(*_COMMANDS[action])
    with database(gallery) as opened:
        for kind in ("update", "delete", "insert"):
            opened.execute(f"DROP TRIGGER fpmatch_audit_{kind}")
    return gallery, _lines(gallery)


def _write(place: Place, gallery: Path, lines: Sequence[str]) -> Path:
    """Put other events into a gallery, and into a file; return the file."""
    with database(gallery) as opened:
        opened.execute("DELETE FROM fpmatch_audit")
        opened.executemany("INSERT INTO fpmatch_audit VALUES (?, ?)", list(enumerate(lines, 1)))
    return place.write("lines.jsonl", "\n".join([*lines, ""]))


@attack("An event that was changed, removed or inserted")
def changed_events(place: Place) -> Tries:
    """Change, remove, repeat and exchange events in a gallery, and in a file of its lines."""
    gallery, lines = _unlocked(place)
    for k in range(10):
        where, changed = place.random.randrange(len(lines) - 1), list(lines)
        old = changed[where]
        letter = place.random.randrange(len(old))
        match k % 4:
            case 0:
                changed[where] = old[:letter] + chr(ord(old[letter]) ^ 1) + old[letter + 1 :]
            case 1:
                del changed[where]
            case 2:
                changed.insert(where, old)
            case _:
                changed[where : where + 2] = reversed(changed[where : where + 2])
        for audit in (gallery, _write(place, gallery, changed)):
            yield _verify(place, f"change {k % 4} of event {where}", audit)


@attack("The database refuses to change events")
def refused_changes(place: Place) -> Tries:
    """Execute statements of SQL that change, replace or remove events."""
    gallery = _audited(place)
    before = _lines(gallery)
    for statement in (
        "UPDATE fpmatch_audit SET line = '{}'",
        "UPDATE fpmatch_audit SET number = number + 1",
        "UPDATE OR REPLACE fpmatch_audit SET number = 1 WHERE number = 2",
        "UPDATE OR IGNORE fpmatch_audit SET rowid = 99 WHERE number = 1",
        "DELETE FROM fpmatch_audit",
        "REPLACE INTO fpmatch_audit VALUES (1, '{}')",
        "INSERT INTO fpmatch_audit VALUES (1, '{}') ON CONFLICT DO UPDATE SET line = '{}'",
        "INSERT INTO fpmatch_audit VALUES (-9, '{}')",
        "REPLACE INTO fpmatch_audit SELECT number, '{}' FROM fpmatch_audit",
        "PRAGMA recursive_triggers = 0; REPLACE INTO fpmatch_audit VALUES (1, '{}')",
        "PRAGMA ignore_check_constraints = 1; UPDATE fpmatch_audit SET line = NULL",
    ):
        with suppress(DatabaseError), database(gallery) as opened:
            opened.executescript(statement)
        yield _lines(gallery) == before or statement


@attack("A state that was noted elsewhere")
def forged_chains(place: Place) -> Tries:
    """Cut the end off, and write the chain anew with right hashes; compare with a noted state."""
    gallery, lines = _unlocked(place)
    printed = json.loads(place.done("gallery", "audit", "verify", gallery, "--json").out)
    noted = ("--expect", f"{printed['events']}:{printed['last']}")
    yield place.run("gallery", "audit", "verify", gallery, *noted).kept
    for k in range(8):
        forged: list[str] = []
        changed = place.random.randrange(len(lines))
        for number, event in enumerate(map(json.loads, lines)):
            previous = sha256(f"{forged[-1]}\n".encode()).hexdigest() if forged else "0" * 64
            client = {"client": "mallory"} if number == changed else {}
            forged.append(json.dumps({**event, **client, "previous": previous}))
        file = _write(place, gallery, lines[:changed] if k % 2 else forged)
        for audit in (gallery, file):
            yield _verify(place, f"forgery {k}", audit, *noted)


@attack("A change by a program that knows no audit")
def unaudited_changes(place: Place) -> Tries:
    """Insert, remove, move and change entries by SQLite."""
    for statement in SQL_CHANGES:
        gallery = place.gallery(kind="audited")
        with database(gallery) as opened:
            opened.execute(statement)
        yield _verify(place, statement, gallery)


@attack("A crash within a line stops no later event")
def cut_logs(place: Place) -> Tries:
    """Cut the log of a server within its last line; start the server again."""
    log, count = place.folder / "audit.jsonl", 0
    for k in range(4):
        with served(place, "--audit-log", log) as web:
            answer = web.ask("POST /identify")
            yield answer.status == 200 or str(answer)
        lines = log.read_bytes().splitlines()
        run = place.run("gallery", "audit", "verify", log)
        named = k == 0 or f"line {count}" in run.out + run.err
        yield (named and len(lines) > count and "Traceback" not in run.err) or f"{run} {run.out}"
        count = len(lines)
        log.write_bytes(log.read_bytes()[: -place.random.randrange(2, len(lines[-1]))])


@attack("No event contains a template, a picture or a score")
def told_by_events(place: Place) -> Tries:
    """Look in the events of commands and of a server for scores, templates and pictures."""
    gallery = _audited(place)
    secrets = [*templates(gallery).values(), *(path.read_bytes() for path in SAMPLES.glob("*.tif"))]
    codes = [base64.b64encode(one[k:])[:40] for one in secrets for k in (0, 1, 2)]
    candidates = place.search(gallery)[0]["probes"][0]["candidates"]
    for words in _COMMANDS.values():
        place.run(*words)
    with served(place, "--audit-log", "audit.jsonl") as web:
        candidates += json.loads(web.ask("POST /identify").body)["candidates"]
        web.ask("POST /compare")
    texts = [*_lines(gallery), *(place.folder / "audit.jsonl").read_text().splitlines()]
    (place.folder / "events").mkdir()
    yield traces(secrets, place.write("events/all", "".join(texts)).parent, 12) == 0 or "bytes"
    for text in texts:
        told = any(f"{one['score']:.4f}"[:-1] in text for one in candidates)
        yield not (told or any(code in text.encode() for code in codes)) or text


@attack("What the container installs is pinned by hash")
def unpinned_requirements(place: Place) -> Tries:
    """Read each requirement of the lock file: one version, and a hash."""
    text = (ROOT / "packaging" / "requirements.lock").read_text().replace("\\\n", " ")
    pin = re.compile(r"[\w.\[\]-]+==\S+ .*--hash=sha256:[0-9a-f]{64}")
    for line in filter(None, (line.partition("#")[0].strip() for line in text.splitlines())):
        yield line.startswith("--") or bool(pin.match(line)) or line


@attack("A comparison connects to no other computer")
def connections(place: Place) -> Tries:
    """Run commands and their workers under a guard of sockets, and without a network."""
    _audited(place)
    mark = place.folder / "mark"
    (place.folder / "guard").mkdir()
    place.write(
        "guard/sitecustomize.py",
        "import socket, sys\ndef hook(event, details):\n"
        "    local = event != 'socket.getaddrinfo' and details[0].family == socket.AF_UNIX\n"
        f"    if not local: open({str(mark)!r}, 'a').write(f'{{event}} {{details}}')\n"
        "names = ('socket.connect', 'socket.getaddrinfo', 'socket.sendto')\n"
        "sys.addaudithook(lambda event, args: hook(event, args) if event in names else None)\n",
    )
    alone = ("unshare", "-rn") if shutil.which("unshare") else ()
    commands = [_COMMANDS[action] for action in ("identify", "verify", "read templates", "enrol")]
    pair: Words = (PROBE, REFERENCE)
    for words in (("verify", *pair), ("verify", *pair, "--overlay", "overlay.svg"), *commands):
        run = place.run(*words, env={"PYTHONPATH": f"{place.folder / 'guard'}:{ROOT}"})
        yield f"{run} {mark.read_text()}" if mark.exists() else run.kept
        yield place.run(*words, before=alone).kept


def _protected(place: Place, *keys: str) -> tuple[dict[str, str], list[list[bytes]]]:
    """Return the environment of revocable templates, and the prints' templates by key."""
    source, info = ROOT / "examples" / "revocable", place.folder / "revocable-1.dist-info"
    info.mkdir()
    project = tomllib.loads((source / "pyproject.toml").read_text())["project"]
    place.write(f"{info.name}/METADATA", "Metadata-Version: 2.1\nName: revocable\nVersion: 1\n")
    groups = {
        group: [f"{name} = {value}" for name, value in points.items()]
        for group, points in project["entry-points"].items()
    }
    text = "\n".join(f"[{group}]\n" + "\n".join(points) for group, points in groups.items())
    place.write(f"{info.name}/entry_points.txt", text)
    env, contents = {"PYTHONPATH": f"{place.folder}:{source}:{ROOT}"}, []
    for key in keys:
        place.done("key", f"{key}.txt", "--new")
        for path in sorted(SAMPLES.glob("*.tif")):
            out = ("-o", f"{path.stem}.{key}", "--key", f"file:{key}.txt")
            place.done("revocable", "protect", path, *out, env=env)
        paths = sorted(place.folder.glob(f"1*.{key}"))
        contents.append([path.read_bytes() for path in paths])
    return env, contents


def _words(content: bytes) -> list[int]:
    """Return the last 40,000 bytes of a template as words."""
    words: list[int] = np.frombuffer(content[-40_000:], "<u4").tolist()
    return words


@attack("A revocable template has one size and order")
def revocable_bytes(place: Place) -> Tries:
    """Protect 16 prints; compare sizes, and how frequent each byte is with random bytes."""
    _, (contents,) = _protected(place, "one")
    yield len({len(one) for one in contents}) == 1 or "sizes differ"
    for one in contents:
        low = np.bincount(np.array(_words(one)) & 0xFF, minlength=256)
        spread = float(((low - low.mean()) ** 2 / low.mean()).sum())  # chi-square, 255 degrees
        yield spread < 400 or f"the low bytes of words are uneven: {spread:.0f}"


@attack("Templates of two keys share no more")
def revocable_keys(place: Place) -> Tries:
    """Count the common words of 16 prints under two keys; compare templates of two keys."""
    env, (ones, others) = _protected(place, "one", "two")
    for k, one in enumerate(ones):
        shared = [len(set(_words(one)) & set(_words(other))) for other in others]
        yield shared[k] <= max(5, 2 * sorted(shared)[-2]) or f"print {k} shares {shared}"
    for name in ("101_1", "102_3", "104_4"):
        yield place.run("revocable", "compare", f"{name}.one", f"{name}.two", env=env).refused
