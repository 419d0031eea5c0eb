"""Comparison of templates by keys, each prepared once."""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

import numpy as np

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.compare import PreparedPrints, packs, similarities
from fpmatch.matching.decision import NO_EVIDENCE, evidence_in, reachable_similarities
from fpmatch.matching.result import (
    call_matcher,
    check_repeats,
    compare_prepared,
    is_own,
    named,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from fpmatch.matching.result import Matcher
    from fpmatch.templates.minutiae import Template

PREPARED_KEPT: Final = 512
NO_TEMPLATE: Final = "no template"

Key = TypeVar("Key")


class Comparer(Generic[Key]):
    """Compare templates by their keys; of those last used, `capacity` are kept prepared."""

    def __init__(self, matcher: Matcher, capacity: int = PREPARED_KEPT) -> None:
        self.matcher = matcher
        self._capacity = capacity
        self._prepared: OrderedDict[Key, tuple[Any, NDArray[np.float64]]] = OrderedDict()
        self._packed: tuple[list[Key], Any] = ([], None)

    def template(self, key: Key) -> Template | None:
        """Return the template of a key; None where extraction failed."""
        raise NotImplementedError

    def prepare(self, key: Key) -> Any:
        """Return what the matcher's `prepare` makes of a template; None where there is none."""
        return self._print(key)[0]

    def reachable(self, probe: Key, references: Sequence[Key]) -> NDArray[np.float64]:
        """Return the similarities that genuine prints reach; see `reachable_similarities`."""
        evidence = np.stack([self._print(key)[1] for key in references])
        return reachable_similarities(self.matcher, self._print(probe)[1], evidence)

    def _print(self, key: Key) -> tuple[Any, NDArray[np.float64]]:
        """Return a print as the matcher prepared it, and the amount of evidence in it."""
        if key in self._prepared:
            self._prepared.move_to_end(key)
            return self._prepared[key]
        template = self.template(key)
        prepared, evidence = None, np.array(NO_EVIDENCE)
        if template is not None:
            prepared = call_matcher(self.matcher, "prepare", template)
            evidence = evidence_in(self.matcher, template, prepared)
        self._prepared[key] = prepared, evidence
        if len(self._prepared) > self._capacity:
            self._prepared.popitem(last=False)
        return prepared, evidence

    def similarities(
        self, probe: Key, references: list[Key], names: Sequence[str] = ()
    ) -> NDArray[np.float64]:
        """Compare a template with others, at once if the matcher has 1:N comparison.

        The results are the same to the last bit. References that come again in the next call
        are packed once. An error of a plug-in has the `names`, of the probe and the references.
        """
        if not packs(self.matcher):
            return self.one_by_one(probe, references, names)
        if self._packed[0] != references:
            self._packed = references, PreparedPrints(map(self.prepare, references))
        return similarities(self.matcher, self.prepare(probe), self._packed[1])

    def one_by_one(
        self, probe: Key, references: list[Key], names: Sequence[str] = ()
    ) -> NDArray[np.float64]:
        """Compare a template with others by the matcher's `compare`."""
        similarity, k = np.zeros(len(references)), 0
        try:
            ours = self.prepare(probe)
            for k, key in enumerate(references):
                theirs = self.prepare(key)
                similarity[k] = compare_prepared(self.matcher, ours, theirs).similarity
        except MatcherError as error:
            raise named(error, *(names[i] for i in (0, k + 1) if names)) from error
        return similarity

    def check_repeats(
        self, probe: Key, reference: Key, similarity: float, names: Sequence[str]
    ) -> None:
        """Raise MatcherError where a plug-in now finds another similarity of two templates."""
        if is_own(self.matcher):
            return
        try:
            both = self.prepare(probe), self.prepare(reference)
            check_repeats(self.matcher, *both, similarity)
        except MatcherError as error:
            raise named(error, *names) from error
