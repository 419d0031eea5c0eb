"""The command ``notebook``: what the notebook of the examples shows, stored in it."""

from __future__ import annotations

import base64
import io
import json
import re
from copy import deepcopy
from typing import TYPE_CHECKING, Any, Final

import click
import numpy as np
from PIL import Image

from fpmatch.base.output import atomic_write_bytes
from research.commands import ROOT, Command
from research.figures.documentation import small_png

if TYPE_CHECKING:
    from collections.abc import Iterator

NOTEBOOK: Final = ROOT / "examples" / "quick_tour.ipynb"
LONGEST_S: Final = 300  # of a cell
_TIME: Final = re.compile(r"\d[\d.,]* (?:s|ms|µs)\b")
_NUMBER: Final = re.compile(r"\d+\.\d+(?:e[+-]\d+)?")
_PICTURE: Final = re.compile(r"(?<=;base64,)[\w+/=]+")


def executed(notebook: str) -> str:
    """Run a notebook from the top, in the folder of the examples; return it as it is stored."""
    import nbformat  # noqa: PLC0415  (of the extra `test`)
    from nbclient import NotebookClient  # noqa: PLC0415

    document = nbformat.reads(notebook, 4)
    about = deepcopy(document.metadata)
    client = NotebookClient(document, timeout=LONGEST_S, record_timing=False)
    client.execute(cwd=str(NOTEBOOK.parent))
    document.metadata = about
    for data in (one.get("data", {}) for cell in document.cells for one in cell.get("outputs", ())):
        if "image/png" in data:
            picture = Image.open(io.BytesIO(base64.b64decode(data["image/png"]))).convert("RGB")
            data["image/png"] = base64.b64encode(small_png(np.asarray(picture))).decode()
    return f"{nbformat.writes(document)}\n"


def shown(notebook: str) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return the source of each cell of code, and what it shows as (type, text), comparable."""
    cells = [cell for cell in json.loads(notebook)["cells"] if cell["cell_type"] == "code"]
    return [("".join(cell["source"]), [*_contents(cell["outputs"])]) for cell in cells]


def _contents(outputs: list[dict[str, Any]]) -> Iterator[tuple[str, str]]:
    for output in outputs:
        for kind, content in output.get("data", {output.get("name"): output.get("text")}).items():
            yield kind, "" if kind.startswith("image/") else _comparable("".join(content))


def _comparable(text: str) -> str:
    lasting = _TIME.sub("", _PICTURE.sub("", text))
    return " ".join(_NUMBER.sub(lambda found: f"{float(found[0]):.3g}", lasting).split())


@click.command(cls=Command)
@click.option("--check", is_flag=True, help="Compare what is stored; write nothing.")
@click.pass_context
def command(context: click.Context, check: bool) -> None:
    """Run examples/quick_tour.ipynb, and store in it what it shows.

    Times and pixels are not compared, and written only where the rest differs. --check ends with
    exit status 1 where what is stored differs.
    """
    stored = NOTEBOOK.read_text(encoding="utf-8")
    found = executed(stored)
    if shown(found) == shown(stored):
        return
    if not check:
        atomic_write_bytes(NOTEBOOK, found.encode("utf-8"), public=True)
    click.echo(f"{NOTEBOOK.relative_to(ROOT).as_posix()}: {'differs' if check else 'written'}")
    context.exit(1 if check else 0)
