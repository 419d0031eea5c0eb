"""Whether the default matcher is compiled; where it is not, the reference takes its steps."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Final

_KERNEL: Final = find_spec("fpmatch.matching.pipeline._kernels._pipeline_kernel")
COMPILED: Final = _KERNEL is not None and not str(_KERNEL.origin).endswith(".py")
