"""Weights of a linear model of an image's features, and the JSON file that holds them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from fpmatch.base.parsing import parse_json
from fpmatch.errors import FpmatchError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from fpmatch.image.preprocess.arrays import Doubles


@dataclass(frozen=True, slots=True, eq=False)
class LinearWeights:
    """Name, middle, spread and weight of each feature, the bias, and their provenance."""

    names: tuple[str, ...]
    middle: Doubles
    spread: Doubles
    weight: Doubles
    bias: float
    provenance: Mapping[str, Any]

    def standardized(self, features: Doubles) -> Doubles:
        """Return features (..., N) in units of their spread about their middle."""
        return np.asarray((features - self.middle) / self.spread)

    def as_json(self) -> str:
        """Return the weights as the text of a JSON file."""
        numbers = np.column_stack([self.middle, self.spread, self.weight]).tolist()
        features = [
            {"name": name, "middle": middle, "spread": spread, "weight": weight}
            for name, (middle, spread, weight) in zip(self.names, numbers, strict=True)
        ]
        document = {"provenance": self.provenance, "bias": self.bias, "features": features}
        return f"{json.dumps(document, indent=1)}\n"

    @classmethod
    @cache
    def load(cls, path: Path, names: tuple[str, ...]) -> LinearWeights:
        """Read a file; raise FpmatchError unless it has weights of `names`."""
        try:
            document = parse_json(path.read_bytes())
            rows = document["features"]
            if tuple(row["name"] for row in rows) != names:
                raise FpmatchError(
                    "weights of other features than those of this version", path=path
                )
            keys = ("middle", "spread", "weight")
            middle, spread, weight = (np.array([float(row[k]) for row in rows]) for k in keys)
            bias, provenance = float(document["bias"]), document["provenance"]
        except (LookupError, TypeError, ValueError) as error:
            raise FpmatchError("not a file of weights", path=path) from error
        return cls(names, middle, spread, weight, bias, provenance)
