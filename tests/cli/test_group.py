"""`fpmatch` itself: its help, its errors on one line, its exit statuses."""

import importlib
import io
import os
import signal
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest
from PIL import Image

from fpmatch.cli.command import GROUPS
from fpmatch.cli.group import COMMANDS
from fpmatch.cli.group import fpmatch as main
from fpmatch.cli.progress import ProgressBars
from fpmatch.errors import FpmatchError
from tests.conftest import assert_refused, leaves

SUMMARIES = {name: text for of in COMMANDS.values() for name, text in of.items()}
FPMATCH = [sys.executable, "-m", "fpmatch"]


@pytest.mark.parametrize("command", sorted({*SUMMARIES, *leaves(main)}))
def test_every_command_has_help_with_examples(run, command):
    result = run(*command.split(), "--help")
    assert result.exit_code == 0
    assert f"Usage: fpmatch {command} [OPTIONS]" in result.output
    assert f"  fpmatch {command} " in result.output.split("Example")[1]


WRONG_USAGE = {
    "": "verifie | evaluate | points p.csv",
    "verify": "only-one.png | a b --dpi many | a b --polarity grey | a b --view ridges | "
    "a --gallery g | a a --gallery g --subject 1 | a --gallery g --subject 1 --overlay o.png",
    "convert a b": "--size 300 | --size 0x5",
    "evaluate x": "--workers 0 | --protocol all | --enhance gabor | --fmr 0",
    "rates": "--fmr 0.1 | s.csv --matcher paper | s.csv --fmr 0 | --genuine-scores g.txt",
    "gallery": "remove x | list x --failures --subject 1 | list x --summary --failures | "
    "audit verify x --expect one 1",
    "identify x y": "--effort 3 | --effort few",
    "score --references x --probes y -o z": "--scheduler u --workers 2 | --workers 0",
    "extract a -o b": "--enhance gabor | --subject 1",
    "synth x": "--preset wet | --sensor wet | --fingers many",
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
        ("points a b --matcher triangle", "'triangles'"),
        ("zzz", "Error: No such command 'zzz'.\n"),
    ],
)
def test_the_closest_name_is_suggested(run, words, suggestion):
    result = run(*words.split())
    assert (result.exit_code, suggestion in result.stderr.split("ean ")[-1]) == (2, True)


def test_errors_are_one_line_interrupts_are_quiet_and_faults_are_not_hidden(run, monkeypatch):
    def failing(error):
        def fail(**_):
            raise error

        monkeypatch.setattr(importlib.import_module("fpmatch.cli.doctor").doctor, "callback", fail)
        return run("doctor")

    assert_refused(failing(FpmatchError("odd\nname.png: no such file")), "odd\\nname.png: no such")
    interrupted = failing(KeyboardInterrupt())
    assert (interrupted.exit_code, interrupted.output) == (130, "")
    assert isinstance(failing(ZeroDivisionError()).exception, ZeroDivisionError)


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


def test_numpy_starts_no_threads_in_a_command():
    program = (
        "import atexit, os; from fpmatch.cli import main\n"
        "atexit.register(lambda: print(os.environ['OPENBLAS_NUM_THREADS']))\n"
        "main(['--version'])"
    )
    assert start([sys.executable, "-c", program]).stdout.splitlines()[-1] == "1"


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
        ("fpmatch verify --json --view o", ["overlay"]),
        ("fpmatch rates --gen", ["--genuine-scores"]),
    ):
        monkeypatch.setenv("COMP_WORDS", words)
        monkeypatch.setenv("COMP_CWORD", str(len(words.split(" ")) - 1))
        with pytest.raises(SystemExit):
            main(prog_name="fpmatch")
        lines = capsys.readouterr().out.split()
        assert [line.removeprefix("plain,") for line in lines] == completed


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full here")
def test_output_that_cannot_be_written_is_one_line_and_status_2():
    points = Path(__file__).parents[2] / "sample_data" / "stars.csv"
    with Path("/dev/full").open("w") as full:
        done = start([*FPMATCH, "points", str(points), str(points)], stdout=full)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert done.stderr.startswith("fpmatch: error: output: ")


@pytest.mark.parametrize("terminal", [True, False])
def test_a_bar_has_stage_share_and_text_on_a_terminal(monkeypatch, terminal):
    stream = io.StringIO()
    stream.isatty = lambda: terminal
    monkeypatch.setattr(sys, "stderr", stream)
    with ProgressBars({"enrol": "enrolling"}) as bars:
        for done in (0, 5, 10):
            bars.show("enrol", done, 10, f"{done} prints")
    shown = stream.getvalue()
    assert all((words in shown) == terminal for words in ("enrolling", "100%", "10 prints"))


HELP = {"-h", "--help", "--help-all"}
LEAVES = list(leaves(main))


def command_of(words):
    context, command = click.Context(main), main
    for word in words.split():
        command = command.get_command(context, word)
    return command


def options_of(words):
    of = [one for one in command_of(words).params if isinstance(one, click.Option)]
    return [one for one in of if not HELP & {*one.opts}]


@pytest.mark.parametrize("words", LEAVES)
def test_rare_options_are_in_the_whole_help_alone(run, words):
    short, whole = (run(*words.split(), f"--help{which}").stdout for which in ("", "-all"))
    for one in options_of(words):
        listed = f"\n  {', '.join(one.opts)}"
        assert listed in whole
        assert (listed in short) is not one.hidden
    for line in command_of(words).details.replace("\b", "").split("\n\n"):
        assert " ".join(line.split()) in " ".join(whole.split())
    assert len(short) <= len(whole)


def test_groups_name_options_that_exist():
    names = {one.name for words in LEAVES for one in options_of(words)}
    assert {name for of in GROUPS.values() for name in of} <= names
