"""Attacks by a thief, a reader of backups and other users: rights, traces, encryption, keys."""

from __future__ import annotations

import base64
import json
import shutil
import time
import zlib
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from research.promises.attack import attack
from research.promises.program import (
    PROBE,
    REFERENCE,
    SAMPLES,
    database,
    flipped,
    sound,
    templates,
    traces,
)
from research.promises.web import descendants

if TYPE_CHECKING:
    from research.promises.attack import Tries
    from research.promises.program import Place, Words


@attack("Galleries, their journals, prepared prints")
def rights_of_files(place: Place) -> Tries:
    """Run all commands that write files with umask 0, and look at the folder meanwhile."""
    place.gallery("wide.db").chmod(0o644)
    known = set(place.folder.rglob("*"))
    commands: tuple[Words, ...] = (
        ("gallery", "remove", "wide.db", 3),
        ("enrol", "new.db", SAMPLES, "--audit"),
        ("identify", "new.db", PROBE),
        ("identify", "new.db", "--probes", SAMPLES, "-o", "candidates.csv"),
        ("score", "--references", "new.db", "--probes", SAMPLES, "-o", "scores.csv"),
        ("evaluate", SAMPLES, "--report", "report", "--scores", "all.csv"),
        ("extract", "--gallery", "new.db", "-o", "exported"),
        ("extract", PROBE, "-o", "templates"),
        ("convert", PROBE, "probe.iso"),
        ("extract", PROBE, "-o", "stages", "--format", "stages"),
        ("verify", PROBE, REFERENCE, "--overlay", "overlay.png"),
        ("verify", PROBE, REFERENCE, "--case-report", "case.html"),
        ("gallery", "rewrite", "new.db"),
        ("gallery", "rewrite", "--encrypt", "new.db"),
    )
    for words in commands:
        running, wide = place.start(*words, umask=0), dict[str, str]()
        while running.poll() is None:
            wide |= _wide(place, known)
            time.sleep(0.003)
        running.communicate()
        known -= {place.folder / "wide.db"}
        wide |= _wide(place, known)
        yield not wide or f"{words[:2]}: {wide}"


def _wide(place: Place, known: set[Path]) -> dict[str, str]:
    """Return what others may read, of the files that are new here, but for caches of matplotlib."""
    modes: dict[str, str] = {}
    for path in set(place.folder.rglob("*")) - known:
        if not path.relative_to(place.folder).parts[0].startswith("."):
            with suppress(FileNotFoundError):
                mode = path.stat().st_mode & 0o777
                modes |= {path.name: oct(mode)} if mode & 0o077 else {}
    return modes


@attack("After `gallery remove` no 32 successive bytes")
def removed_templates(place: Place) -> Tries:
    """Remove from plain, sealed and audited galleries; look for 32 bytes at each place."""
    for kind in ("plain", "sealed", "audited"):
        gallery, numbers = place.gallery(kind=kind), list(range(1, 17))
        place.random.shuffle(numbers)
        for k in range(0, 15, 5):
            secrets = [templates(gallery)[number] for number in numbers[k : k + 5]]
            place.search(gallery)
            run = place.done("gallery", "remove", gallery, *numbers[k : k + 5])
            left = traces(secrets, place.folder, 32)
            yield left == 0 or f"{left} traces after {run}"


@attack("`gallery rewrite` leaves the gallery whole")
def killed_compactions(place: Place) -> Tries:
    """Kill it at random moments; run it on full disks, and while another program writes."""
    gallery = place.gallery()
    place.done("gallery", "remove", gallery, 1, 2, 3)
    want, _ = place.search(gallery)
    seconds = place.seconds("gallery", "rewrite", gallery)
    for _ in range(10):
        place.kill(seconds, "gallery", "rewrite", gallery)
        yield (
            sound(gallery) and place.search(gallery)[0] == want
        ) or "another gallery after a kill"
    for size in (1, 40, 90):
        limit = ("bash", "-c", f'ulimit -f {size}; exec "$0" "$@"')
        run = place.run("gallery", "rewrite", gallery, before=limit)
        whole = sound(gallery) and place.search(gallery)[0] == want
        yield (run.status == 0 or run.refused) if whole else f"another gallery after {run}"
    with database(gallery) as opened:
        opened.execute("BEGIN IMMEDIATE")
        running = place.start("gallery", "rewrite", gallery)
        time.sleep(3)
        yield running.poll() is None or "it did not wait for another program"
        opened.rollback()
    yield running.wait(60) == 0 or "it failed after another program"


