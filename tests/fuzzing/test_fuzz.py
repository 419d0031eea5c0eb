"""`python -m research fuzz`: planted bugs are found, and none in sound readers."""

import io
import json
import random

import pytest
from PIL import Image
from planted_targets import GOOD, planted

from fpmatch.formats.registry import CODECS
from research.fuzzing.loop import damaged, run, with_right_sums
from research.fuzzing.targets import all_targets


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("raises", "ZeroDivisionError in planted_targets.py:"),
        ("dies", "the process died (exit status -9)"),
        ("hangs", "took more than 0.2 s"),
        ("wordy", "an error that is not one line"),
    ],
)
def test_a_planted_bug_is_found_and_its_input_kept(tmp_path, name, reason):
    into = tmp_path / "found"
    count = run(name, planted, [], 0, into, seconds=1.0, hang_seconds=0.2, most_failures=1)
    ((path, words),) = count.failures
    assert words.startswith(reason)
    assert path.parent == into
    assert path.name.startswith(f"{name}-")
    assert path.read_bytes() != GOOD


def test_a_sound_reader_has_no_failures(tmp_path):
    count = run("sound", planted, [b"more"], 0, tmp_path, seconds=0.3)
    assert count.failures == []
    assert count.inputs > count.refused > 0
    assert not list(tmp_path.iterdir())


def test_so_many_damaged_files_and_no_more(tmp_path):
    count = run("sound", planted, [b"more"], 0, tmp_path, files=25)
    assert (count.damaged, count.inputs) == (25, 27)
    assert count.seconds > 0


def test_a_damaged_png_may_have_right_sums():
    stream = io.BytesIO()
    Image.linear_gradient("L").save(stream, "PNG")
    png = bytearray(stream.getvalue())
    whole = bytes(png)
    png[23] ^= 1
    assert with_right_sums(png[:40])[23] != whole[23]
    assert Image.open(io.BytesIO(with_right_sums(png))).size != (256, 256)
    png[23] ^= 1
    assert bytes(with_right_sums(png)) == whole


def test_the_same_seed_gives_the_same_inputs():
    inputs = [[damaged(random.Random(seed), [GOOD]) for _ in range(9)] for seed in (1, 1, 2)]
    assert inputs[0] == inputs[1] != inputs[2]


def test_every_template_format_and_more_is_a_target_with_good_files():
    targets = {target.name: target for target in all_targets()}
    assert {codec.name for codec in CODECS} <= set(targets)
    assert any(name.startswith("image-") for name in targets)
    for target in targets.values():
        assert target.corpus
        for data in target.corpus:
            target.read(data)


def test_the_command_ends_clean_and_counts(tmp_path, run_research):
    extra = tmp_path / "more.iso"
    extra.write_bytes(b"FMR\x00 20\x00")
    words = ["--seconds", "1", "--target", "iso2005", "--target", "an2", "--into", tmp_path / "out"]
    done = run_research("fuzz", *words, extra)
    assert done.exit_code == 0, done.output
    first, second, last = done.stdout.splitlines()
    assert first.startswith("iso2005 ")
    assert second.startswith("an2 ")
    assert "inputs, 0 failures, " in last
    assert not (tmp_path / "out").exists()


def test_the_command_counts_files_and_writes_the_counts(tmp_path, run_research):
    report = tmp_path / "report.json"
    words = ["--files", "30", "--target", "image-raw", "--target", "image-gif", "--json", report]
    done = run_research("fuzz", *words)
    assert done.exit_code == 0, done.output
    document = json.loads(report.read_text())
    assert document["failures"] == 0
    assert [(one["name"], one["damaged"]) for one in document["targets"]] == [
        ("image-raw", 30),
        ("image-gif", 30),
    ]
