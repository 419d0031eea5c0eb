"""Numbers and texts of clients at the end of what can be sent: one sentence, nothing stored."""

import json
import re
from itertools import product

import pytest

from .conftest import png

CONTROLS = re.compile("[\x00-\x1f\x7f-\x9f\u2028-\u202e\ud800-\udfff]")
TEXTS = ("a\0b", "\x1b[2J", "a\nb", "a\x9bb", "\u202eb", "a\u2028b", "x" * 5_000)
NUMBERS = ("nan", "inf", "-inf", "-1", "1e999", "5e-324", "9" * 5_000, "\x1b[2J", "a\0b")


@pytest.fixture(scope="module")
def image(fingers):
    return png(fingers[0])


def assert_refused(answer):
    """Check for a status of the client's fault and one sentence that no terminal obeys."""
    assert 400 <= answer.status_code < 500, answer.text
    assert not CONTROLS.search(answer.json()["error"])
    assert len(answer.json()["error"]) < 2_500


@pytest.mark.parametrize(
    ("field", "text"), [("subject", "   "), *product(("subject", "finger", "impression"), TEXTS)]
)
def test_labels_are_short_text_of_one_line(server, image, field, text):
    data = {"subject": "ada", field: text}
    answer = server.post("/enrol", files={"image": ("p.png", image)}, data=data)
    assert_refused(answer)
    assert server.get("/gallery").json()["impressions"] == 0


@pytest.mark.parametrize("text", TEXTS)
def test_subjects_that_are_asked_for_are_text_of_one_line(server, image, text):
    assert_refused(server.get("/gallery/prints", params={"subject": text}))
    files = {"probe": ("p.png", image)}
    assert_refused(server.post("/gallery/verify", files=files, data={"subject": text}))


@pytest.mark.parametrize("value", NUMBERS)
def test_numbers_that_are_none_are_refused(server, image, value):
    files = {"probe": ("p.png", image), "reference": ("q.png", image)}
    for field in ("dpi", "probe_dpi", "reference_dpi", "fmr", "matcher", "enhance"):
        assert_refused(server.post("/verify", files=files, data={field: value}))
    probe = {"probe": ("p.png", image)}
    for field in ("dpi", "candidates", "matcher"):
        if (field, value) != ("candidates", "9" * 5_000):
            assert_refused(server.post("/identify", files=probe, data={field: value}))
    assert_refused(server.post(f"/gallery/{10**20}/compare", files=probe))


@pytest.mark.parametrize("name", [b"\xff", b"\xed\xa0\x80", b"\x1b[2J", b"a\x9bb", b"=1+1"])
def test_names_of_files_that_are_no_text(server, image, name):
    body = (
        b'--b\r\nContent-Disposition: form-data; name="image"; filename="' + name + b'_1.png"'
        b"\r\n\r\n" + image[: len(image) // 2] + b"\r\n--b--\r\n"
    )
    kind = {"content-type": "multipart/form-data; boundary=b"}
    assert_refused(server.post("/enrol", content=body, headers=kind))


@pytest.mark.parametrize("count", [1, 40])
def test_coordinates_that_overflow_are_refused(server, image, count):
    document = server.post("/extract", files={"image": ("p.png", image)}).json()
    document["dpi"] = 100
    document["minutiae"]["x"][:count] = [3e38] * min(count, len(document["minutiae"]["x"]))
    data = json.dumps(document).encode()
    pair = {"probe": ("far.json", data), "reference": ("far.json", data)}
    for url, files in (
        ("/verify", pair),
        ("/identify", {"probe": ("far.json", data)}),
        ("/enrol", {"image": ("1_1.json", data)}),
    ):
        answer = server.post(url, files=files)
        assert_refused(answer)
        assert "x must be a list of finite numbers" in answer.json()["error"]
    assert server.get("/gallery").json()["impressions"] == 0
