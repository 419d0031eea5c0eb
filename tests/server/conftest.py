"""What the tests of the server share: a client of it, prints as bytes, and `pool_work`."""

import asyncio
import io
import os
import socket
import sys
import threading
import time
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

sys.path.append(str(Path(__file__).parent))

LARGE_BYTES = 6_000_000

NEEDED = ("fastapi", "h11", "httpx", "hypercorn", "prometheus_client")
if not all(map(find_spec, NEEDED)):  # of the extra `web`
    collect_ignore_glob = ["test_*.py"]


def png(pixels, dpi=500):
    stream = io.BytesIO()
    options = {} if dpi is None else {"dpi": (dpi, dpi)}
    Image.fromarray(pixels).save(stream, "PNG", **options)
    return stream.getvalue()


@pytest.fixture(scope="session")
def prints(fingers):
    """Return PNG files: two impressions of one finger, one of another, and files that are none."""
    first, second = fingers
    whole = png(first)
    return {
        "1_1.png": whole,
        "1_2.png": png(np.ascontiguousarray(np.rot90(first))),
        "2_1.png": png(second),
        "untold.png": png(first, dpi=None),
        "blank.png": png(np.full((200, 200), 255, np.uint8)),
        "truncated.png": whole[: len(whole) // 2],
        "text.png": b"This is not an image.\n",
        "empty.png": b"",
    }


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
def listening(app, limits=None, host="127.0.0.1"):
    """Answer the requests to a port of this machine by an ASGI application; yield the port."""
    from fpmatch.server.server import answer
    from fpmatch.server.settings import Limits

    started, stops = threading.Event(), []

    async def main(listener):
        stops.append((asyncio.get_running_loop(), asyncio.Event()))
        started.set()
        await answer(app, listener, limits or Limits(), stops[0][1])

    with socket.create_server((host, 0)) as listener:
        thread = threading.Thread(target=lambda: asyncio.run(main(listener)))
        thread.start()
        started.wait()
        try:
            yield listener.getsockname()[1]
        finally:
            (loop, stop) = stops[0]
            loop.call_soon_threadsafe(stop.set)
            thread.join()


@contextmanager
def served(app, limits=None):
    """Serve an ASGI application; yield a client of it."""
    import httpx

    with listening(app, limits) as port:
        address = f"http://127.0.0.1:{port}"
        with httpx.Client(base_url=address, timeout=120, trust_env=False) as client:
            yield client


@contextmanager
def serving(**settings):
    """Serve with these settings, by default on one process; yield a client of the server."""
    from fpmatch.server.app import make_app
    from fpmatch.server.settings import Settings

    with served(make_app(Settings(**{"workers": 1, **settings}))) as client:
        yield client


@contextmanager
def served_gallery(gallery, **settings):
    """Serve a gallery, which is made where there is none; yield a client of the server."""
    from fpmatch.gallery.gallery import open_gallery

    open_gallery(gallery, create=True).close()
    with serving(gallery=str(gallery), **settings) as client:
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
def client():
    """Return a client of a server without a gallery, on one process."""
    from fpmatch.server.settings import Limits

    with serving(limits=Limits(file_megabytes=2.0, seconds=120)) as client:
        yield client


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """Serve a gallery that is empty at first; yield a client of the server."""
    with served_gallery(tmp_path_factory.mktemp("gallery") / "prints.db", workers=2) as client:
        yield client


@pytest.fixture(scope="module")
def downloads(tmp_path_factory):
    return tmp_path_factory.mktemp("downloads")


@pytest.fixture(scope="module")
def browser(downloads):
    from .page import start_browser

    driver = start_browser(downloads)
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def screenshots(tmp_path_factory):
    """Return the folder that FPMATCH_SCREENSHOTS names, else a temporary one."""
    folder = os.environ.get("FPMATCH_SCREENSHOTS")
    if folder is None:
        return tmp_path_factory.mktemp("screenshots")
    Path(folder).mkdir(parents=True, exist_ok=True)
    return Path(folder)


@pytest.fixture
def page(browser, server, screenshots):
    from .page import Page

    page = Page(browser, str(server.base_url), screenshots)
    yield page
    assert page.complaints() == []
