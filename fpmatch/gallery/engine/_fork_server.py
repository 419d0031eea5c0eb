"""First import of the process that workers are forked from; not for other processes.

That process only imports modules and is forked. Its garbage collector is switched off, because a
collection there or of inherited objects would copy memory pages that are otherwise shared.
"""

from __future__ import annotations

import atexit
import gc
import os

gc.disable()
os.register_at_fork(before=gc.freeze, after_in_child=gc.enable)
atexit.register(gc.freeze)
