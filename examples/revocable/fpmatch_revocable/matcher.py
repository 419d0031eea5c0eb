"""The comparison of revocable templates as a matcher, for every command that takes one.

``--matcher revocable`` names it, once the package is installed; the environment variable
``FPMATCH_KEY`` names the source of its key. `CALIBRATION` is the file for ``--calibration``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fpmatch.gallery.encryption.keys import load_keys
from fpmatch.matching.result import Comparison, nothing_found
from fpmatch_revocable.compare import compare
from fpmatch_revocable.template import RevocableTemplate, protect

if TYPE_CHECKING:
    from fpmatch.templates.minutiae import Template


@dataclass(frozen=True, slots=True)
class RevocableMatcher:
    """Compare templates by their revocable form under the current key.

    It finds no transform and no pairs: these cannot be recovered from revocable templates.
    """

    name: str = "revocable"
    aligns: bool = False

    def prepare(self, template: Template) -> RevocableTemplate:
        """Return the revocable form of a template."""
        return protect(template, load_keys().current)

    def compare(self, probe: RevocableTemplate, reference: RevocableTemplate) -> Comparison:
        """Compare two revocable templates."""
        return nothing_found("too few words in common", compare(probe, reference))


MATCHER: Final = RevocableMatcher()
CALIBRATION: Final = Path(__file__).with_name("revocable.json")
