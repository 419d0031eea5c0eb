"""The command that trains the network that enhances ridges."""

from __future__ import annotations

import os
import sys
import time
from hashlib import sha256
from typing import TYPE_CHECKING, Final

import click
import torch

from fpmatch.image.enhancement.enhancers import NETWORK_FILE
from fpmatch.lab.synthesis.sensor import SENSORS
from research.commands import PATH, Command
from research.training.enhancer_data import make_pairs
from research.training.enhancer_net import LearningParameters, learn, write_network

if TYPE_CHECKING:
    from pathlib import Path

    from research.training.enhancer_net import RidgeNet

STEPS: Final = LearningParameters().steps
REPORT_EVERY: Final = 200  # steps


@click.command(cls=Command)
@click.option("--seed", default=4001, show_default=True, help="Of the prints and the network.")
@click.option("--fingers", default=480, show_default=True, help="Synthetic fingers.")
@click.option("--steps", default=STEPS, show_default=True, help="Steps of the optimiser.")
@click.option("--workers", type=int, default=os.cpu_count(), help="Processes that make prints.")
@click.option("--into", type=PATH, default=NETWORK_FILE, help="File to write.")
def command(seed: int, fingers: int, steps: int, workers: int, into: Path) -> None:
    """Train the network that enhances ridges, on synthetic prints alone.

    It learns to predict the relief of the finger that a print was made of. The same seed on the
    same kind of machine gives the same file to the last bit. The defaults are those of the file in
    the package and take about an hour on two cores. The extra ``train`` must be installed.
    """
    torch.use_deterministic_algorithms(mode=True)
    torch.set_num_threads(1)  # sums do not depend on the number of cores
    made = make_pairs(seed, fingers, workers)
    with click.progressbar(
        made, length=fingers * len(SENSORS), label="prints", file=sys.stderr
    ) as counted:
        pairs = list(counted)
    start = time.monotonic()

    def report(step: int, loss: float, _: RidgeNet) -> None:
        if step % REPORT_EVERY == 0:
            click.echo(f"{step} of {steps}: loss {loss:.4f}, {time.monotonic() - start:.0f} s")

    write_network(learn(pairs, seed, LearningParameters(steps=steps), report), into)
    content = into.read_bytes()
    click.echo(f"{into}: {len(content)} bytes")
    digest = sha256(content).hexdigest()
    click.echo(f"NETWORK_SHA256 of fpmatch/image/enhancement/enhancers.py: {digest}")
