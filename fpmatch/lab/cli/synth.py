"""`fpmatch synth`: databases of synthetic prints with ground truth."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import show
from fpmatch.cli.options import json_option
from fpmatch.cli.progress import ProgressBars
from fpmatch.gallery.cli.options import workers_option
from fpmatch.lab.synthesis.presets import PRESETS
from fpmatch.lab.synthesis.sensor import DEFAULT_SENSOR, SENSORS
from fpmatch.printable import count, json_text, printable


@click.command(
    cls=Command,
    details="""\b
Presets:
  clean      straight, evenly pressed, nothing smeared: every ridge is visible
  easy       rotated a little, small scratches and spots
  normal     as in the FVC sets: rotated, stretched, partly outside, dry or damp, worn
  hard       more of all that, and smeared
  stretched  as normal, the skin twisted and dragged as far as it goes
  rolled     rolled from nail to nail; best with the sensor of that name

\b
Sensors:
  optical-388x374     as FVC2002 DB1: white ground, 500 dpi
  optical-296x560     as FVC2002 DB2: grey ground, dark corners, residue, 569 dpi
  capacitive-300x300  as FVC2002 DB3: dark ground, striped, 500 dpi
  plain-288x384       as FVC2002 DB4: light grey ground, 500 dpi
  optical-640x480     as FVC2004 DB1: large, white ground, 500 dpi
  optical-328x364     as FVC2004 DB2: soft, upper corners cut off, 500 dpi
  rolled-512x512      ink on a card with lines, words and handwriting, 500 dpi

\b
Files:
  FFF_M.tif       impression M of finger FFF, from 101 on, with its resolution
  dataset.toml    name, dpi, sensor, and what the prints were made from
  truth/FFF.json  the finger's class and minutiae; of each impression its minutiae, the transform
                  from the finger and how its skin stretched beyond that
""",
    epilog="""\b
Examples:
  fpmatch synth prints
  fpmatch synth prints --fingers 100 --impressions 8 --preset normal --seed 7
  fpmatch synth prints --sensor optical-388x374 --sensor capacitive-300x300
""",
)
@click.argument("out", type=click.Path(path_type=Path))
@click.option("--fingers", metavar="N", type=int, default=10, help="How many.")
@click.option("--impressions", metavar="M", type=int, default=8, help="Of each finger.")
@click.option(
    "--preset",
    type=click.Choice(list(PRESETS)),
    default="normal",
    help="How carefully fingers are placed on the sensor.",
)
@click.option("--seed", type=int, default=0, help="Another seed gives other fingers.")
@click.option(
    "--sensor",
    "sensors",
    metavar="NAME",
    type=click.Choice(list(SENSORS)),
    multiple=True,
    default=[DEFAULT_SENSOR],
    help="What takes the impressions; several take them in turn.",
)
@workers_option
@json_option
def synth(out: Path, preset: str, sensors: tuple[str, ...], as_json: bool, **plan: Any) -> None:
    """Make a database of synthetic fingerprints in the folder OUT.

    No person's finger is among them. The same options give the same files, to the last byte; a run
    that was interrupted goes on where it stopped, and more fingers may be added later. Files that
    are not its own are never overwritten.
    """
    from fpmatch.lab.synthesis.database import make_database

    plan |= {"preset": PRESETS[preset], "sensors": [SENSORS[name] for name in sensors]}
    start = time.perf_counter()
    with ProgressBars({"synth": "making fingers"}) as bars:
        made = make_database(out, progress=bars.show, **plan)
    seconds = time.perf_counter() - start
    document = asdict(made) | {"folder": str(made.folder), "seconds": round(seconds, 3)}
    pictures = made.made * made.impressions
    done = f"{count(pictures, 'picture')} in {seconds:.1f} s, {pictures / seconds:.1f} a second"
    there = f"{count(made.fingers, 'finger')} x {count(made.impressions, 'impression')}"
    there += f" in {printable(made.folder)}"
    show(json_text(document) if as_json else f"{there}: {done if pictures else 'nothing to do'}")
