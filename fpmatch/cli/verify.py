"""`fpmatch verify`: the decision on two prints, or on a print and a claimed identity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import click

from fpmatch.cli.command import Command, check_combination, load_object
from fpmatch.cli.notes import say_note, say_notes_on, show
from fpmatch.cli.options import (
    PRINT,
    compare_files,
    file_option,
    json_option,
    pair_options,
    pair_options_of,
)
from fpmatch.printable import json_text

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from fpmatch.drawing.overlay.draw import View
    from fpmatch.prints.pair import ComparedPair

EXIT_STATUS: Final = {"match": 0, "no match": 1, "inconclusive": 3}
_NEEDS: Final = {
    "--subject": "--gallery",
    "--finger": "--gallery",
    "--view": "--overlay",
    "--case-number": "--case-report",
    "--notes": "--case-report",
}
_OF_TWO_FILES: Final = ("REFERENCE", "--reference-dpi", "--overlay", "--case-report")


@click.command(
    cls=Command,
    details="""
Of images TIFF, PNG, BMP, JPEG, WSQ and others are read, of templates ISO/IEC 19794-2, ANSI 378,
XYT, AN2, JSON and CSV; "-" is standard input. The transform maps pixels of the probe to pixels of
the reference.

With --matcher paper, the method of Choi, Lee and Lee, two prints match if more than the share
rho of the smaller print's minutiae is paired; the score does not decide, unless --threshold
or --fmr is given.

With --gallery and --subject the probe is compared with all impressions of the subject, or of
its --finger, in the gallery that `fpmatch enrol` made. All of them together have one score: the
more impressions there are, the better the best of them must match.

The picture of --overlay shows where ridges agree, the paired minutiae with their directions, the
unpaired ones fainter, and the decision. Of a template, the minutiae are drawn on white. Where no
transform is found, the prints are drawn beside each other.

Where the answer is no, the mirrored PROBE is compared, too; if it matches, the reason ends with its
score, and --mirror compares it so.

The decision is INCONCLUSIVE where even two prints of one finger may not match: with so little skin,
without ridges, or at an unknown resolution.

\b
More examples:
  fpmatch verify probe.tif reference.tif --overlay pairs.svg --view side-by-side
  fpmatch verify probe.tif reference.tif --overlay ridges.png --view ridges
  fpmatch verify probe.png reference.png --probe-dpi 500 --reference-dpi 569 --json
  fpmatch verify probe.tif reference.tif --matcher paper:rho=0.6
  fpmatch verify lifted.tif reference.tif --mirror
  fpmatch verify - reference.tif < probe.tif
  fpmatch verify probe.tif reference.tif --case-report case.html --notes "ulnar loop, one scar"
""",
    epilog="""\b
Examples:
  fpmatch verify probe.tif reference.tif
  fpmatch verify probe.iso reference.tif --fmr 0.001 --overlay overlay.png
  fpmatch verify --gallery prints.db --subject 101 probe.tif

