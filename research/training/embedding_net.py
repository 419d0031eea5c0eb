"""The network that makes the embedding of a print, and how it learns that on synthetic prints."""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from typing import TYPE_CHECKING, Final

import click
import numpy as np
import torch
from torch import nn

from fpmatch.gallery.index.embedding import CHANNELS, LENGTH, NETWORK_FILE, SIDE, pictures
from fpmatch.lab.synthesis.sensor import SENSORS
from fpmatch.matching.matchers.unit_circle import MATCHER
from research.commands import PATH, Command
from research.templates.making import make_templates
from research.training.networks import warmed_up_cosine, write_network

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

LARGE: Final = 48  # side of the pictures from which views are cut


@dataclass(frozen=True, slots=True)
class LearningParameters:
    """Set how the network learns."""

    steps: int = 5000
    batch: int = 256  # fingers
    turn: float = 0.25  # radians: standard deviation of the rotation of a view,
    shift: float = 1.0  # and of its shift, in cells
    cut: float = 0.5  # share of the views that lack what lies beyond a line
    without_ridges: float = 0.1  # share of the pairs of views without ridge orientation
    lost: float = 0.15  # share of the cells whose minutiae are lost
    rate: float = 2e-3
    warm_up_steps: int = 100
    decay: float = 0.05
    channels: tuple[int, int, int] = (24, 48, 64)


