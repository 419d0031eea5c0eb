"""What the tests of the server share: a server, clients of it, prints as bytes, and `pool_work`."""

import asyncio
import io
import socket
import sys
import tempfile
import threading
import time
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import fpmatch

sys.path.append(str(Path(__file__).parent))

LARGE_BYTES = 6_000_000
NEEDED = ("fastapi", "h11", "httpx", "hypercorn", "prometheus_client")
if not all(map(find_spec, NEEDED)):  # of the extra `web`
    collect_ignore_glob = ["test_*.py"]


def png(pixels):
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    return stream.getvalue()


@pytest.fixture(scope="session")
def prints(prints, fingers):
    """Return the files of the folder of prints, by name, and some that a server refuses."""
    return {path.name: path.read_bytes() for path in prints.iterdir() if path.is_file()} | {
        "mirrored.png": png(np.ascontiguousarray(fingers[0][:, ::-1])),
        "big.tif": bytes(2_010_000),
        "wide.png": png(np.full((2600, 2600), 255, np.uint8)),
    }


@pytest.fixture(scope="session")
def sent(prints):
    """Return a function that returns the parts of a form with files, by the names of its fields."""

    def parts(**names):
        return {field: (name, prints[name]) for field, name in names.items()}

    return parts


def token_of(role):
    return f"the-token-of-{role.name.lower()}"


def bearer(role):
    return {"authorization": f"Bearer {token_of(role)}"}


def clients():
    """Return a client of each role."""
    from fpmatch.server.settings import Client, Role, digest_of

    return {digest_of(token_of(role)): Client(role.name.lower(), role) for role in Role}


async def echo(scope, receive, send):
    """Answer with the number of bytes that came; under /large with many."""
    if scope["type"] == "lifespan":
        for state in ("startup", "shutdown"):
            await receive()
            await send({"type": f"lifespan.{state}.complete"})
        return
    size, more = 0, scope["method"] == "POST"
    while more:
        message = await receive()
        size += len(message.get("body", b""))
        more = message.get("more_body", False)
    body = bytes(LARGE_BYTES) if scope["path"] == "/large" else str(size).encode()
    headers = [(b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": 200, "headers": headers})
    await send({"type": "http.response.body", "body": body})


@pytest.fixture
def gallery(tmp_path_factory):
    """Return where a gallery may lie that nobody has made."""
    return tmp_path_factory.mktemp("gallery") / "prints.db"


@contextmanager
def listening(app, limits=None):
    """Answer the requests to a port of this machine by an ASGI application; yield the port."""
    from fpmatch.server.server import answer
    from fpmatch.server.settings import Limits

    started, stops = threading.Event(), []

    async def main(listener):
        stops.append((asyncio.get_running_loop(), asyncio.Event()))
        started.set()
        await answer(app, listener, limits or Limits(), stops[0][1])

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=lambda: asyncio.run(main(listener)))
        thread.start()
        started.wait()
        try:
            yield listener.getsockname()[1]
        finally:
            (loop, stop) = stops[0]
            loop.call_soon_threadsafe(stop.set)
            thread.join()


def check_answer(response):
    """Check an answer: a browser trusts it with little, it names no folder and no program here."""
    response.read()
    text = str(response.headers)
    if response.headers.get("content-type", "").startswith(("text", "application/json")):
        text += response.text
    secrets = (f"{tempfile.gettempdir()}/", str(Path(fpmatch.__file__).parent), sys.prefix, ".py")
    assert not [secret for secret in secrets if secret in text], text[:2000]
    assert "default-src 'none'; script-src 'self'; " in response.headers["content-security-policy"]
    assert response.headers["x-content-type-options"] == "nosniff"
    assert response.headers["cross-origin-resource-policy"] == "same-origin"


@contextmanager
def serving(**settings):
    """Serve with these settings, by default on one process; yield a client of the server."""
    import httpx

    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.server.app import make_app
    from fpmatch.server.settings import Settings

    place = settings.get("gallery")
    if isinstance(place, Path):
        settings["gallery"] = str(place)
        if not place.exists():
            open_gallery(place, create=True).close()
    with listening(make_app(Settings(**{"workers": 1, **settings}))) as port:
        options = {"timeout": 120, "trust_env": False, "event_hooks": {"response": [check_answer]}}
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", **options) as client:
            yield client


def wait_until(condition):
    end = time.monotonic() + 15
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def wait_until_ready(http):
    """Wait until a server says that it is ready: it tells what it knows for a second."""
    wait_until(lambda: http.get("/ready").status_code == 200)


@pytest.fixture(scope="session")
def server(tmp_path_factory):
    """Serve a gallery to clients of all roles; yield a client that may request everything."""
    from fpmatch.server.settings import Limits, Role

    place = tmp_path_factory.mktemp("gallery") / "prints.db"
    limits = Limits(file_megabytes=2.0, seconds=120)
    with serving(gallery=place, clients=clients(), limits=limits) as client:
        client.headers.update(bearer(Role.ADMIN))
        yield client


@pytest.fixture
def http(server):
    """Return a client of a server whose gallery is empty before and after the test."""
    yield server
    for subject in ("1", "2", "ada", "ada already (a/b)"):
        server.delete("/gallery/prints", params={"subject": subject})
    assert server.get("/gallery").json()["impressions"] == 0
