"""Mutators of encrypted files: what they hold is damaged, and encrypted with the right key."""

from __future__ import annotations

import os
from functools import cache
from typing import TYPE_CHECKING

from fpmatch.base.encryption.keys import KEY_VARIABLE, Key, load_keys
from fpmatch.base.encryption.records import seal, unseal
from fpmatch.formats.sealed import _PURPOSE as TEMPLATE
from research.fuzzing.mutators.octets import any_bytes
from research.fuzzing.mutators.text import json_number, json_value

if TYPE_CHECKING:
    import random

_VARIABLE = "FPMATCH_FUZZING_KEY"


@cache
def use_key() -> None:
    """Set the key of encrypted files, always the same: a finding is replayed with it."""
    os.environ |= {KEY_VARIABLE: f"env:{_VARIABLE}", _VARIABLE: Key(bytes(range(32))).as_line()}


def resealed(rng: random.Random, data: bytes) -> bytes:
    """Change the template in a sealed file, and seal it again."""
    keys = load_keys()
    content = unseal(keys, data, purpose=TEMPLATE)
    change = rng.choice((json_value, json_number, None))
    changed = change(rng, content) if change else any_bytes(rng, content, [content])
    return seal(keys.current, changed, purpose=TEMPLATE)
