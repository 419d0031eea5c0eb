"""Fingerprint verification: from two images to a decision.

The public names below load when they are first used, so that ``import fpmatch`` costs no more
than importing numpy. The names and where they live stand in ``__init__.pyi``.
"""

import lazy_loader as _lazy

from fpmatch._version import __version__ as __version__

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
