"""The network that enhances ridges: its layers, and how it learns them.

A small U-Net of plain convolutions. It takes four by four pixels as the channels of one place, so
that it works at a quarter of the resolution and below, and hands out as many.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import click
import cv2
import numpy as np
import torch
from torch import nn

from fpmatch.image.enhancement.enhancers import NETWORK_FILE, PATCH_PX
from fpmatch.lab.synthesis.sensor import SENSORS
from research.commands import PATH, Command
from research.training.enhancer_data import STEPS_OF_TARGET, STEPS_PER_UNIT, make_pairs
from research.training.networks import warmed_up_cosine, write_network

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from research.training.enhancer_data import Pair


@dataclass(frozen=True, slots=True)
class LearningParameters:
    """Set how the network learns; lengths in pixels at 500 dpi."""

    steps: int = 14000
    batch: int = 10
    patch_px: int = 160
    on_print: float = 0.85  # share of the patches whose middle lies on the print
    zoom: tuple[float, float] = (0.8, 1.25)
    contrast: tuple[float, float] = (0.7, 1.2)
    off_print_weight: float = 0.3
    rate: float = 2e-3
    warm_up_steps: int = 300
    decay: float = 1e-4
    averaged: float = 0.998  # share of the running mean of the weights that a step keeps
    channels: tuple[int, int, int] = (32, 48, 64)


class RidgeNet(nn.Module):
    """Turn normalised pictures (B, 16, H/4, W/4) into logits of that shape.

    The sides H and W of the pictures are multiples of 16.
    """

    def __init__(self, channels: tuple[int, int, int]) -> None:
        super().__init__()
        a, b, c = channels
        self.at_four = _layer(PATCH_PX**2, a)
        self.at_eight = nn.Sequential(_layer(a, b, stride=2), _layer(b, b))
        self.at_sixteen = nn.Sequential(_layer(b, c, stride=2), _layer(c, c), _layer(c, c))
        self.to_eighth, self.back_at_eight = nn.Conv2d(c, b, 1), _layer(b, b)
        self.to_quarter, self.back_at_four = nn.Conv2d(b, a, 1), _layer(a, a)
        self.out = nn.Conv2d(a, PATCH_PX**2, 3, padding=1)

    def forward(self, patches: torch.Tensor) -> torch.Tensor:
        """Return the logits."""
        quarter = self.at_four(patches)
        eighth = self.at_eight(quarter)
        sixteenth = self.at_sixteen(eighth)
        eighth = self.back_at_eight(torch.relu(eighth + _doubled(self.to_eighth(sixteenth))))
        quarter = self.back_at_four(torch.relu(quarter + _doubled(self.to_quarter(eighth))))
        logits: torch.Tensor = self.out(quarter)
        return logits


def learn(
    pairs: Sequence[Pair],
    seed: int,
    parameters: LearningParameters,
    tell: Callable[[int, float, RidgeNet], None],
) -> RidgeNet:
    """Fit a network to the pairs; `tell` hears the step, the mean loss and the averaged network."""
    p = parameters
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    net, mean = RidgeNet(p.channels), RidgeNet(p.channels)
    mean.load_state_dict(net.state_dict())
    net = net.to(memory_format=torch.channels_last)
    optimiser = torch.optim.AdamW(net.parameters(), lr=p.rate, weight_decay=p.decay)
    schedule = warmed_up_cosine(optimiser, p.warm_up_steps, p.steps)
    running = 0.0
    for step in range(1, p.steps + 1):
        pixels, target, weight = _batch(pairs, rng, p)
        patches = nn.functional.pixel_unshuffle(pixels, PATCH_PX).contiguous()
        logits = nn.functional.pixel_shuffle(net(patches), PATCH_PX)
        losses = nn.functional.binary_cross_entropy_with_logits(logits, target, weight)
        optimiser.zero_grad(set_to_none=True)
        losses.backward()
        optimiser.step()
        schedule.step()
        keep = min(p.averaged, step / (step + 10))
        with torch.no_grad():
            for averaged, current in zip(mean.parameters(), net.parameters(), strict=True):
                averaged.lerp_(current, 1 - keep)
        running += (losses.item() - running) / min(step, 200)
        tell(step, running, mean)
    return mean.eval()


def _batch(
    pairs: Sequence[Pair], rng: np.random.Generator, p: LearningParameters
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Cut a batch of patches: pictures, targets in 0..1, and the weight of each pixel."""
    side = p.patch_px
    pictures = np.zeros((p.batch, 1, side, side), np.float32)
    reliefs = np.zeros_like(pictures)
    weights = np.zeros_like(pictures)
    for k in range(p.batch):
        pair = pairs[int(rng.integers(len(pairs)))]
        zoom = float(np.exp(rng.uniform(*np.log(p.zoom))))
        matrix = _cut(pair, rng, zoom, p)
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        turned = [
            cv2.warpAffine(layer.astype(np.float32), matrix, (side, side), flags=flags)
            for layer in (pair.picture, pair.relief, pair.inside)
        ]
        pictures[k, 0] = turned[0] * (rng.uniform(*p.contrast) / STEPS_PER_UNIT)
        reliefs[k, 0] = turned[1] / STEPS_OF_TARGET
        weights[k, 0] = p.off_print_weight + (1 - p.off_print_weight) * turned[2]
    return (
        torch.from_numpy(pictures).to(memory_format=torch.channels_last),
        torch.from_numpy((reliefs + 1) / 2),
        torch.from_numpy(weights),
    )


def _cut(
    pair: Pair, rng: np.random.Generator, zoom: float, p: LearningParameters
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Draw the place of a patch: the matrix (2, 3) from its pixels to the picture's pixels."""
    inside = pair.inside
    height, width = inside.shape
    y, x = int(rng.integers(height)), int(rng.integers(width))
    if rng.random() < p.on_print and inside.any():
        spots = np.flatnonzero(inside)
        y, x = divmod(int(spots[rng.integers(len(spots))]), width)
    turn = np.linalg.matrix_power(np.array([[0.0, -1.0], [1.0, 0.0]]), int(rng.integers(4)))
    turn = turn @ np.diag([rng.choice([-1.0, 1.0]), 1.0]) / zoom
    middle = (p.patch_px - 1) / 2
    return np.column_stack([turn, np.array([x, y]) - turn @ [middle, middle]])


def _layer(before: int, after: int, *, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(nn.Conv2d(before, after, 3, stride, 1), nn.ReLU(inplace=True))


def _doubled(values: torch.Tensor) -> torch.Tensor:
    return nn.functional.interpolate(values, scale_factor=2.0, mode="nearest")


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

    net = learn(pairs, seed, LearningParameters(steps=steps), report)
    example, place = torch.zeros(1, PATCH_PX**2, 16, 16), "fpmatch/image/enhancement/enhancers.py"
    write_network(net, into, example, ("normalised", "logits"), {2: "h", 3: "w"}, place)
