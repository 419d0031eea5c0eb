"""Old names of modules: an import of one works, with a warning of one line that names the new one.

These are names that the README, the documentation or the protocols of plug-ins once gave.
"""

from __future__ import annotations

import sys
from importlib.machinery import ModuleSpec

TYPE_CHECKING = False  # importing `typing`, or `importlib.abc`, would cost `import fpmatch` 8 ms
if TYPE_CHECKING:
    from collections.abc import Mapping
    from types import ModuleType
    from typing import Final

MOVED: Final[Mapping[str, str]] = {
    "array_file": "gallery.store.array_file",
    "audit.chain": "gallery.store.audit_chain",
    "audit.client": "gallery.store.audit_chain",
    "audit.log": "gallery.store.audit_log",
    "binary_records": "base.binary_records",
    "client": "server.client",
    "drawing.words": "prints.report",
    "encryption": "base.encryption",
    "engine": "gallery.engine",
    "evaluation": "lab.evaluation",
    "evaluation.analysis": "lab.evaluation.report.analysis",
    "evaluation.batch": "gallery.batch",
    "evaluation.curves": "lab.evaluation.report.curves",
    "evaluation.dataset": "lab.evaluation.databases.dataset",
    "evaluation.extraction": "lab.evaluation.databases.extraction",
    "evaluation.impression": "lab.evaluation.databases.protocol",
    "evaluation.pair_list": "gallery.batch.pair_list",
    "evaluation.protocol": "lab.evaluation.databases.protocol",
    "evaluation.rates": "lab.evaluation.rates.error_rates",
    "evaluation.report": "lab.evaluation.report.results",
    "evaluation.score_file": "gallery.batch.score_file",
    "evaluation.score_reports": "lab.evaluation.report.score_reports",
    "evaluation.scores": "lab.evaluation.rates.scores",
    "evaluation.scores_set": "lab.evaluation.rates.scores_set",
    "formats.bounds": "templates.bounds",
    "gallery.candidates": "gallery.search.entries",
    "gallery.enrol": "gallery.tasks.enrol",
    "gallery.entry": "gallery.listing.entry",
    "gallery.history": "gallery.store.history",
    "gallery.identify": "gallery.search.identify",
    "gallery.identify_fused": "gallery.search.fused",
    "gallery.manifest": "gallery.listing.manifest",
    "gallery.print_file": "gallery.listing.print_file",
    "gallery.prints": "gallery.listing.prints",
    "gallery.rotation": "gallery.tasks.rotation",
    "gallery.transfer": "gallery.tasks.transfer",
    "gallery_api": "gallery.tasks.api",
    "image.assess": "image.extract",
    "image.enhancement.network": "image.enhancement.enhancers",
    "image.io.limits": "image.io.grey",
    "image.io.raw": "image.io.grey",
    "image.recorder": "image.preprocess.arrays",
    "image.skeleton.spurious": "image.skeleton.minutiae",
    "indexing": "gallery.index",
    "kernels": "base.kernels",
    "matching.candidate_list": "gallery.index.prints.descriptor_scores",
    "matching.compact_template": "gallery.index.prints.compact_template",
    "matching.consolidate": "gallery.fingers.consolidate",
    "matching.finger": "gallery.fingers.finger",
    "matching.fused_fingers": "gallery.fingers.fused_fingers",
    "matching.packed_descriptors": "gallery.index.prints.stored_descriptors",
    "matching.prepare": "matching.prints.prepare",
    "matching.prepare_compact": "gallery.index.prints.compact_template",
    "matching.ridge_map": "matching.pipeline.ridge_map",
    "matching.ridges": "matching.pipeline.alignment",
    "minutiae": "templates.minutiae",
    "output": "base.output",
    "pair": "prints.pair",
    "plugins": "base.plugins",
    "pointset.affine": "lab.points.affine",
    "pointset.match": "lab.points.match",
    "pointset.point_match": "pointset.geometry.point_match",
    "pointset.points_csv": "lab.points.points_csv",
    "pointset.similarity": "pointset.geometry.similarity",
    "pointset.triangles": "lab.points.triangles",
    "pointset.unit_circle": "pointset.paper",
    "prints.words": "prints.report",
    "reading": "prints.reading",
    "report": "prints.report",
    "ridge_field": "templates.ridge_field",
    "scale": "matching.scale",
    "synthesis": "lab.synthesis",
    "web": "server",
}
"""The new place, in the package, of a module, or of a folder with all that it contained."""


def new_place(name: str) -> str | None:
    """Return the new full name of a module, None where it has no other.

    Examples
    --------
    >>> new_place("fpmatch.minutiae"), new_place("fpmatch.errors")
    ('fpmatch.templates.minutiae', None)
    """
    old, rest = name.removeprefix("fpmatch."), ""
    while old not in MOVED:
        old, dot, last = old.rpartition(".")
        if not dot:
            return None
        rest = f".{last}{rest}"
    return f"fpmatch.{MOVED[old]}{rest}"


class OldNames:
    """Find modules by old names.

    Once a folder is imported by one, it is asked first: else Python would find the modules in it
    by their files, as copies.
    """

    def find_spec(
        self, fullname: str, path: object = None, target: object = None
    ) -> ModuleSpec | None:
        """Return how to load a module that moved."""
        moved = fullname.startswith("fpmatch.") and new_place(fullname) is not None
        return ModuleSpec(fullname, self) if moved else None  # type: ignore[arg-type]

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Import the module by its new name, and warn."""
        import warnings  # noqa: PLC0415
        from importlib import import_module  # noqa: PLC0415

        if not isinstance(sys.meta_path[0], OldNames):
            sys.meta_path.insert(0, self)
        new = new_place(spec.name) or spec.name
        spec.loader_state = import_module(new)
        warnings.warn(f"{spec.name} is now {new}", FutureWarning, stacklevel=2)
        return type(sys)(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Let the old name mean the module itself, not a copy."""
        spec = module.__spec__
        if spec is not None:
            sys.modules[spec.name] = spec.loader_state
