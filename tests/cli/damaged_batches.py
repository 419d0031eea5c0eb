"""Batches of prints with damaged files among them, given to every command that takes many prints.

A command must finish, name exactly the damaged files, and end with the right exit status.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from itertools import count, cycle
from pathlib import Path

import numpy as np
from click.testing import CliRunner
from PIL import Image

from fpmatch import extract, save_template
from fpmatch.cli.group import fpmatch
from fpmatch.lab.synthesis.impression import make_impression
from fpmatch.lab.synthesis.master import MasterParameters, make_master
from fpmatch.lab.synthesis.presets import PRESETS

IMPRESSIONS = 8
IMAGE_SUFFIXES = (".tif", ".png", ".bmp", ".jpg", ".pgm")
TEMPLATE_FORMATS = {".json": "json", ".csv": "csv", ".iso": "iso2005", ".ansi": "ansi2004"}


@dataclass
class Batch:
    folder: Path
    files: list[Path] = field(default_factory=list)
    damaged: set[str] = field(default_factory=set)


def make_batches(folder, prints, sensor, every, fingers=4):
    """Write a batch of images and one of templates, named as in FVC databases.

    The images of a few synthetic fingers are repeated, each time slightly moved.
    """
    shape = (sensor.height + 80, sensor.width + 60)
    pictures = [
        make_impression(
            make_master(5, k + 1, MasterParameters(shape=shape)), 1, PRESETS["clean"], sensor
        ).image
        for k in range(fingers)
    ]
    images, templates = Batch(folder / "images"), Batch(folder / "templates")
    for batch in (images, templates):
        batch.folder.mkdir(parents=True)
    damages = cycle(DAMAGES)
    extracted = [extract(picture, dpi=sensor.dpi) for picture in pictures]
    for number in range(prints):
        name = f"{1 + number // IMPRESSIONS}_{1 + number % IMPRESSIONS}"
        finger = number // IMPRESSIONS % fingers
        picture = np.roll(pictures[finger], (number % 7, number % 5), (0, 1))
        picture[0, :4] = np.frombuffer(number.to_bytes(4, "big"), np.uint8)  # no copies
        path = images.folder / f"{name}{IMAGE_SUFFIXES[number % len(IMAGE_SUFFIXES)]}"
        Image.fromarray(picture).save(path, dpi=(sensor.dpi, sensor.dpi))
        images.files.append(path)
        suffix, file_format = list(TEMPLATE_FORMATS.items())[number % len(TEMPLATE_FORMATS)]
        path = templates.folder / f"{name}{suffix}"
        one = extracted[finger]
        quality = one.minutiae.quality.copy()
        quality[:2] = 5 + number % 90, 5 + number // 90  # no copies here either
        changed = replace(one, minutiae=replace(one.minutiae, quality=quality), field=None)
        save_template(path, changed, file_format=file_format)
        templates.files.append(path)
        if number % every == every // 2:
            damage = next(damages)
            for batch in (images, templates):
                damage(batch.files[-1])
                batch.damaged.add(batch.files[-1].name)
    return images, templates


def _cut_short(path):
    half = path.read_bytes()[: path.stat().st_size // 2]
    path.write_bytes(half[: half.rfind(b",") + 1] or half)  # a CSV that ends with a line is whole


def _emptied(path):
    path.write_bytes(b"")


def _overwritten(path):
    noise = np.random.default_rng(len(path.name)).integers(0, 256, path.stat().st_size, np.uint8)
    path.write_bytes(noise.tobytes())


def _text(path):
    path.write_text("<html>404: not found</html>\n")


def _without_its_head(path):
    path.write_bytes(bytes(16) + path.read_bytes()[16:])


DAMAGES = (_cut_short, _emptied, _overwritten, _text, _without_its_head)
"""Functions that damage a file."""


def check_batches(folder, prints, sensor, every):
    """Give batches to every command that takes many prints; return its faults by command."""
    images, templates = make_batches(folder, prints, sensor, every)
    faults = {}
    numbers = count()

    def out(suffix=""):
        return folder / f"out{next(numbers)}{suffix}"

    for batch in (images, templates):
        files, work = [str(file) for file in batch.files], ("--workers", 1, "--json")
        runs = [
            (("inspect", *files, "--json"), 1, _on_stderr),
            (("extract", *files, "-o", out(), "--json"), 2, _in_json("failures")),
            (("enrol", out(".db"), *files, *work), 1, _in_json("failures")),
        ]
        if batch is images:
            runs.append((("evaluate", batch.folder, "--bootstrap", 0, *work), 1, _without_template))
        sides = ("--references", batch.folder, "--probes", batch.folder)
        listed = ("--pairs", _few_pairs(batch, out(".csv")))
        runs.append((("score", *sides, *listed, "-o", out(".csv"), *work), 1, _in_json("failures")))
        faults |= {f"{run[0][0]} {batch.folder.name}": _faults(batch, *run) for run in runs}
    return faults


def _few_pairs(batch, path):
    names = [file.name for file in batch.files]
    rows = [f"{a},{b}" for a, b in zip(names, names[1:] + names[:1], strict=True)]
    path.write_text("\n".join(["probe,reference", *rows]) + "\n")
    return path


def _on_stderr(result):
    return [line for line in result.stderr.splitlines() if line.startswith("fpmatch: ")]


def _without_template(result):
    """Return the lines about images without a template, without notes on others."""
    return [line for line in _on_stderr(result) if "no template: " in line]


def _in_json(key):
    return lambda result: map(str, json.loads(result.stdout)[key])


def _faults(batch, words, status, named_in):
    """Run a command and compare the files that it names with the damaged ones."""
    result = CliRunner().invoke(fpmatch, [str(word) for word in words], prog_name="fpmatch")
    faults = []
    if result.exit_code != status:
        faults.append(f"exit status {result.exit_code}, not {status}: {result.exception!r}")
    try:
        lines = list(named_in(result))
    except ValueError:
        lines = []
        faults.append(f"no JSON: {result.stdout[:200]!r} {result.stderr[-200:]!r}")
    named = {file.name for file in batch.files if any(_names(line, file) for line in lines)}
    if missed := sorted(batch.damaged - named):
        faults.append(f"damaged and not named: {', '.join(missed)}")
    if wrong := sorted(named - batch.damaged):
        faults.append(f"whole and named: {', '.join(wrong)}")
    return faults


def _names(line, file):
    """Return whether a line names a file: its path, or its bare name in quotes."""
    return f"/{file.name}" in line or f"'{file.name}'" in line
