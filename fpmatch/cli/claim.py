"""What `verify --gallery` does: the check of a claimed identity."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.pair import PairOptions, chosen_threshold
from fpmatch.cli.prints import open_print
from fpmatch.cli.resolution import ResolutionChoice

if TYPE_CHECKING:
    from collections.abc import Mapping

_OF_TWO_FILES: Final = ("reference", "reference_dpi", "rho", "area_tolerance")


def check(
    gallery: str | None,
    subject: str | None,
    finger: str | None,
    values: Mapping[str, Any],
    *,
    as_json: bool,
) -> int:
    """Compare a probe with what is enrolled of a subject, print the decision, return the status.

    Parameters
    ----------
    gallery, subject, finger : str or None
        What the command line says of the claim.
    values : mapping
        What it says of the comparison, see `PairOptions`.
    as_json : bool
        Whether to print one JSON object.

    Raises
    ------
    FpmatchError
        If the probe or the gallery cannot be read, or nothing of the subject is enrolled.
    """
    if gallery is None or subject is None:
        raise click.UsageError("--gallery and --subject go together")
    for name in _OF_TWO_FILES:
        if values[name] is not None:
            called = name.upper() if name == "reference" else f"--{name.replace('_', '-')}"
            raise click.UsageError(f"{called} does not go with --gallery")
    options = PairOptions(**values)
    from fpmatch.gallery.claim import check_claim
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.matching.calibration import load_calibration
    from fpmatch.matching.verify import DEFAULT_THRESHOLD
    from fpmatch.report import LABEL_WIDTH, as_dict, as_text

    threshold = chosen_threshold(options)
    calibration = load_calibration(options.matcher, options.calibration)
    dpi = options.dpi if options.probe_dpi is None else options.probe_dpi
    with open_gallery(gallery) as opened:
        probe = open_print(options.probe, ResolutionChoice(), dpi, options.raw, options.enhance)
        checked = check_claim(
            opened,
            probe.template,
            subject,
            finger,
            matcher=options.matcher,
            threshold=DEFAULT_THRESHOLD if threshold is None else threshold,
            calibration=calibration,
        )
        name = opened.name
    verification, quality = checked.result.verification, {"probe": probe.quality()}
    if as_json:
        report = as_dict(verification, options.probe, checked.best.source, quality=quality)
        document = {**report, "gallery": name, **checked.as_dict()}
        click.echo(json.dumps(document, indent=2, allow_nan=False))
    else:
        verdict, *rows = as_text(verification, quality=quality).splitlines()
        lines = [verdict, f"  {'Finger':<{LABEL_WIDTH}}{checked.in_words()}", *rows]
        click.echo("\n".join(lines))
    return 0 if verification.match else 1
