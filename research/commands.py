"""The command ``python -m research``, and the options that its sub-commands share."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.base.output import atomic_write_bytes, check_writable, reason
from fpmatch.cli.notes import say_kernels
from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Mapping

EXIT_ERROR: Final = 2
ROOT: Final = Path(__file__).resolve().parents[1]
PATH: Final = click.Path(path_type=Path)

folders = click.argument("folders", metavar="DIR...", nargs=-1, required=True, type=PATH)
workers = click.option(
    "--workers", type=click.IntRange(1), help="Processes to use.  [default: one a core]"
)
json_file = click.option(
    "--json", "json_file", metavar="FILE", type=PATH, help="Write the results to this file."
)
synthetic_folder = click.option(
    "--prints", metavar="FOLDER", type=PATH, help="Keep the synthetic prints in this folder."
)


def read_json(path: Path) -> Any:
    """Read a JSON file."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FpmatchError(f"{path}: cannot be read: {reason(error)}") from error
    except ValueError as error:
        raise FpmatchError(f"{path}: not a JSON file") from error


def write_json(path: Path, document: object) -> None:
    """Write a document as JSON."""
    content = json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False)
    atomic_write_bytes(path, f"{content}\n".encode(), public=True)


def print_and_write(text: str, document: object, json_file: Path | None) -> None:
    """Print what a command measured, and write it where `json_file` says."""
    click.echo(text)
    if json_file:
        write_json(json_file, document)


class Command(click.Command):
    """A command whose errors are one line on stderr, with exit status 2.

    Before the command does its work, it notes kernels that are out of date, and checks that the
    file of `json_file` can be written.
    """

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        say_kernels()
        try:
            if ctx.params.get("json_file") is not None:
                check_writable(ctx.params["json_file"])
            return super().invoke(ctx)
        except (FpmatchError, OSError) as error:
            line = " ".join(str(error).split())
            click.echo(f"{ctx.command_path}: error: {line}", err=True)
            ctx.exit(EXIT_ERROR)


class LazyGroup(click.Group):
    """Import a sub-command when it runs.

    `modules`: for each sub-command its module, which defines it as ``command``, and a summary.
    `**attrs`: what `click.Group` takes.
    """

    def __init__(self, *, modules: Mapping[str, tuple[str, str]], **attrs: Any) -> None:
        super().__init__(**attrs)
        self._modules = modules

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names, those of eager sub-commands last."""
        return [*self._modules, *super().list_commands(ctx)]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a sub-command."""
        if cmd_name not in self._modules:
            return super().get_command(ctx, cmd_name)
        try:
            module = import_module(f"research.{self._modules[cmd_name][0]}")
        except ModuleNotFoundError as error:
            needed = f"{cmd_name} needs {error.name}, of the extra `train` or `bench`"
            click.echo(f"{ctx.command_path}: error: {needed}", err=True)
            ctx.exit(EXIT_ERROR)
        command: click.Command = module.command
        command.name = cmd_name
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the summaries."""
        rows = [(name, summary) for name, (_, summary) in self._modules.items()]
        rows += [(name, one.get_short_help_str(90)) for name, one in self.commands.items()]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


research = LazyGroup(
    name="research",
    help="Train, measure and check fpmatch, and write its documentation's tables and figures.",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Run from the repository's root. Exit status: 0 done, 1 a check failed, 2 bad input.",
    modules={
        "tables": ("tables", "Write measured results into README and docs."),
        "outputs": ("outputs", "Write what commands print into README and docs."),
        "notebook": ("notebook", "Run the notebook of the examples, and store its outputs."),
        "figures": ("figures.documentation", "Draw the figures of the documentation."),
        "sample-data": ("figures.sample_data", "Make the prints and points of sample_data."),
        "calibrate": ("training.calibrate", "Fit the package's calibrations."),
        "fuzz": ("fuzzing.command", "Feed damaged files, requests and arrays to every reader."),
    },
)
research.add_command(
    LazyGroup(
        name="train",
        help="Train a model of the package on synthetic prints.",
        modules={
            "score": ("training.score", "Weights of the default matcher's score."),
            "quality": ("training.quality", "Weights of the quality of prints."),
            "enhancer": ("training.enhancer_net", "The network that enhances ridges."),
            "embedding": ("training.embedding_net", "The network that makes embeddings of prints."),
            "index": ("training.index", "The index of large galleries."),
            "tail": ("training.impostor_pairs", "Pairs for the highest scores of calibrations."),
        },
    )
)
research.add_command(
    LazyGroup(
        name="measure",
        help="Measure what a table of the documentation shows.",
        modules={
            "points": ("points.command", "The paper's experiment on random point sets."),
            "decision": ("points.decision", "Prints that match by the paper's rule."),
        },
    )
)
research.add_command(
    LazyGroup(
        name="check",
        help="Check a property of the package on data.",
        modules={
            "polarity": ("checks.polarity", "Detection of inverted images."),
            "resolution": ("checks.resolution", "Detection of wrong resolutions."),
            "rolled": ("checks.rolled", "Rolled prints against flat ones."),
            "truth": ("ground_truth", "Minutiae and transforms of synthetic prints."),
        },
    )
)
