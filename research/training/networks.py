"""What the trainings of networks share: the learning rate, and the file that is written."""

from __future__ import annotations

from hashlib import sha256
from typing import TYPE_CHECKING

import click
import numpy as np
import torch

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from torch import nn


def warmed_up_cosine(
    optimiser: torch.optim.Optimizer, warm_up_steps: int, steps: int
) -> torch.optim.lr_scheduler.LRScheduler:
    """Return a schedule whose rate rises for some steps, and falls like a cosine."""
    return torch.optim.lr_scheduler.LambdaLR(
        optimiser,
        lambda step: min((step + 1) / warm_up_steps, 0.5 + 0.5 * np.cos(np.pi * step / steps)),
    )


def write_network(
    net: nn.Module,
    path: Path,
    example: torch.Tensor,
    names: tuple[str, str],
    any_size: Mapping[int, str],
    place: str,
) -> None:
    """Write a network as ONNX, and print the SHA-256 that the module at `place` states.

    `names`: of the input and of the output. `any_size`: the axes along which both may have any
    size, with a name for each.
    """
    torch.onnx.export(
        net.eval(),
        (example,),
        str(path),
        opset_version=11,
        input_names=[names[0]],
        output_names=[names[1]],
        dynamic_axes={name: {**any_size} for name in names},
        dynamo=False,
    )
    content = path.read_bytes()
    click.echo(f"{path}: {len(content)} bytes")
    click.echo(f"NETWORK_SHA256 of {place}: {sha256(content).hexdigest()}")
