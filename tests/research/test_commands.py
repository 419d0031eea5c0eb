"""`research.commands`: what all commands of research and benchmarks do alike."""

import click
from click.testing import CliRunner

from research.commands import Command, json_file, write_json


def test_a_file_of_results_is_checked_before_they_are_measured(tmp_path):
    measured = []

    @click.command(cls=Command)
    @json_file
    def measure(json_file):
        measured.append(json_file)
        if json_file is not None:
            write_json(json_file, {"rate": 0.5})

    def run(*words):
        return CliRunner().invoke(measure, [*map(str, words)], prog_name="measure")

    refused = run("--json", "/dev/null/r.json")
    assert (refused.exit_code, measured, refused.stdout) == (2, [], "")
    assert refused.stderr.startswith("measure: error: ")
    assert refused.stderr.count("\n") == 1
    written = tmp_path / "r.json"
    assert [run().exit_code, run("--json", written).exit_code] == [0, 0]
    assert measured == [None, written]
    assert written.read_text() == '{\n "rate": 0.5\n}\n'
