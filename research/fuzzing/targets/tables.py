"""Targets: files of text, JSON and TOML that commands read beside prints and galleries."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.gallery.batch.plan import iterate_pairs
from fpmatch.gallery.encryption.keys import Key, load_keys
from fpmatch.gallery.listing.manifest import kind_of, read_manifest
from fpmatch.image.dataset_folder import read_dataset_info
from fpmatch.lab.evaluation.rates.scores import read_genuine_and_impostor, read_scores
from fpmatch.lab.evaluation.run import evaluate_scores
from fpmatch.lab.points.points_csv import load_table
from fpmatch.lab.synthesis.database import Plan
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.matching.calibration import CALIBRATION_FOLDER, load_calibration
from fpmatch.server.settings import load_settings
from research.fuzzing.target import SAMPLES, Reader, Target, scratch, written

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

EVALUATED_ONE_IN = 20  # of the files of scores: it takes longer
_SERVER = b"""[reception]
role = "verify"
token = "WNfOYJvW3B3A0nUqVYxw"
[door]
role = "admin"
sha256 = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"
[limits]
wait_seconds = 2.5
requests = 20
"""
_DATASET = (
    b'name = "synthetic"\ndpi = 500\nsensor = "plain"\npolarity = "auto"\n[synthesis]\nseed = 1\n'
)
_SCORES = (
    b"matcher,set,probe,reference,genuine,similarity,score,reason,probe_quality\n"
    b"unit-circle,one,101_1,101_2,1,25.5,50.1,,80\nunit-circle,one,101_1,102_1,0,3.25,1.5,,80\n"
    b"unit-circle,one,101_2,102_1,0,,,probe: no template,\nunit-circle,one,102_1,102_2,1,9,,,70\n",
    b"probe,reference,similarity\n1_1,2_1,0.5\n1_1,1_2,7\n2_1,2_2,8\n1_2,2_1,0.25\n",
    b"probe,reference,score,genuine\na,b,7.5,1\na,c,0.5,0\n",
)
_POINTS = (
    *(b"name,x,y\nVega,279.23,38.78\nDeneb,310.36,45.28\n", b"1,2\n3,4\n5.5,-6e2\n"),
    *(b"# stars\n1.0 2.0\n3.0 4.0\n", b'x,y,"a, b"\n1,2,"c"\n'),
)


def text_targets() -> list[Target]:
    """Return the targets of text: tables, JSON, TOML."""
    return [
        Target("points", _points, (b"x,y\n", b"\x93NUMPY")),
        Target("manifest", _manifest, (b"path", b"subject", b"finger", b"101_1.tif")),
        Target("pairs", _pairs, (b"probe", b"reference", b"genuine", b"1", b"0")),
        Target("scores", _scores, (b"similarity", b"distance", b"genuine", b"1_1", b"nan")),
        Target("scores-of-one-kind", _one_kind, (b"similarity", b"impostor", b"genuine")),
        Target("dataset-info", _dataset_info, (b"dpi", b"polarity", b'"""', b"inf")),
        Target("settings", lambda: _of_file("c.toml", load_settings, [_SERVER])),
        Target("calibration", _calibration),
        Target("keys", _keys, (b"=", b"#", b"A" * 44)),
    ]


def _of_file(name: str, read: Callable[[Path], Any], corpus: list[bytes]) -> Reader:
    """Return the reader of a file of this name."""

    def reading(data: bytes) -> None:
        read(written(name, data))

    return Reader(corpus, reading)


def _points() -> Reader:
    path = scratch() / "points.npy"
    np.save(path, np.arange(12, dtype=np.float64).reshape(6, 2))
    return _of_file("points.csv", load_table, [*_POINTS, path.read_bytes()])


def _manifest() -> Reader:
    names = sorted(path.name for path in SAMPLES.glob("*.tif"))

    def read(data: bytes) -> list[str]:
        path = written("manifest.csv", data)
        for name in names:
            (path.parent / name).touch()
        kind_of(path)
        return [text for one in read_manifest(path) for text in (one.name, str(one.label))]

    more = b"path;subject;finger;impression;dpi\n101_1.tif;ada;left;1;500\n102_1.tif;bob;left;;\n"
    return Reader([(SAMPLES / "manifest.csv").read_bytes(), more], read)


def _pairs() -> Reader:
    more = b"probe,reference,genuine\n1_1,1_2,1\n1_1,2_1,0\n1_2,2_1,0\n"
    return _of_file(
        "pairs.txt",
        lambda path: list(iterate_pairs(path)),
        [(SAMPLES / "pairs.txt").read_bytes(), more],
    )


def _scores() -> Reader:
    def read(path: Path) -> None:
        distances = b"distance" in path.read_bytes()
        (read_scores if zlib.crc32(path.read_bytes()) % EVALUATED_ONE_IN else _evaluated)(
            path, distances=distances
        )

    return _of_file("scores.csv", read, list(_SCORES))


def _one_kind() -> Reader:
    def read(path: Path) -> None:
        read_genuine_and_impostor(path, path)

    return _of_file("genuine.csv", read, [_SCORES[1], b"score\n1\n2\n", b"1.5\n2.5\n7\n"])


def _evaluated(path: Path, *, distances: bool) -> None:
    evaluate_scores([path], distances=distances)


def _dataset_info() -> Reader:
    def read(data: bytes) -> list[str]:
        found = read_dataset_info(written("dataset.toml", data).parent)
        return [text for text in (found.name, found.sensor) if text]

    plan = Plan(1, PRESETS["normal"], (SENSORS["optical-388x374"],), 2)
    return Reader([_DATASET, plan.description().encode()], read)


def _calibration() -> Reader:
    def read(path: Path) -> None:
        calibration = load_calibration("unit-circle", path)
        calibration.scores(np.array([-1.0, 0.0, 1.5, 25.0, 1e9]))

    made = (CALIBRATION_FOLDER / "unit-circle.json").read_bytes()
    return _of_file("calibration.json", read, [made])


def _keys() -> Reader:
    def read(path: Path) -> None:
        path.chmod(0o600)
        load_keys(f"file:{path}")

    lines = "".join(f"{Key(bytes(range(32))).as_line()}\n" for _ in range(2))
    return _of_file("keys.txt", read, [lines.encode(), f"# one\n\n{lines}".encode()])
