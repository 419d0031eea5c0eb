"""What the process that workers are forked from imports first, and nobody else.

It is there to import modules and to be copied: nothing in it becomes garbage, and whatever looks
for garbage there, or in what a worker has from there, copies pages that would else be shared.
"""

from __future__ import annotations

import atexit
import gc
import os

gc.disable()
os.register_at_fork(before=gc.freeze, after_in_child=gc.enable)
atexit.register(gc.freeze)
