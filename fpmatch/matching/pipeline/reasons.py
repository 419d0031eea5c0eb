"""The reasons why two prints do not match, as texts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from fpmatch.matching.pipeline.evidence import main_reason
from fpmatch.printable import count

if TYPE_CHECKING:
    from fpmatch.matching.pipeline.evidence import Evidence
    from fpmatch.matching.prints.prepared import PreparedTemplate


POOR_MINUTIAE: Final = 0.4  # mean quality of a print's minutiae, 0 to 1
COMPETING_SHARE: Final = 0.75  # of the pairs of the best transform, that a competing one has


def all_reasons(
    probe: PreparedTemplate, reference: PreparedTemplate, evidence: Evidence, competing: int = 0
) -> str:
    """Return the reasons against one finger in one line, the main one first.

    The evidence is that under the best transform; `competing_pairs` counts those of another.
    """
    parts = [main_reason(evidence)]
    if 0 < COMPETING_SHARE * evidence.pairs <= competing:
        parts.append(
            f"another, very different transform pairs {count(competing, 'minutia', 'minutiae')}: "
            "the alignment is ambiguous"
        )
    for name, side in (("probe", probe), ("reference", reference)):
        mean = float(side.quality.mean())
        if mean < POOR_MINUTIAE:
            parts.append(f"the minutiae of the {name} are poor (mean quality {100 * mean:.0f})")
    return "; ".join(parts)
