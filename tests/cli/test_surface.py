"""The surface of the command line: how many commands and options, how long their help."""

import click
import pytest

from fpmatch.cli.command import GROUPS, RENAMED
from fpmatch.cli.group import fpmatch as main
from fpmatch.cli.wings import registered
from tests.conftest import assert_refused, leaves

MOST_COMMANDS = 24
MOST_OPTIONS_SHOWN = 190
MOST_LINES = 45
HELP = {"-h", "--help", "--help-all"}
COMMANDS = list(leaves(main))
GROUPS_OF_COMMANDS = sorted({words.rpartition(" ")[0] for words in COMMANDS} - {""})
OLD = RENAMED | {old: new for wing in registered().values() for old, new in wing.renamed.items()}


def command_of(words):
    context, command = click.Context(main), main
    for word in words.split():
        command = command.get_command(context, word)
    return command


def options_of(words):
    of = [one for one in command_of(words).params if isinstance(one, click.Option)]
    return [one for one in of if not HELP & {*one.opts}]


def test_the_commands_and_the_options_that_are_shown_are_few():
    assert len(COMMANDS) <= MOST_COMMANDS
    shown = [one for words in COMMANDS for one in options_of(words) if not one.hidden]
    assert len(shown) <= MOST_OPTIONS_SHOWN


@pytest.mark.parametrize("words", ["", *GROUPS_OF_COMMANDS, *COMMANDS])
def test_help_is_short(run, words):
    text = run(*words.split(), "--help", terminal_width=78).stdout  # of 80 columns
    assert len(text.splitlines()) <= MOST_LINES


@pytest.mark.parametrize("words", GROUPS_OF_COMMANDS)
def test_lists_of_commands_contain_whole_sentences(run, words):
    summaries = command_of(words).summaries(click.Context(main))
    assert all(text.endswith(".") for text in summaries.values())
    shown = " ".join(run(*words.split(), "--help").stdout.split())
    assert all(f" {name} {text} " in shown for name, text in summaries.items())


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


@pytest.mark.parametrize("old", OLD)
def test_an_old_spelling_is_answered_with_the_new_one(run, old):
    assert_refused(run(*old.split(), "a", "b", "c"), f"{old} is now {OLD[old]}")


@pytest.mark.parametrize("old", OLD)
def test_what_old_spellings_are_now_exists(old):
    if old in {"points bench", "revocable"}:  # now commands of the sources
        return
    words = OLD[old].split()
    command = main
    while isinstance(command, click.Group):
        command = command.get_command(click.Context(command), words.pop(0))
    known = {opt for one in command.params for opt in one.opts}
    assert {word for word in words if word.startswith("--")} <= known


@pytest.mark.parametrize("words", ["identify --shortlist=3", "gallery audit /x/prints.db --verify"])
def test_an_old_spelling_is_answered_wherever_it_stands(run, words):
    result = run(*words.split())
    assert result.exit_code == 2
    assert " is now " in result.stderr
