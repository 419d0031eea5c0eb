"""`fpmatch verify --gallery`: the decision on a print and a claimed identity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from fpmatch.base.plugins import named
from fpmatch.cli.notes import say_notes_on, show
from fpmatch.cli.options import open_side, pair_options_of
from fpmatch.errors import MatcherError
from fpmatch.gallery.cli.notes import say_damaged
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.search.probes import read_hashed
from fpmatch.gallery.tasks.claim import check_claim
from fpmatch.matching.calibration import load_calibration
from fpmatch.matching.decision import DEFAULT_THRESHOLD
from fpmatch.matching.registry import get_matcher, states_rho
from fpmatch.printable import json_text
from fpmatch.prints.report import LABEL_WIDTH, as_dict, as_text

if TYPE_CHECKING:
    from collections.abc import Mapping


def verify_claim(
    gallery: str, subject: str, finger: str | None, values: Mapping[str, Any], *, as_json: bool
) -> str:
    """Compare a probe with the impressions of a subject, print the decision and return it."""
    options = pair_options_of(values)
    if states_rho(options.matcher):
        raise click.UsageError("rho cannot be combined with --gallery: scores decide there")
    threshold = options.decision_score()
    calibration = load_calibration(get_matcher(options.matcher).name, options.calibration)
    with open_gallery(gallery) as opened:
        probe, content = read_hashed(values["probe"], lambda: open_side(values, "probe"))
        try:
            checked = check_claim(
                opened,
                probe,
                subject,
                finger,
                matcher=options.matcher,
                threshold=DEFAULT_THRESHOLD if threshold is None else threshold,
                calibration=calibration,
            )
        except MatcherError as error:
            raise named(error, probe.name, f"subject {subject}") from error
        probe, decision, best = checked.probe, checked.result.verification, checked.best.id
        claim = {"subject": subject, "finger": finger, "best": best, "match": decision.match}
        opened.record("verify", probe=content, **claim)
        name = opened.name
        say_damaged(name, opened.damaged)
    say_notes_on([probe])
    verification, quality = checked.result.verification, {"probe": probe.quality}
    if as_json:
        report = as_dict(verification, probe.name, checked.best.source, quality=quality)
        show(json_text({**report, "gallery": name, **checked.as_dict()}))
    else:
        text = as_text(verification, quality)
        verdict, *rows = text.splitlines()
        lines = [verdict, f"  {'Finger':<{LABEL_WIDTH}}{checked.in_words()}", *rows]
        show("\n".join(lines))
    return verification.decision
