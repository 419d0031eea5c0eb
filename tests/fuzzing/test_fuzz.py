"""`python -m research fuzz`: planted bugs are found, and none in sound readers."""

import json

import pytest
from planted_targets import GOOD, planted

from research.fuzzing import sanitizer
from research.fuzzing.loop import Limits, run


def fed(name, extra=(), **limits):
    target, reader = planted()[name]
    return list(run(target, reader, extra, limits=Limits(**limits)))[-1]


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("raises", "ZeroDivisionError in no file of fpmatch: on purpose"),
        ("dies", "the process died (exit status -11) in no file of fpmatch"),
        ("hangs", "took more than 0.1 s in no file of fpmatch"),
        ("wordy", "a text of several lines of TemplateError"),
        ("escapes", "control characters in the text of a note or name"),
        ("large", "the process has used more than 1000 MB"),
    ],
)
def test_a_planted_bug_is_found_once_and_its_input_kept(tmp_path, name, reason):
    count = fed(name, seconds=5.0, hang_seconds=0.1 if name == "hangs" else 5.0, most_kinds=1)
    (finding,) = count.findings.values()
    assert finding.reason.startswith(reason)
    path = finding.save(tmp_path / "found")
    assert path.name.startswith(f"{name}-")
    assert path.read_bytes() == finding.data != GOOD
    assert finding.reason in path.with_suffix(".txt").read_text()


def test_equal_failures_are_one_kind():
    count = fed("raises", files=5)
    assert [finding.times for finding in count.findings.values()] == [5]


def test_a_sound_reader_has_no_findings():
    count = fed("sound", [b"more"], seconds=0.3)
    assert count.findings == {}
    assert count.inputs > count.refused > 0


def test_so_many_damaged_files_and_no_more():
    count = fed("sound", [b"more"], files=25)
    assert (count.damaged, count.inputs) == (25, 27)
    assert count.seconds > 0


def test_several_processes_share_the_files():
    target, reader = planted()["sound"]
    count = list(run(target, reader, limits=Limits(files=40), jobs=2))[-1]
    assert count.damaged == 40


def test_the_command_ends_clean_and_counts(tmp_path, run_research):
    extra = tmp_path / "more.iso"
    extra.write_bytes(b"FMR\x00 20\x00")
    words = ["--seconds", "1", "--target", "iso2005", "--target", "an2", "--into", tmp_path / "out"]
    done = run_research("fuzz", *words, extra)
    assert done.exit_code == 0, done.output
    first, second, last = done.stdout.splitlines()
    assert first.startswith("iso2005 ")
    assert second.startswith("an2 ")
    assert "inputs, 0 findings, " in last
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
    assert "all readers: 126 inputs in 2 runs, 0 findings" in done.stdout
    assert "prepared files and galleries: 62 inputs in 2 runs" in done.stdout


def test_a_saved_input_is_replayed_by_the_target_it_is_named_after(tmp_path, run_research):
    saved = tmp_path / "iso2005-0123456789ab.bin"
    saved.write_bytes(b"FMR\x00 20\x00")
    done = run_research("fuzz", saved)
    assert done.exit_code == 0, done.output
    assert done.stdout == f"{saved}: iso2005: is refused\n"


def test_an_unknown_target_is_refused(run_research):
    done = run_research("fuzz", "--target", "nothing")
    assert done.exit_code == 2
    assert "'nothing' is none of csv, json" in done.stderr


def test_reports_of_sanitizers_become_one_line():
    report = (
        "==1==ERROR: AddressSanitizer: heap-buffer-overflow on address 0x60\n"
        "    #0 0x7f in __pyx_f_7fpmatch build/cython/fpmatch/_local_kernel.c:123\n"
    )
    where = "AddressSanitizer heap-buffer-overflow in _local_kernel:123"
    assert sanitizer.reason_of(report) == where
    undefined = "build/cython/_grid_kernel.c:9:3: runtime error: signed integer overflow: 1 + 2\n"
    assert sanitizer.reason_of(undefined) == (
        "UndefinedBehaviorSanitizer signed integer overflow 1 + 2 in _grid_kernel:9"
    )


def test_a_compiler_without_sanitizers_is_named(monkeypatch, run_research):
    monkeypatch.setattr(sanitizer, "LIBRARIES", ("libnothing.so",))
    done = run_research("fuzz", "--sanitize")
    assert done.exit_code == 2
    assert "it has no libnothing.so" in done.stderr
    monkeypatch.setattr(sanitizer.sysconfig, "get_config_var", lambda _: "/no/compiler -pthread")
    done = run_research("fuzz", "--sanitize")
    assert done.exit_code == 2
    assert "/no/compiler does not run" in done.stderr