@attack("With `enrol --encrypt`, nothing of a template is readable")
def readable_templates(place: Place) -> Tries:
    """Look for 12 bytes of plain templates in all files after each command; compress entries."""
    plain = place.gallery()
    secrets = list(templates(plain).values())
    place.done("extract", PROBE, "-o", "plain", "--format", "json")
    field = json.loads((place.folder / "plain" / "101_1.json").read_text())["ridge_field"]
    secrets += [base64.b64decode(field["orientation"])]
    shutil.rmtree(place.folder / "plain")
    shutil.rmtree(f"{plain}.prepared")
    plain.unlink()
    commands: tuple[Words, ...] = (
        ("enrol", "sealed.db", SAMPLES, "--encrypt"),
        ("identify", "sealed.db", PROBE),
        ("score", "--references", "sealed.db", "--probes", "sealed.db", "-o", "s.csv"),
        ("gallery", "remove", "sealed.db", 3),
        ("key", "keys.txt", "--add"),
        ("gallery", "rewrite", "--encrypt", "sealed.db"),
    )
    for words in commands:
        place.done(*words, env={"TMPDIR": str(place.folder)})
        left = traces(secrets, place.folder, 12)
        yield left == 0 or f"after {words[:2]}: {left} pieces of 12 bytes"
    for sealed in templates(place.folder / "sealed.db").values():
        yield len(zlib.compress(sealed)) >= len(sealed) or "a sealed template can be compressed"


@attack("One changed byte of an encrypted template")
def changed_ciphertexts(place: Place) -> Tries:
    """Flip a bit at each byte of entries and files; exchange entries, labels and galleries."""
    place.gallery(kind="sealed")
    made = place.folder / "made.db"
    place.done("synth", made, "--templates", "--fingers", 60, "--impressions", 4)
    place.done("gallery", "rewrite", "--encrypt", made)
    good = templates(made)
    longest, other = (
        max(map(len, good.values())),
        list(templates(place.folder / "plain.db").values()),
    )
    changes = [
        {
            number: flipped(one, (start + k) % len(one))
            for k, (number, one) in enumerate(good.items())
        }
        for start in range(0, longest, len(good))
    ]
    changes.append(dict(zip(good, [*good.values()][1:] + [*good.values()][:1], strict=True)))
    changes.append({number: other[number % 16] for number in good})
    for changed in changes:
        with database(made) as opened:
            rows = [(content, number) for number, content in changed.items()]
            opened.executemany("UPDATE fpmatch_entry SET template = ? WHERE id = ?", rows)
        named = len(json.loads(place.run("gallery", "check", made, "--json").out or "[]"))
        yield from (k < named or f"{named} of {len(good)} are named" for k in range(len(good)))
    for column in ("subject", "finger", "impression", "source"):
        gallery = place.gallery(kind="sealed")
        with database(gallery) as opened:
            opened.execute(f"UPDATE fpmatch_entry SET {column} = {column} || 'x'")
        named = len(json.loads(place.run("gallery", "check", gallery, "--json").out))
        yield named >= 16 or f"changed {column}: {named} of 16 are named"
    want, _ = place.search(place.gallery(kind="sealed"))
    for _ in range(10):
        gallery = place.gallery(kind="sealed")
        path = place.prepared(gallery)
        content = path.read_bytes()
        path.write_bytes(flipped(content, place.random.randrange(len(content))))
        have, run = place.search(gallery)
        yield (have == want and "note" in run.err) or str(run)


@attack("An encrypted gallery gives the same results")
def sealed_results(place: Place) -> Tries:
    """Compare files of candidates and scores of 16 prints with the files of a plain gallery."""
    lines: list[list[str]] = []
    for gallery in (place.gallery("one.db"), place.gallery("two.db", kind="sealed")):
        for words in (("identify", gallery), ("score", "--references", gallery)):
            out = place.folder / f"{gallery.name}.{words[0]}.csv"
            place.done(*words, "--probes", SAMPLES, "-o", out)
            lines.append(out.read_text().replace(gallery.name, "").splitlines())
    for plain, sealed in zip(lines[0] + lines[1], lines[2] + lines[3], strict=True):
        yield plain == sealed or f"{plain} and {sealed}"


