"""`fpmatch` itself: its help, its errors on one line, its exit statuses."""

import importlib
import io
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fpmatch.cli.group import COMMANDS
from fpmatch.cli.group import fpmatch as main
from fpmatch.cli.progress import ProgressBars
from fpmatch.errors import FpmatchError
from fpmatch.image.enhancement.enhancers import ENHANCERS
from fpmatch.image.quality.polarity import POLARITIES
from fpmatch.lab.evaluation.databases.protocol import PROTOCOLS
from fpmatch.lab.points.match import POINT_MATCHERS
from fpmatch.lab.synthesis.presets import PRESETS
from tests.conftest import assert_refused, leaves

SUMMARIES = {name: text for of in COMMANDS.values() for name, text in of.items()}
FPMATCH = [sys.executable, "-m", "fpmatch"]


@pytest.mark.parametrize("command", sorted({*SUMMARIES, *leaves(main)}))
def test_every_command_has_help_with_examples(run, command):
    result = run(*command.split(), "--help")
    assert result.exit_code == 0
    assert f"Usage: fpmatch {command} [OPTIONS]" in result.output
    assert f"  fpmatch {command} " in result.output.split("Example")[1]


@pytest.mark.parametrize(
    ("words", "choices"),
    [
        ("verify", POLARITIES),
        ("verify", tuple(ENHANCERS)),
        ("evaluate", tuple(PROTOCOLS)),
        ("points", POINT_MATCHERS),
        ("synth", tuple(PRESETS)),
    ],
)
def test_the_choices_of_an_option_are_those_of_the_package(run, words, choices):
    assert f"[{'|'.join(choices)}]" in "".join(run(*words.split(), "--help-all").stdout.split())


WRONG_USAGE = {
    "": "verifie | evaluate | synth | points | points p.csv",
    "verify": "only-one.png | a b --dpi many | a b --polarity grey | a b --enhance gabor",
    "convert a b": "--size 300 | --size 0x5",
    "evaluate x": "--workers 0 | --protocol all | --crop 31 | --crop 160 --ground-truth | "
    "--crop 160 --report y | --enrol 0 | --enrol 2 --crop 160 | --enrol 2 --scores y | "
    "--impostors y | --enrol-seed 1 | --enhance gabor | --fmr 0",
    "evaluate-identification x": "--crop 100 | --scores s.csv | --fmr 0.1 | --fpir 0 | "
    "--fingers 0 | --table t.csv",
    "rates": "--fmr 0.1 | s.csv --matcher paper | s.csv --crop 100 | s.csv --fmr 0 | "
    "--genuine-scores g.txt",
    "gallery": "remove x | list x --failures --subject 1 | list x --summary --failures | "
    "rewrite x --encrypt --decrypt | audit verify x --expect 1 | audit switch x off | "
    "audit switch x on --yes",
    "identify x y": "--effort 3 | --effort few",
    "points": "- -",
    "score --references x --probes y -o z": "--scheduler u --workers 2 | --workers 0",
    "extract a -o b": "--enhance gabor",
    "synth x": "--preset wet | --sensor nose | --size 400 | --size axb | --size -4x400 | "
    "--dpi 500 | --size 400x400 --sensor plain-288x384 | --workers 0 | --fingers many",
}


@pytest.mark.parametrize(
    "words",
    [f"{command} {rest}" for command in WRONG_USAGE for rest in WRONG_USAGE[command].split(" | ")],
)
def test_wrong_usage(run, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    result = run(*words.split())
    assert (result.exit_code, result.stdout) == (2, "")
    assert "Usage: fpmatch" in result.stderr
    assert "Error: " in result.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "suggestion"),
    [
        ("verfy a b", "'verify'"),
        ("verify a b --overly c", "--overlay"),
        ("convert a b --format iso205", "'iso2005'"),
        ("convert a b --from xty", "'xyt'"),
        ("synth x --preset clen", "'clean'"),
        ("points a b --matcher triangle", "'triangles'"),
        ("calibrate x -o c.json --matcher unit-circl", "'unit-circle'"),
        ("zzz", "Error: No such command 'zzz'.\n"),
    ],
)
def test_the_closest_name_is_suggested(run, tmp_path, monkeypatch, words, suggestion):
    monkeypatch.chdir(tmp_path)
    result = run(*words.split())
    assert (result.exit_code, suggestion in result.stderr.split("ean ")[-1]) == (2, True)


