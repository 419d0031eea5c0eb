"""`python -m research fuzz`: planted bugs are found, and none in sound readers."""

import json
import re

import pytest

from research.fuzzing import sanitizer
from research.fuzzing.loop import Limits, run
from tests.fuzzing.planted_targets import GOOD, planted


def fed(name, extra=(), **limits):
    target, reader = planted()[name]
    return list(run(target, reader, extra, limits=Limits(**limits)))[-1]


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
def test_a_planted_bug_is_found_once_and_its_input_kept(tmp_path, name, reason):
    count = fed(name, seconds=5.0, hang_seconds=0.1 if name == "hangs" else 5.0, most_kinds=1)
    (finding,) = count.findings.values()
    assert reason in finding.reason
    path = finding.save(tmp_path / "found")
    assert path.name.startswith(f"{name}-")
    assert path.read_bytes() == finding.data != GOOD
    assert finding.reason in path.with_suffix(".txt").read_text()


def test_files_are_counted_and_equal_failures_are_one_kind():
    count = fed("raises", files=5)
    assert [finding.times for finding in count.findings.values()] == [5]
    count = fed("sound", [b"more"], files=25)
    assert (count.damaged, count.inputs, count.findings) == (25, 27, {})
    assert count.seconds > 0


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_sound_reader_has_no_findings(jobs):
    target, reader = planted()["sound"]
    count = list(run(target, reader, limits=Limits(files=40), jobs=jobs))[-1]
    assert (count.damaged, count.findings) == (40, {})
    assert count.inputs > count.refused > 0


def test_the_command_ends_clean_and_counts(tmp_path, run_research):
    extra = tmp_path / "more.iso"
    extra.write_bytes(b"FMR\x00 20\x00")
    words = ["--seconds", "0.3", "--target", "iso2005", "--target", "an2"]
    done = run_research("fuzz", *words, "--into", tmp_path / "out", extra)
    assert done.exit_code == 0, done.output
    assert [line.split()[0] for line in done.stdout.splitlines()[:2]] == ["iso2005", "an2"]
    assert " 0 findings" in done.stdout.splitlines()[-1]
    assert not (tmp_path / "out").exists()


def test_a_log_adds_up_several_runs_with_other_seeds(tmp_path, run_research):
    log, report = tmp_path / "log.jsonl", tmp_path / "report.json"
    words = ["--files", "30", "--target", "image-raw", "--target", "prepared", "--log", log]
    for number in range(2):
        done = run_research("fuzz", *words, "--json", report)
        assert done.exit_code == 0, done.output
        document = json.loads(report.read_text())
        assert document["seed"] == number
        assert [one["damaged"] for one in document["targets"]] == [30, 30]
    sums = re.findall(r": (\d+) inputs in (\d) runs", done.stdout)
    assert {("126", "2"), ("62", "2")} <= {*sums}


def test_a_saved_input_is_replayed_by_the_target_it_is_named_after(tmp_path, run_research):
    saved = tmp_path / "iso2005-0123456789ab.bin"
    saved.write_bytes(b"FMR\x00 20\x00")
    done = run_research("fuzz", saved)
    assert (done.exit_code, done.stdout) == (0, f"{saved}: iso2005: is refused\n")


@pytest.mark.parametrize(
    ("words", "library", "compiler", "named"),
    [
        (("--target", "nothing"), None, None, "'nothing'"),
        (("--sanitize",), "libnothing.so", None, "libnothing.so"),
        (("--sanitize",), "libnothing.so", "/no/compiler -pthread", "/no/compiler"),
    ],
)
def test_what_is_not_there_is_named(monkeypatch, run_research, words, library, compiler, named):
    if library:
        monkeypatch.setattr(sanitizer, "LIBRARIES", (library,))
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
