"""Fingerprint verification: from two images to a decision.

The public names below load when they are first used, so that ``import fpmatch`` costs no more
than importing numpy. The names and where they live stand in ``__init__.pyi``.
"""

import sys as _sys

import lazy_loader as _lazy

from fpmatch._version import __version__ as __version__


class _OldNames:
    """Answers imports by old names, after all else: see `fpmatch.base.moved`."""

    @staticmethod
    def find_spec(name: str, path: object = None, target: object = None) -> object:
        if not name.startswith("fpmatch."):
            return None
        from fpmatch.base.moved import OldNames  # noqa: PLC0415

        return OldNames().find_spec(name)


_sys.meta_path.append(_OldNames)  # type: ignore[arg-type]

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
