"""Help texts: what each lists, and which options commands share."""

import click
import pytest

from fpmatch.cli.command import GROUPS
from fpmatch.cli.group import fpmatch as main
from tests.conftest import leaves

HELP = {"-h", "--help", "--help-all"}
COMMANDS = list(leaves(main))


def command_of(words):
    context, command = click.Context(main), main
    for word in words.split():
        command = command.get_command(context, word)
    return command


def options_of(words):
    of = [one for one in command_of(words).params if isinstance(one, click.Option)]
    return [one for one in of if not HELP & {*one.opts}]


@pytest.mark.parametrize("words", COMMANDS)
def test_rare_options_are_in_the_whole_help_alone(run, words):
    short, whole = (run(*words.split(), f"--help{which}").stdout for which in ("", "-all"))
    for one in options_of(words):
        listed = f"\n  {', '.join(one.opts)}"
        assert listed in whole
        assert (listed in short) is not one.hidden
    for line in command_of(words).details.replace("\b", "").split("\n\n"):
        assert " ".join(line.split()) in " ".join(whole.split())
    assert len(short) <= len(whole)


@pytest.mark.parametrize("words", COMMANDS)
def test_commands_that_read_prints_have_the_same_options(words):
    names = {one.name for one in options_of(words)}
    reading = {"dpi", "polarity", "raw"}
    assert not reading & names or reading <= names or words == "synth"


def test_groups_name_options_that_exist():
    names = {one.name for words in COMMANDS for one in options_of(words)}
    assert {name for of in GROUPS.values() for name in of} <= names
