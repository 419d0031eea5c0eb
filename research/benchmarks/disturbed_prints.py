"""Templates of a large gallery: sample prints, each disturbed in another way."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fpmatch.image.extract import extract
from fpmatch.templates.minutiae import Minutiae, Template

PRINTS = Path(__file__).parents[2] / "sample_data"
MINUTIAE = 40
SHIFT_PX = 12.0  # far enough for other neighbourhoods
TURN_RAD = 0.3


def sample_templates() -> list[Template]:
    """Return the templates of the sample prints."""
    return [extract(path) for path in sorted(PRINTS.glob("*.tif"))]


def disturbed(template: Template, *seed: int) -> Template:
    """Return a template with some of its minutiae, moved and turned as a seed says."""
    rng = np.random.default_rng(seed)
    m = template.minutiae
    chosen = m.take(rng.permutation(len(m))[:MINUTIAE])
    n = len(chosen)
    minutiae = Minutiae(
        x=np.clip(chosen.x + rng.normal(0, SHIFT_PX, n), 0, template.width - 1),
        y=np.clip(chosen.y + rng.normal(0, SHIFT_PX, n), 0, template.height - 1),
        angle=chosen.angle + rng.normal(0, TURN_RAD, n),
        kind=chosen.kind,
        quality=chosen.quality,
    )
    return Template(minutiae, template.width, template.height, template.dpi, template.field)