Exit status: 0 match, 1 no match, 2 input that cannot be used, 3 inconclusive.
""",
)
@click.argument("probe", type=PRINT)
@click.argument("reference", type=PRINT, required=False)
@pair_options
@click.option(
    "--gallery",
    metavar="GALLERY",
    help="Compare with the impressions of --subject in this gallery, instead of REFERENCE; the "
    "variable FPMATCH_KEY names the keys of an encrypted one.",
)
@click.option("--subject", metavar="ID", help="The claimed identity.")
@click.option(
    "--finger", metavar="F", hidden=True, help="The claimed finger.  [default: any of the subject]"
)
@file_option(
    "--overlay",
    "overlay_file",
    metavar="OUT.png|.svg",
    help="Draw the probe, moved by the recovered transform, over the reference; --help-all has "
    "other views.",
)
@click.option(
    "--view",
    type=click.Choice(["overlay", "side-by-side", "ridges"]),
    hidden=True,
    help="Draw the probe over the reference, the prints beside each other, or where their ridges "
    "agree, on the cells that the score compared.  [default: overlay]",
)
@file_option(
    "--case-report",
    metavar="OUT.html",
    help="Write a page to print: files with hashes, settings, evidence, pictures, pairs, limits.",
)
@click.option(
    "--case-number",
    metavar="TEXT",
    default="",
    hidden=True,
    help="Number of the case, on that page.",
)
@click.option(
    "--notes", metavar="TEXT", default="", hidden=True, help="Notes of the examiner, for that page."
)
@json_option
def verify(
    gallery: str | None,
    subject: str | None,
    finger: str | None,
    overlay_file: Path | None,
    view: View | None,
    case_report: Path | None,
    case_number: str,
    notes: str,
    as_json: bool,
    **values: Any,
) -> int:
    """Decide whether two prints are of the same finger, or whether a print is of a subject.

    PROBE and REFERENCE are images of one print each or templates, recognised by content. The score
    is -10 log10 of the false match rate: at 40, one comparison of different fingers in 10,000
    scores as high.
    """
    check_combination(_NEEDS, not_with_gallery=_OF_TWO_FILES)
    if gallery is not None:
        if subject is None:
            raise click.UsageError("--gallery needs --subject")
        verify_claim = load_object(
            "fpmatch.gallery.cli.claim:verify_claim", used_by="verify --gallery"
        )
        return EXIT_STATUS[verify_claim(gallery, subject, finger, values, as_json=as_json)]
    if values["reference"] is None:
        raise click.MissingParameter(param_hint="'REFERENCE'", param_type="argument")
    from fpmatch.base.output import atomic_write, check_writable
    from fpmatch.base.plugins import named
    from fpmatch.errors import MatcherError
    from fpmatch.prints.report import as_text

    if overlay_file is not None:
        from fpmatch.drawing.overlay.draw import SUFFIXES

        check_writable(overlay_file, what="an overlay", suffixes=SUFFIXES)
    if case_report is not None:
        from fpmatch.drawing.case_report import check_words

        check_writable(case_report, what="a case report", suffixes=(".html", ".htm"))
        check_words(case_number, notes)
    pair = compare_files(values)
    match = pair.verification.match
    say_notes_on((pair.probe, pair.reference), resolution=match)  # else the report contains it
    try:
        if as_json:
            answer = json_text(pair.as_dict())
        else:
            # images are graded where the text states it
            answer = as_text(pair.verification, None if match else pair.quality)
    except MatcherError as error:  # raised by a plug-in while it explains
        raise named(error, pair.probe.name, pair.reference.name) from error
    show(answer)
    # after the decision, which no file that cannot be written is to cost
    if overlay_file is not None:
        from fpmatch.drawing.overlay.draw import overlay_scene, scene_bytes
        from fpmatch.drawing.scene.ink import print_picture

        v, view = pair.verification, view or "superposed"
        both = print_picture(pair.probe), print_picture(pair.reference)
        scene = overlay_scene(*both, v, view)
        content = scene_bytes(overlay_file.suffix.lower(), scene)
        with atomic_write(overlay_file) as stream:
            stream.write(content)
        if view != "side-by-side" and v.transform is None:
            say_note(f"{overlay_file}: no transform was found: the prints are beside each other")
        elif view == "ridges" and v.ridge_map is None:
            say_note(f"{overlay_file}: the ridges were not compared: the overlay is drawn instead")
    if case_report is not None:
        written = {"case_number": case_number, "notes": notes}
        _write_case_report(case_report, pair, values, written)
    return EXIT_STATUS[pair.verification.decision]


def _write_case_report(
    target: Path, pair: ComparedPair, values: Mapping[str, Any], written: Mapping[str, Any]
) -> None:
    """Write the report on a comparison of two files, with what its examiner has `written`."""
    from fpmatch.base.output import atomic_write_bytes
    from fpmatch.drawing.case_report import CaseFile, case_report, settings_of

    probe, reference = (
        CaseFile.of(path.name, path.read_bytes()) for path in (values["probe"], values["reference"])
    )
    settings = settings_of(pair_options_of(values), pair, values["enhance"], values["polarity"])
    html = case_report(pair, (probe, reference), settings=settings, **written)
    atomic_write_bytes(target, html.encode())
