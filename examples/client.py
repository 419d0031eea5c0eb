"""Verify two prints by a server that `fpmatch serve` started; it needs httpx.

python examples/client.py http://127.0.0.1:8000/ PROBE REFERENCE

The address may end with the token, as `fpmatch serve` prints it: http://host:8000/#token=TOKEN
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import httpx

PATIENCE_S = 60.0  # while the server is busy, the request is sent again
BUSY = 503


def connect(address: str) -> httpx.Client:
    """Return a client of the server at an address."""
    base, _, token = address.partition("#token=")
    headers = {"authorization": f"Bearer {token}"} if token else {}
    return httpx.Client(base_url=base, headers=headers, timeout=120)


def post(server: httpx.Client, path: str, files: dict[str, Path], **fields: Any) -> Any:
    """Return the JSON document that answers a form; SystemExit with what the server refuses."""
    parts = {name: (file.name, file.read_bytes()) for name, file in files.items()}
    end = time.monotonic() + PATIENCE_S
    while True:
        response = server.post(path, files=parts, data=fields)
        wait = float(response.headers.get("retry-after", "1"))
        if response.status_code != BUSY or time.monotonic() + wait > end:
            break
        time.sleep(wait)
    document = response.json()
    if response.is_error:
        raise SystemExit(f"{response.status_code}: {document['error']}")
    return document


def main(address: str, probe: str, reference: str) -> None:
    """Print the decision on two prints."""
    with connect(address) as server:
        files = {"probe": Path(probe), "reference": Path(reference)}
        result = post(server, "/verify", files, fmr=0.0001)
    print(f"{result['decision']}: score {result['score']}")


if __name__ == "__main__":
    main(*sys.argv[1:])