@attack("Files of keys are private, and others are refused")
def keys_in_the_open(place: Place) -> Tries:
    """Widen key files; give them to all commands; search output, environments and pipes."""
    gallery, file = place.gallery(kind="sealed"), place.folder / "keys.txt"
    place.done("key", "other.txt", "--new", umask=0)
    yield (place.folder / "other.txt").stat().st_mode & 0o077 == 0 or "key --new makes a wide file"
    for mode in (0o604, 0o640, 0o660, 0o602, 0o620, 0o777):
        file.chmod(mode)
        yield place.run("identify", gallery, PROBE).refused
    file.chmod(0o600)
    secret = file.read_text().split("\n")[1].split()[1]
    raw = base64.b64decode(secret)
    place.write("damaged.txt", f"id {secret}\n{secret}\n0123456789abcdef {secret[:-3]}\n").chmod(
        0o600
    )
    sides: Words = ("score", "--references", SAMPLES, "--probes", SAMPLES, "-o", "s.csv")
    commands: tuple[Words, ...] = (
        ("key", file, "--json"),
        ("key", "damaged.txt"),
        ("enrol", gallery, SAMPLES / "101_1.tif"),
        ("gallery", "list", gallery, "--summary", "--json"),
        ("gallery", "check", gallery, "--key", "file:other.txt"),
        ("verify", PROBE, file),
        ("identify", file, PROBE),
        ("inspect", file),
        ("points", file, file),
        ("rates", file),
        ("evaluate", file),
        (*sides, "--pairs", file),
        ("calibrate", file, "-o", "c.json"),
        ("verify", PROBE, REFERENCE, "--calibration", file),
        ("gallery", "audit", "show", file),
        ("serve", "--port", 99999, "--settings", file),
        *(
            ("convert", file, "o.json", "--angles", "deg", "--from", kind)
            for kind in ("numbers", "xyt")
        ),
        ("enrol", "n.db", file, "--pattern", "(?P<subject>.+)"),
    )
    for words in commands:
        run = place.run(*words)
        forms = (secret[4:-6], raw.hex(), repr(raw)[2:40])
        yield not any(form in run.out + run.err for form in forms) or f"{run}"
    strace = (
        "strace",
        "-f",
        "-xx",
        "-s99999",
        "-etrace=write,sendto,sendmsg,execve,writev",
        "-otrace",
    )
    before, seen = strace if shutil.which("strace") else (), set[bytes]()
    words = ("score", "--references", gallery, "--probes", gallery, "-o", "s.csv", "--workers", 2)
    running = place.start(*words, before=before)
    while running.poll() is None:
        for pid in descendants(running.pid):
            for path in (Path(f"/proc/{pid}/environ"), Path(f"/proc/{pid}/cmdline")):
                with suppress(OSError):
                    seen.add(path.read_bytes())
        time.sleep(0.02)
    sent = (place.folder / "trace").read_text() if before else ""
    for form in (raw, secret.encode(), raw.hex().encode()):
        yield not any(form in one for one in seen) or "a process was started with a key"
        yield "".join(f"\\x{byte:02x}" for byte in form) not in sent or "a process was sent a key"


@attack("A rotation of keys loses nothing")
def killed_rotations(place: Place) -> Tries:
    """Kill rotations at random moments, during searches and enrolments; take the old key away."""
    for kind in ("plain", "sealed"):
        gallery = place.gallery(kind=kind)
        want, _ = place.search(gallery)
        seconds = place.seconds(
            "gallery", "rewrite", "--encrypt", place.gallery("other.db", kind=kind)
        )
        place.done("key", "keys.txt", "--add")
        for _ in range(5):
            other = place.start("enrol", gallery, SAMPLES)
            place.kill(seconds, "gallery", "rewrite", "--encrypt", gallery)
            have, run = place.search(gallery)
            yield have["probes"] == want["probes"] or str(run)
            err = other.communicate()[1].decode()
            yield other.returncode == 0 or f"enrol during a rotation: {err[-200:]}"
        place.done("gallery", "rewrite", "--encrypt", gallery)
        lines = (place.folder / "keys.txt").read_text().splitlines()[:2]
        place.write("keys.txt", "\n".join([*lines, ""]))
        have, run = place.search(gallery)
        yield have["probes"] == want["probes"] or f"with the new key alone: {run}"
