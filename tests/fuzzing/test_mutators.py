"""Mutators of `python -m research fuzz`: reproducible, and right where they say so."""

import io
import json
import random
import sqlite3
from contextlib import closing

import numpy as np
import pytest
from PIL import Image

from fpmatch.errors import FpmatchError
from fpmatch.gallery.store.stored_template import unpack_template
from research.fuzzing.mutators import containers, records, text
from research.fuzzing.mutators.octets import damaged
from research.fuzzing.targets import all_targets

TARGETS = {target.name: target for target in all_targets()}
MUTATED = sorted(name for name, target in TARGETS.items() if target.mutators)


@pytest.fixture(scope="module")
def corpus():
    made = {}
    return lambda name: made.setdefault(name, TARGETS[name].make().corpus)


def test_the_same_seed_gives_the_same_inputs(corpus):
    good, mutators = corpus("json"), TARGETS["json"].mutators
    made = [[damaged(random.Random(seed), good, mutators) for _ in range(9)] for seed in (1, 1, 2)]
    assert made[0] == made[1] != made[2]


@pytest.mark.parametrize("name", MUTATED)
def test_every_mutator_of_a_target_changes_its_good_files(corpus, name):
    rng, good = random.Random(1), corpus(name)
    for mutator in TARGETS[name].mutators:
        changed = 0
        for k in range(60):
            data = good[k % len(good)]
            try:
                changed += mutator(rng, data) != data
            except Exception:  # noqa: BLE001  (a file of another of the target's formats)
                continue
        assert changed >= 5, mutator


def test_a_damaged_png_may_have_right_sums():
    stream = io.BytesIO()
    Image.linear_gradient("L").save(stream, "PNG")
    png = bytearray(stream.getvalue())
    whole = bytes(png)
    png[23] ^= 1
    assert records.with_right_sums(png[:40])[23] != whole[23]
    assert Image.open(io.BytesIO(records.with_right_sums(png))).size != (256, 256)
    png[23] ^= 1
    assert records.with_right_sums(png) == whole


def test_records_keep_their_lengths(corpus):
    rng = random.Random(1)
    for name in ("iso2005", "iso2011"):
        for _ in range(50):
            record = records.fmr_field(rng, corpus(name)[0])
            assert int.from_bytes(record[8:12], "big") == len(record)


def test_damage_gets_behind_a_checksum(corpus):
    rng, stopped = random.Random(1), 0
    for _ in range(100):
        try:
            unpack_template(records.stored_template(rng, corpus("packed-template")[0]))
        except FpmatchError as error:
            stopped += "template is damaged" in str(error)
    assert stopped < 50


def test_sqlite_cells_leave_a_whole_database(corpus):
    rng, good = random.Random(1), corpus("gallery")[0]
    whole = 0
    for _ in range(40):
        try:
            changed = containers.sqlite_cell(rng, good)
        except sqlite3.Error:  # a value that the column refuses
            continue
        with closing(sqlite3.connect(":memory:")) as database:
            database.deserialize(changed)
            whole += database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    assert whole > 20


def test_an_npy_header_stays_one():
    stream = io.BytesIO()
    np.save(stream, np.arange(6.0).reshape(3, 2))
    rng, good = random.Random(1), stream.getvalue()
    assert all(containers.npy_header(rng, good).startswith(b"\x93NUMPY") for _ in range(50))


def test_json_values_are_extreme():
    rng, good = random.Random(1), json.dumps({"a": 1, "b": [2, "x"]}).encode()
    made = {text.json_value(rng, good) for _ in range(500)}
    for extreme in (b"5e-324", b"\\ud800", b"[" * 1000):
        assert any(extreme in one for one in made)
