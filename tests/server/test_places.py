"""No answer, header or page contains a folder of the server, whatever is asked of it."""

import sys
import tempfile
from pathlib import Path

import pytest
from click.testing import CliRunner

import fpmatch
from fpmatch.base.plugins import forget_plugins
from fpmatch.cli.group import fpmatch as command
from fpmatch.gallery.gallery import open_gallery
from fpmatch.server.settings import STATIC, Client, Limits, Role, digest_of

from .conftest import served_gallery

TOKEN = "a-long-enough-token"
MARKER = "SECRETMARKER"
BY_FOLDER = r"(?P<subject>[^/]+)/(?P<impression>[^/]+)"
POINTS = "[fpmatch.{}]\nbroken = broken:THING\n"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Return the folder of all that a server has: working, temporary, home and cache folder."""
    folder = tmp_path_factory.mktemp(MARKER)
    with pytest.MonkeyPatch.context() as patch:
        for name in ("TMPDIR", "HOME", "XDG_CACHE_HOME"):
            (folder / name).mkdir()
            patch.setenv(name, str(folder / name))
        patch.setattr(tempfile, "tempdir", str(folder / "TMPDIR"))
        patch.chdir(folder)
        yield folder


@pytest.fixture(scope="module")
def plugins(place):
    """Install a matcher and a format that cannot be loaded, for a reason that names a folder."""
    site = place / "site"
    info = site / "broken-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("".join(map(POINTS.format, ("matchers", "formats"))))
    (site / "broken.py").write_text("open(__file__ + '.model')\n")
    sys.path.insert(0, str(site))
    forget_plugins()
    yield
    sys.path.remove(str(site))
    forget_plugins()


@pytest.fixture(scope="module")
def server(place, prints, plugins):
    """Serve a gallery whose prints the command enrolled from files by their whole paths."""
    (place / "prints").mkdir()
    for name in ("1_1.png", "1_2.png", "2_1.png"):
        (place / "prints" / name).write_bytes(prints[name])
    words = ["enrol", str(place / "first.db"), str(place / "prints")]
    assert CliRunner().invoke(command, words).exit_code == 0
    words = ["enrol", str(place / "prints.db"), str(place / "first.db")]
    assert CliRunner().invoke(command, words).exit_code == 0
    with open_gallery(place / "prints.db") as gallery:
        assert all(MARKER in entry.source for entry in gallery.entries())
    clients = {digest_of(TOKEN): Client("ada", Role.ADMIN)}
    with served_gallery(
        place / "prints.db", clients=clients, limits=Limits(file_megabytes=4.0)
    ) as client:
        yield client


def check(response):
    """Check an answer: the marker is part of every folder but those of the installation."""
    text = f"{response.text}\n{response.headers}"
    pixels = response.headers.get("content-type", "").startswith("image/")  # read as short words
    secrets = (MARKER, str(Path(fpmatch.__file__).parent), sys.prefix)
    for secret in secrets if pixels else (*secrets, ".py"):
        assert secret not in text, text[:2000]
    return response


def asked(prints):
    """Return good and bad requests to every address."""
    large = prints["1_1.png"] + bytes(2_000_000)  # in a temporary file until it is read
    bad = {"2_1.png": prints["text.png"], "2_2.png": prints["empty.png"], "9_1.png": b"\xffP" * 9}
    bad |= {name: prints[name] for name in ("blank.png", "truncated.png")}
    files = {"1_2.png": prints["1_2.png"], "9_2.png": large, **bad}
    options = [{}, {"dpi": "7"}, {"dpi": "no"}, {"nothing": "1"}]
    pairs = ("/verify", "/compare", "/views", "/overlay", "/case-report")
    matchers = [{"matcher": name} for name in ("paper", "broken", "a:b", "../../etc")]
    for name, data in files.items():
        probe = {"probe": (name, data)}
        image = {"image": (name, data)}
        reference = {"reference": ("/etc/x.png", prints["1_1.png"])}
        for path in pairs if name == "2_1.png" else pairs[:1]:
            yield "POST", path, {"files": probe | reference}
        for path in ("/extract", "/stages", "/enrol"):
            yield "POST", path, {"files": image}
        yield "POST", "/enrol", {"files": image, "data": {"subject": "../ada", "impression": "1"}}
        yield "POST", "/identify", {"files": probe}
        yield "POST", "/gallery/verify", {"files": probe, "data": {"subject": "1"}}
        yield "POST", "/gallery/1/compare", {"files": probe}
    probe = {"probe": ("1_2.png", prints["1_2.png"])}
    for values in (*options, *matchers):
        subject = values | {"subject": "2"}
        yield "POST", "/verify", {"files": probe | reference, "data": values}
        yield "POST", "/identify", {"files": probe, "data": values}
        yield "POST", "/gallery/verify", {"files": probe, "data": subject}
        yield "POST", "/gallery/1/compare", {"files": probe, "data": values}
        yield "POST", "/enrol", {"files": {"image": probe["probe"]}, "data": subject}
    for name in ("broken", "csv", "../x", "json"):
        yield "POST", "/extract", {"files": {"image": probe["probe"]}, "data": {"format": name}}
    for path in ("/gallery/1/views", "/gallery/1/overlay"):
        yield "POST", path, {"files": {"probe": ("2_1.png", bad["2_1.png"])}}
    for path in ("/", "/gallery/7/compare", "/gallery/0", "/%2e%2e/x.py", "/gallery/%2e%2e"):
        yield "POST", path, {"files": probe}
    for path in (
        "/openapi.json",
        "/about",
        "/health",
        "/ready",
        "/metrics",
        "/gallery",
        "//",
        "/a",
    ):
        yield "GET", path, {}
    for subject in ("1", "2", "../ada", "nobody", "", "a\0"):
        yield "GET", "/gallery/prints", {"params": {"subject": subject}}
    for file in STATIC.iterdir():
        yield "GET", f"/{file.name}", {}
    for path in ("/gallery/99", "/gallery/x", "/gallery/prints?subject=nobody", "/gallery/1"):
        yield "DELETE", path, {}


@pytest.mark.slow
def test_no_answer_contains_a_folder_of_the_server(server, prints):
    statuses = set()
    for bearer in ({"authorization": f"Bearer {TOKEN}"}, {}):
        for method, path, parts in asked(prints):
            response = check(server.request(method, path, headers=bearer, **parts))
            statuses.add(response.status_code)
    assert statuses >= {200, 201, 401, 404, 405, 409, 422, 500}


def test_answers_name_the_files_of_enrolled_prints(server, prints):
    server.headers["authorization"] = f"Bearer {TOKEN}"
    probe = {"probe": ("1_2.png", prints["1_2.png"])}
    found = server.post("/identify", files=probe).json()["candidates"]
    assert "1_2.png" in {candidate["source"] for candidate in found}
    claim = server.post("/gallery/verify", files=probe, data={"subject": "1"}).json()
    assert claim["best"]["source"] == "1_2.png"
    taken = {"subject": "1", "impression": "2"}
    image = {"image": ("2_1.png", prints["2_1.png"])}
    again = check(server.post("/enrol", files=image, data=taken))
    assert (again.status_code, again.json()["error"]) == (
        409,
        "2_1.png: the same picture is enrolled as 2_1 already (2_1.png)",
    )
    other = {"image": ("new.png", prints["untold.png"])}
    refused = check(server.post("/enrol", files=other, data=taken))
    assert (refused.status_code, refused.json()["error"]) == (
        409,
        "new.png: another picture is enrolled as 1_2 already (1_2.png)",
    )


def test_a_plug_in_that_cannot_be_loaded_is_named_in_the_log_only(server, prints, caplog):
    server.headers["authorization"] = f"Bearer {TOKEN}"
    pair = {side: (f"{side}.png", prints["1_1.png"]) for side in ("probe", "reference")}
    answer = check(server.post("/verify", files=pair, data={"matcher": "broken"}))
    document = answer.json()
    assert answer.status_code == 500
    assert document["error"].startswith("a matcher or format of another package cannot be loaded")
    assert document["id"] in caplog.text
    assert MARKER in caplog.text
    text = check(server.post("/extract", files={"image": ("a.png", prints["text.png"])}))
    assert text.json() == {"error": "a.png: not an image of a known format"}


def test_the_working_folder_becomes_no_label(place, prints):
    gallery = place / "by_folder.db"
    with served_gallery(gallery, pattern=BY_FOLDER) as client:
        answer = check(client.post("/enrol", files={"image": ("1_1.png", prints["1_1.png"])}))
        assert answer.status_code == 422
        assert "does not contain the subject" in answer.json()["error"]
        assert client.get("/gallery").json()["impressions"] == 0
