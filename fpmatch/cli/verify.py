"""`fpmatch verify`: the decision on two prints."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import click

from fpmatch.cli.claim import check
from fpmatch.cli.pair import PairOptions, compare, pair_options
from fpmatch.cli.prints import say_wrong_resolution


@click.command(
    epilog="""\b
Examples:
  fpmatch verify probe.tif reference.tif
  fpmatch verify probe.tif reference.tif --fmr 0.001 --overlay overlay.png
  fpmatch verify probe.png reference.png --probe-dpi 500 --reference-dpi 569 --json
  fpmatch verify probe.iso reference.tif
  fpmatch verify probe.tif reference.tif --matcher paper --rho 0.6
  fpmatch verify --gallery prints.db --subject 101 probe.tif

Exit status: 0 match, 1 no match, 2 could not decide (bad input).
"""
)
@partial(pair_options, reference_required=False)
@click.option(
    "--gallery",
    metavar="GALLERY",
    help="Compare with what is enrolled there of --subject, instead of REFERENCE.",
)
@click.option("--subject", metavar="ID", help="Whose the probe is claimed to be.")
@click.option("--finger", metavar="F", help="Of which finger.  [default: any of the subject]")
@click.option(
    "--overlay",
    "overlay_file",
    metavar="OUT.png|.svg",
    type=click.Path(path_type=Path),
    help="Draw the probe, moved by the recovered transform, over the reference.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.pass_context
def verify(
    ctx: click.Context,
    /,
    gallery: str | None,
    subject: str | None,
    finger: str | None,
    overlay_file: Path | None,
    as_json: bool,
    **values: Any,
) -> None:
    """Decide whether two prints are of the same finger, or a print is of a subject.

    PROBE and REFERENCE are images of one print each (TIFF, PNG, BMP, JPEG, WSQ and others), or
    templates (ISO/IEC 19794-2, ANSI 378, XYT, AN2, JSON, CSV), found by content. The score is
    -10 log10 of the false match rate: at 40, one comparison of different fingers in 10,000 would
    reach it. The transform maps the probe's pixels onto the reference's.

    With --matcher paper, the method of Choi, Lee and Lee, more than a share --rho of the smaller
    print's minutiae must be paired, and the score only stands beside the decision; --threshold and
    --fmr decide by the score instead.

    With --gallery and --subject the probe is compared with all impressions of the subject, or of
    its --finger, that `fpmatch enrol` has put into the gallery. The score is that of all of them
    together: the more impressions there are, the more the best of them must match.
    """
    if gallery is not None or subject is not None or finger is not None:
        if overlay_file is not None:
            raise click.UsageError("--overlay does not go with --gallery")
        ctx.exit(check(gallery, subject, finger, values, as_json=as_json))
    if values["reference"] is None:
        raise click.MissingParameter(ctx=ctx, param_hint="'REFERENCE'", param_type="argument")
    options = PairOptions(**values)
    probe, reference, verification = compare(options)
    if overlay_file is not None:
        from fpmatch.drawing.overlay.draw import save_overlay

        save_overlay(overlay_file, probe.picture(), reference.picture(), verification)
    from fpmatch.report import as_dict, as_text
    from fpmatch.scale import find_scale

    scale = find_scale(verification)
    quality = {"probe": probe.quality(), "reference": reference.quality()}
    if verification.match:  # else the report tells it
        say_wrong_resolution(options.probe, quality["probe"])
        say_wrong_resolution(options.reference, quality["reference"])
    if as_json:
        report = as_dict(verification, options.probe, options.reference, scale, quality)
        click.echo(json.dumps(report, indent=2, allow_nan=False))
    else:
        click.echo(as_text(verification, scale, quality))
    ctx.exit(0 if verification.match else 1)
