"""The index of a large gallery, extended while prints are enrolled.

Segments are added when they are full, so that an enrolment that is interrupted leaves an index of
all prints but those that fill no segment.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Final

from fpmatch.errors import FpmatchError
from fpmatch.gallery.engine.workers import no_progress

if TYPE_CHECKING:
    from fpmatch.gallery.engine.engine import Engine
    from fpmatch.gallery.engine.workers import Progress
    from fpmatch.gallery.index.gallery_index import GalleryIndex
    from fpmatch.gallery.store.reader import GalleryReader

PRINTS_PER_CHECK: Final = 10_000  # enrolled from one look for full segments to the next


class EnrolmentIndex:
    """Add what is enrolled to the index of a large gallery; failures are left to its next search.

    `engine` and `progress` are those of `fpmatch.gallery.index.gallery_index.GalleryIndex`.
    """

    def __init__(
        self,
        gallery: GalleryReader,
        *,
        engine: Engine | None = None,
        progress: Progress = no_progress,
    ) -> None:
        self._gallery, self._engine, self._progress = gallery, engine, progress
        self._index: GalleryIndex | None = None
        self._checked = 0
        self._writable = True

    def extend(self, enrolled: int, left: int) -> None:
        """Add full segments to the index of a gallery that is large, or will be.

        `enrolled` prints have been committed by this run, and up to `left` are to come.
        """
        if self._writable and enrolled - self._checked >= PRINTS_PER_CHECK:
            self._checked = enrolled
            self._refresh(left, full_segments=True)

    def finish(self) -> None:
        """Add all prints to the index of a gallery that is large."""
        self._refresh(0, full_segments=False)

    def _refresh(self, left: int, *, full_segments: bool) -> None:
        from fpmatch.gallery.index.gallery_index import GalleryIndex  # noqa: PLC0415  (imports matchers)
        from fpmatch.gallery.index.loss import EXHAUSTIVE_UP_TO  # noqa: PLC0415
        from fpmatch.matching.registry import DEFAULT_MATCHER, get_matcher  # noqa: PLC0415

        with suppress(FpmatchError):
            if not self._gallery.has_over(max(0, EXHAUSTIVE_UP_TO - left)):
                return
            if self._index is None:
                self._index = GalleryIndex(
                    self._gallery,
                    get_matcher(DEFAULT_MATCHER),
                    engine=self._engine,
                    progress=self._progress,
                )
            state = self._index.refresh(full_segments=full_segments)
            if state.parts and state.folder is None:  # in memory, which it would fill
                self._index, self._writable = None, False
