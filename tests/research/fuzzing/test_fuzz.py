"""`python -m research fuzz`: planted bugs are found, and none in sound readers."""

import random
from io import BytesIO

import pytest
from PIL import Image

from research.fuzzing import sanitizer
from research.fuzzing.damage import damaged, with_right_sums
from research.fuzzing.loop import Limits, run
from tests.research.fuzzing.planted_targets import GOOD, planted


def fed(name, extra=(), **limits):
    target, reader = planted()[name]
    return run(target, reader, extra, limits=Limits(**limits))


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("raises", "ZeroDivisionError"),
        ("dies", "exit status -11"),
        ("hangs", "0.1 s"),
        ("wordy", "several lines"),
        ("escapes", "control characters"),
        ("large", "1000 MB"),
    ],
)
def test_a_planted_bug_is_found_and_its_input_kept(tmp_path, name, reason):
    count = fed(name, files=3, hang_seconds=0.1 if name == "hangs" else 5.0)
    (finding,) = count.findings.values()
    assert reason in finding.reason
    assert finding.times >= 1
    path = finding.save(tmp_path / "found")
    assert path.name.startswith(f"{name}-")
    assert path.read_bytes() == finding.data != GOOD
    assert finding.reason in path.with_suffix(".txt").read_text()


def test_files_are_counted_and_equal_failures_are_one_kind():
    assert [finding.times for finding in fed("raises", files=6).findings.values()] == [5]
    count = fed("sound", [b"more"], files=25)
    assert (count.inputs, count.findings) == (25, {})
    assert count.inputs > count.refused > 0


def test_damage_depends_on_the_seed_and_may_have_right_sums():
    made = [damaged(random.Random(seed), [bytes(range(99))]) for seed in (1, 1, 2)]
    assert made[0] == made[1] != made[2]
    stream = BytesIO()
    Image.linear_gradient("L").save(stream, "PNG")
    png = bytearray(stream.getvalue())
    png[23] ^= 1
    assert Image.open(BytesIO(with_right_sums(png))).size != (256, 256)


def test_the_command_ends_clean_and_counts(tmp_path, run_research):
    extra = tmp_path / "more.iso"
    extra.write_bytes(b"FMR\x00 20\x00")
    words = ["--seconds", "0.3", "--target", "iso2005", "--target", "an2"]
    done = run_research("fuzz", *words, "--into", tmp_path / "out", extra)
    assert done.exit_code == 0, done.output
    assert [line.split()[0] for line in done.stdout.splitlines()[:2]] == ["iso2005", "an2"]
    assert " 0 findings" in done.stdout.splitlines()[-1]
    assert not (tmp_path / "out").exists()


def test_a_saved_input_is_replayed_by_the_target_it_is_named_after(tmp_path, run_research):
    saved = tmp_path / "iso2005-0123456789ab.bin"
    saved.write_bytes(b"FMR\x00 20\x00")
    done = run_research("fuzz", saved)
    assert (done.exit_code, done.stdout) == (0, f"{saved}: iso2005: is refused\n")


@pytest.mark.parametrize(
    ("words", "compiler", "named"),
    [
        (("--target", "nothing"), None, "'nothing'"),
        (("--sanitize",), "/no/compiler -pthread", "/no/compiler"),
    ],
)
def test_what_is_not_there_is_named(monkeypatch, run_research, words, compiler, named):
    if compiler:
        monkeypatch.setattr(sanitizer.sysconfig, "get_config_var", lambda _: compiler)
    done = run_research("fuzz", *words)
    assert (done.exit_code, named in done.stderr) == (2, True)


@pytest.mark.parametrize(
    ("report", "reason"),
    [
        (
            "==1==ERROR: AddressSanitizer: heap-buffer-overflow on address 0x60\n"
            "    #0 0x7f in __pyx_f build/cython/fpmatch/_local_kernel.c:123\n",
            "AddressSanitizer heap-buffer-overflow in _local_kernel:123",
        ),
        (
            "build/cython/_grid_kernel.c:9:3: runtime error: signed integer overflow: 1 + 2\n",
            "UndefinedBehaviorSanitizer signed integer overflow 1 + 2 in _grid_kernel:9",
        ),
    ],
)
def test_reports_of_sanitizers_become_one_line(report, reason):
    assert sanitizer.reason_of(report) == reason
