"""Documents with pictures: a worker process encodes them, so that the server holds them once."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from fastapi import Response

if TYPE_CHECKING:
    from collections.abc import Callable


def encoded(work: Callable[..., dict[str, Any]], *args: Any) -> tuple[bytes, Any]:
    """Return the JSON of ``work(*args)``, and its `result`, None where it has none."""
    document = work(*args)
    content = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return content.encode(), document.get("result")


def json_response(content: bytes) -> Response:
    """Return a response with a document that is encoded."""
    return Response(content, media_type="application/json")