def failing(monkeypatch, error):
    def fail(*_, **__):
        raise error

    verify = importlib.import_module("fpmatch.cli.verify").verify
    monkeypatch.setattr(verify, "callback", fail)


def test_errors_are_one_line_interrupts_are_quiet_and_faults_are_not_hidden(run, monkeypatch):
    words = ("verify", "odd.png", "odd.png")
    failing(monkeypatch, FpmatchError("odd\nname.png: no such file"))
    assert_refused(run(*words), "odd\\nname.png: no such file\n")
    caused = FpmatchError("a worker ended")
    caused.__cause__ = KeyboardInterrupt()
    for interrupt in (KeyboardInterrupt(), caused):
        failing(monkeypatch, interrupt)
        assert (run(*words).exit_code, run(*words).output) == (130, "")
    failing(monkeypatch, ZeroDivisionError())
    assert isinstance(run(*words).exception, ZeroDivisionError)


def test_an_interrupt_is_quiet_while_the_command_line_is_parsed(run, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("click.Group.make_context", interrupted)
    result = run("inspect", "odd.png")
    assert (result.exit_code, result.output) == (130, "")


def start(command, **options):
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
    return subprocess.run(command, text=True, check=False, timeout=60, **options)


def test_a_reader_that_leaves_is_met_in_silence():
    read_end, write_end = os.pipe()
    os.close(read_end)
    done = start([*FPMATCH, "extract", "no-such-file.png", "-o", "."], stdout=write_end)
    os.close(write_end)
    assert done.returncode == 128 + signal.SIGPIPE
    assert not any(word in done.stderr for word in ("Traceback", "Exception"))


@pytest.mark.parametrize("closed", [False, True], ids=["stderr open", "stderr closed"])
def test_decoders_keep_silent_about_a_damaged_file(tmp_path, closed):
    path = tmp_path / "print.tif"
    noise = np.random.default_rng(3).integers(0, 256, (90, 80), dtype=np.uint8)
    Image.fromarray(noise).save(path, compression="tiff_lzw")
    data = bytearray(path.read_bytes())
    data[200:400] = bytes(255 - byte for byte in data[200:400])
    path.write_bytes(data)
    words = f"{sys.executable} -m fpmatch verify {path} {path}"
    done = start(["/bin/sh", "-c", f"{words} 2>&-" if closed else words])
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == done.stderr.count("damaged") == (0 if closed else 1)


def test_the_shell_completes_commands_options_and_values(monkeypatch, capsys):
    monkeypatch.setenv("_FPMATCH_COMPLETE", "bash_complete")
    for words, completed in (
        ("fpmatch gallery audit ", ["show", "switch", "verify"]),
        ("fpmatch verify --sub", ["--subject"]),
        ("fpmatch verify --probe-d", []),
        ("fpmatch verify --ridge-map --view o", ["overlay"]),
        ("fpmatch rates --gen", ["--genuine-scores"]),
    ):
        monkeypatch.setenv("COMP_WORDS", words)
        monkeypatch.setenv("COMP_CWORD", str(len(words.split(" ")) - 1))
        with pytest.raises(SystemExit):
            main(prog_name="fpmatch")
        lines = capsys.readouterr().out.split()
        assert [line.removeprefix("plain,") for line in lines] == completed


def test_the_module_runs_as_the_command(tmp_path):
    done = start([*FPMATCH, "verify", "gone.png", "gone.png"], cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "fpmatch: error: gone.png: no such file\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full here")
def test_output_that_cannot_be_written_is_one_line_and_status_2():
    points = Path(__file__).parents[2] / "sample_data" / "stars.csv"
    with Path("/dev/full").open("w") as full:
        done = start([*FPMATCH, "points", str(points), str(points)], stdout=full)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert done.stderr.startswith("fpmatch: error: output: ")


@pytest.mark.parametrize("terminal", [True, False])
def test_a_bar_tells_stage_share_and_rate_on_a_terminal(monkeypatch, terminal):
    stream = io.StringIO()
    stream.isatty = lambda: terminal
    monkeypatch.setattr(sys, "stderr", stream)
    with ProgressBars({"enrol": "enrolling"}) as bars:
        for done in (0, 5, 10):
            bars.show("enrol", done, 10)
    shown = stream.getvalue()
    assert all((words in shown) == terminal for words in ("enrolling", "100%", " a second"))
    assert bool(shown) == terminal