class EmbeddingNet(nn.Module):
    """Turn pictures (B, 6, 32, 32) into embeddings (B, 128) of any length."""

    def __init__(self, channels: tuple[int, int, int]) -> None:
        super().__init__()
        a, b, c = channels
        layers = (_layer(CHANNELS, a, 2), _layer(a, b, 2), _layer(b, c, 2), _layer(c, c, 1))
        self.layers = nn.Sequential(*layers)
        self.head = nn.Linear(c * (SIDE // 8) ** 2, LENGTH)

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        """Return the embeddings."""
        made: torch.Tensor = self.head(self.layers(pictures).flatten(1))
        return made


def _layer(before: int, after: int, stride: int) -> nn.Sequential:
    convolution = nn.Conv2d(before, after, 3, stride, 1, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(after), nn.ReLU(inplace=True))


def views(shown: torch.Tensor, p: LearningParameters, draw: torch.Generator) -> torch.Tensor:
    """Return views (B, 6, 32, 32) of large pictures: parts, turned and shifted."""
    many = len(shown)
    normal = partial(torch.randn, generator=draw)
    uniform = partial(torch.rand, generator=draw)
    at = torch.arange(LARGE) - (LARGE - 1) / 2
    row, column = at[:, None].expand(LARGE, LARGE), at.expand(LARGE, LARGE)
    # a line at some distance from the middle, beyond which nothing is seen
    turn = 2 * torch.pi * uniform(many)
    distance = torch.where(uniform(many) < p.cut, 10 * uniform(many), 1e3)
    along = torch.cos(turn)[:, None, None] * column + torch.sin(turn)[:, None, None] * row
    seen = (along < distance[:, None, None]).float()
    area = (shown[:, 2] * seen) + 1e-6
    middle = [(area * place).sum((1, 2)) / area.sum((1, 2)) for place in (column, row)]
    shown = shown * seen[:, None]
    kept = (uniform(many, 1, LARGE, LARGE) >= p.lost).float()
    shown = torch.cat([shown[:, :3], shown[:, 3:] * kept], 1)
    turn = p.turn * normal(many)
    cosine, sine = torch.cos(turn), torch.sin(turn)
    scale = SIDE / LARGE
    moved = [
        (middle[k] + p.shift * normal(many)) * (2 / LARGE) for k in range(2)
    ]  # of the place that the middle of the view shows
    matrix = torch.stack(
        [
            torch.stack([scale * cosine, -scale * sine, moved[0]], 1),
            torch.stack([scale * sine, scale * cosine, moved[1]], 1),
        ],
        1,
    )
    grid = nn.functional.affine_grid(matrix, (many, CHANNELS, SIDE, SIDE), align_corners=False)
    cut = nn.functional.grid_sample(shown, grid, align_corners=False)
    # rows point down: a view that is turned clockwise shows directions turned against it
    doubled = torch.cos(2 * turn), torch.sin(2 * turn)
    parts = [_turned(cut[:, :2], *doubled), cut[:, 2:3], _turned(cut[:, 3:5], cosine, sine)]
    return torch.cat([*parts, cut[:, 5:]], 1)


def _turned(vectors: torch.Tensor, cosine: torch.Tensor, sine: torch.Tensor) -> torch.Tensor:
    c, s = cosine[:, None, None], sine[:, None, None]
    x, y = vectors[:, 0], vectors[:, 1]
    return torch.stack([c * x - s * y, s * x + c * y], 1)


def learn(
    pictures: np.ndarray,
    seed: int,
    p: LearningParameters,
    tell: Callable[[int, float], None],
) -> EmbeddingNet:
    """Fit a network to large pictures (F, 2, 6, 48, 48), two of each finger."""
    torch.manual_seed(seed)
    draw = torch.Generator().manual_seed(seed)
    net, given = EmbeddingNet(p.channels), torch.from_numpy(pictures)
    sharpness = nn.Parameter(torch.tensor(2.5))
    weights = [*net.parameters(), sharpness]
    optimiser = torch.optim.AdamW(weights, lr=p.rate, weight_decay=p.decay)
    schedule = warmed_up_cosine(optimiser, p.warm_up_steps, p.steps)
    batch = min(p.batch, len(given))
    own = torch.arange(batch)
    running = 0.0
    for step in range(1, p.steps + 1):
        which = torch.randperm(len(given), generator=draw)[:batch]
        shown = [given[which, k].float() for k in range(2)]
        without = (torch.rand(batch, 1, 1, 1, generator=draw) < p.without_ridges).float()
        for each in shown:
            each[:, :2] *= 1 - without
        made = net(torch.cat([views(each, p, draw) for each in shown]))
        first, second = nn.functional.normalize(made, dim=1).split(batch)
        similarity = first @ second.T * sharpness.exp()
        losses = [nn.functional.cross_entropy(each, own) for each in (similarity, similarity.T)]
        loss = 0.5 * (losses[0] + losses[1])
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        optimiser.step()
        schedule.step()
        running += (loss.item() - running) / min(step, 100)
        tell(step, running)
    net.eval()
    return net


def _pictures(seed: int, finger: int) -> np.ndarray:
    """Return two large pictures of a synthetic finger, (2, 6, 48, 48)."""
    sensor = sorted(SENSORS)[finger % len(SENSORS)]
    made = [MATCHER.prepare(t) for t in make_templates(seed, [finger], 2, sensors=(sensor,))]
    first, second = made[0], made[-1]
    return pictures([first, second], LARGE).astype(np.float16)


REPORT_EVERY: Final = 100  # steps


@click.command(cls=Command)
@click.option("--seed", default=5001, show_default=True, help="Of the prints and the network.")
@click.option("--fingers", default=24_000, show_default=True, help="Synthetic fingers.")
@click.option(
    "--steps", default=LearningParameters().steps, show_default=True, help="Of the optimiser."
)
@click.option("--workers", type=int, default=os.cpu_count(), help="Processes that make prints.")
@click.option("--into", type=PATH, default=NETWORK_FILE, help="File to write.")
def command(seed: int, fingers: int, steps: int, workers: int, into: Path) -> None:
    """Train the network that makes the embeddings of prints, on synthetic prints alone.

    Of two views of each finger, it learns which belong together. The same seed on the same kind of
    machine gives the same file to the last bit. The file in the package was made with the defaults,
    in about 40 minutes on one core. The extra ``train`` must be installed.
    """
    torch.use_deterministic_algorithms(mode=True)
    torch.set_num_threads(1)  # sums do not depend on the number of cores
    pictures = np.empty((fingers, 2, CHANNELS, LARGE, LARGE), np.float16)
    with get_context("spawn").Pool(workers) as pool:
        made = pool.imap(partial(_pictures, seed), range(fingers), chunksize=32)
        with click.progressbar(made, length=fingers, label="prints", file=sys.stderr) as counted:
            for k, two in enumerate(counted):
                pictures[k] = two
    start = time.monotonic()

    def report(step: int, loss: float) -> None:
        if step % REPORT_EVERY == 0:
            click.echo(f"{step} of {steps}: loss {loss:.4f}, {time.monotonic() - start:.0f} s")

    net = learn(pictures, seed, LearningParameters(steps=steps), report)
    example, place = torch.zeros(1, CHANNELS, SIDE, SIDE), "fpmatch/gallery/index/embedding.py"
    write_network(net, into, example, ("pictures", "embeddings"), {0: "prints"}, place)
