"""Requests as bytes, and the ordinary clients that send them and check the answers."""

from __future__ import annotations

import http.client
import io
import json
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from PIL import Image

if TYPE_CHECKING:
    from collections.abc import Mapping

SAMPLES: Final = Path(__file__).resolve().parents[2] / "sample_data"
PROBE: Final = SAMPLES / "101_1.tif"
REFERENCE: Final = SAMPLES / "101_3.tif"
KINDS: Final = ("health", "ready", "verify", "identify")  # what an ordinary client asks, in turn
OF_GALLERY: Final = ("ready", "identify")  # refused while the gallery does not answer
REFUSED_S: Final = 2.0  # in which readiness is refused then
KNOWN_S: Final = 1.0  # after the last check, for which it may be told once more
BUSY: Final = 503
PATIENCE_S: Final = 60.0
BOUNDARY: Final = "fpmatch-attack"
FORM: Final = f"content-type: multipart/form-data; boundary={BOUNDARY}"
_NOISY_SIDE: Final = 1500  # pixels
_PAUSE_S: Final = 0.05  # between two requests


def form_of(fields: Mapping[str, object]) -> bytes:
    """Return a form; a pair is the name of a file and its content, a list a repeated field."""
    parts = []
    for name, value in fields.items():
        for one in value if isinstance(value, list) else [value]:
            file, content = one if isinstance(one, tuple) else (None, one)
            line = f'content-disposition: form-data; name="{name}"'
            line += f'; filename="{file}"' if file is not None else ""
            content = content if isinstance(content, bytes) else str(content).encode()
            parts.append(f"--{BOUNDARY}\r\n{line}\r\n\r\n".encode() + content + b"\r\n")
    return b"".join(parts) + f"--{BOUNDARY}--\r\n".encode()


def multipart(**files: Path | bytes) -> bytes:
    """Return a form of these files."""
    return form_of(
        {
            name: (name, file) if isinstance(file, bytes) else (file.name, file.read_bytes())
            for name, file in files.items()
        }
    )


def post_head(path: str, *headers: str) -> bytes:
    """Return the head of a request whose body is such a form; `headers` are further lines."""
    lines = [f"POST {path} HTTP/1.1", "host: localhost", *headers]
    lines.append(FORM)
    return "\r\n".join([*lines, "", ""]).encode()


def whole_post(path: str, *headers: str, **files: Path | bytes) -> bytes:
    """Return a request with these files; `headers` are further lines."""
    body = multipart(**files)
    return post_head(path, f"content-length: {len(body)}", *headers) + body


def noisy_print() -> bytes:
    """Return an image with a print in a corner of noise: to compare it has an answer of 5 MB."""
    with Image.open(PROBE) as image:
        pixels = np.asarray(image.convert("L"))
    noise = np.random.default_rng(1).integers(0, 256, (_NOISY_SIDE, _NOISY_SIDE), np.uint8)
    noise[: pixels.shape[0], : pixels.shape[1]] = pixels
    stream = io.BytesIO()
    Image.fromarray(noise).save(stream, "PNG", dpi=(500, 500))
    return stream.getvalue()


@dataclass
class Times:
    """Measures of ordinary clients: seconds by kind of request, refusals, wrong answers."""

    seconds: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    refused: int = 0
    wrong: int = 0


class OrdinaryClient:
    """A client that requests health, readiness, a verification and an identification in turn.

    The first answers are those that later ones must equal, but for their times.
    """

    def __init__(self, host: str, port: int) -> None:
        self._place = host, port
        both = multipart(probe=PROBE, reference=REFERENCE)
        self._bodies = {"verify": both, "identify": multipart(probe=PROBE)}
        while self._ask("health")[0] == 0:  # some servers listen after they are ready
            time.sleep(_PAUSE_S)
        self._right = {kind: self._ask(kind) for kind in KINDS}
        failed = [kind for kind, (status, _) in self._right.items() if status != http.HTTPStatus.OK]
        if failed:
            raise OSError(f"the server does not answer /{failed[0]}: {self._right[failed[0]]}")

    def ask_for(self, seconds: float, *, hangs: bool = False) -> Times:
        """Request again and again for so many seconds, each time on a new connection."""
        times, begin = Times(), time.perf_counter()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for kind in KINDS:
                start = time.perf_counter()
                status, answer = self._ask(kind)
                took = time.perf_counter() - start
                times.seconds[kind].append(took)
                if hangs and kind in OF_GALLERY:
                    known = kind == "ready" and start - begin < KNOWN_S
                    late = kind == "ready" and took > REFUSED_S
                    times.wrong += late or (status != BUSY and not known)
                else:
                    times.refused += status in (0, BUSY)
                    times.wrong += status not in (0, BUSY) and (status, answer) != self._right[kind]
                time.sleep(_PAUSE_S)
        return times

    def _ask(self, kind: str) -> tuple[int, Any]:
        """Return status and content of an answer; status 0 where there is none."""
        connection = http.client.HTTPConnection(*self._place, timeout=PATIENCE_S)
        body = self._bodies.get(kind)
        try:
            if body:
                form = {"content-type": FORM.partition(": ")[2]}
                connection.request("POST", f"/{kind}", body, form)
            else:
                connection.request("GET", f"/{kind}")
            response = connection.getresponse()
            return response.status, _without_times(response.read())
        except (OSError, http.client.HTTPException) as error:
            return 0, str(error)
        finally:
            connection.close()


def _without_times(content: bytes) -> Any:
    """Return a JSON document without its times, or what is not JSON as it is."""
    try:
        document: Mapping[str, Any] = json.loads(content)
    except ValueError:
        return content
    return {name: value for name, value in document.items() if name != "seconds"}
