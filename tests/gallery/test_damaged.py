"""One damaged entry is named, skipped and counted; the rest of the gallery works as before."""

import json
import struct
import zlib

import pytest
from made_prints import changed, entry_of, flipped, scattered

from fpmatch.formats.files import save_template
from fpmatch.gallery.batch.sources import open_source
from fpmatch.gallery.cli.export import export_gallery
from fpmatch.gallery.engine.engine import serial
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.search.identify import identify
from fpmatch.gallery.search.search import Search
from fpmatch.gallery.store.stored_template import pack_template
from fpmatch.gallery.tasks.claim import check_claim
from fpmatch.gallery.tasks.consistency import check_fingers, find_damaged
from fpmatch.prints.reading import GivenPrint

PRINTS = 6  # two of each of three subjects
DAMAGED = 3


def without_step(packed):
    """Return a packed template whose ridge field has a step of 0, with a right checksum."""
    field = struct.Struct("<fHHHHHH").pack(0.0, 1, 1, 0, 0, 0, 0)
    body = bytearray(packed[:-4] + field)
    body[3] = 1
    return bytes(body) + struct.pack("<I", zlib.crc32(body))


GOOD = pack_template(scattered(DAMAGED, 30))
TEMPLATES = {
    "bit": flipped(GOOD, 40),
    "cut": GOOD[:50],
    "empty": b"",
    "null": "",
    "number": 10**12,
    "zeros": bytes(5000),
    "step": without_step(GOOD),
    "other minutiae": pack_template(scattered(1, 20)),
}
NUMBERS = {
    "dpi text": ("dpi", "fine"),
    "dpi infinite": ("dpi", 9e999),
    "dpi other": ("dpi", 600.0),
    "minutiae text": ("minutiae", "many"),
    "minutiae negative": ("minutiae", -1),
    "minutiae huge": ("minutiae", 2**63 - 1),
}
LABELS = {
    "subject blob": ("subject", b"\xff\xfe"),
    "finger number": ("finger", b"7"),
    "source": ("source", b"/prints"),
    "content": ("content", "text"),
}
DAMAGE = {**{name: ("template", value) for name, value in TEMPLATES.items()}, **NUMBERS, **LABELS}
NOT_UTF_8 = "UPDATE fpmatch_entry SET subject = CAST(x'31ff' AS TEXT) WHERE id = ?"


def fill(path):
    with open_gallery(path, create=True) as gallery:
        gallery.add(
            [
                entry_of(k, scattered(k, 30), Label(str((k + 1) // 2), "", str(k)))
                for k in range(1, PRINTS + 1)
            ]
        )


def mutate(path, column, value, number=DAMAGED):
    """Change one cell of a gallery behind its back."""
    changed(path, f"UPDATE fpmatch_entry SET {column} = ? WHERE id = ?", value, number)


@pytest.fixture(params=DAMAGE)
def place(request, tmp_path):
    """Return a gallery one of whose entries is damaged."""
    fill(tmp_path / "g.db")
    mutate(tmp_path / "g.db", *DAMAGE[request.param])
    return tmp_path / "g.db"


few = pytest.mark.parametrize("place", ["bit", "step", "dpi text"], indirect=True)
SOUND = [k for k in range(1, PRINTS + 1) if k != DAMAGED]


def test_every_reader_skips_it(place, tmp_path):
    with open_gallery(place) as gallery:
        search = Search(gallery, engine=serial())
        assert identify(search, scattered(DAMAGED, 30)).compared == len(SOUND)
        assert list(gallery.damaged) == [DAMAGED]
        assert gallery.damaged[DAMAGED]
        for listed in ("fingers", "subjects"):
            found = identify(search, scattered(1, 30), listed=listed)
            assert (len(found.entries), found.entries[0].id, found.enrolled) == (3, 1, len(SOUND))
            assert [one.rank for one in found.candidates] == [1, 2, 3]
        checked = check_claim(gallery, GivenPrint("probe", scattered(4, 30)), "2")
        assert [entry.id for entry in checked.entries] == [4]
        assert checked.as_dict()["damaged"] in {0, 1}  # 0: nothing shows whose it was
        assert [check["subject"] for check in check_fingers(gallery)] == ["1", "3"]
        assert list(find_damaged(gallery)) == [DAMAGED]
        assert [entry.id for entry in gallery.entries() if entry.id != DAMAGED] == SOUND
    assert export_gallery(str(place), tmp_path / "out", "json", None) == 1
    source = open_source(place)
    items = list(source.templates(serial(), range(len(source.names))))
    assert sum(item.data is not None for item in items) == len(SOUND)
    assert sum(item.data is None for item in items) + len(source.damaged) == 1
    assert len(list((tmp_path / "out").iterdir())) == len(SOUND)


@few
def test_it_is_removed_like_any_other(place):
    with open_gallery(place) as gallery:
        again = entry_of(DAMAGED, scattered(DAMAGED, 30), Label("2", "", str(DAMAGED)))
        (conflict,) = gallery.add([again])
        assert conflict is not None
        gallery.remove([DAMAGED])
        assert find_damaged(gallery) == {}
        assert gallery.add([again]) == [None]
        assert find_damaged(gallery) == {}


@few
def test_commands_name_it_once_and_count_it(run, place, tmp_path):
    probe = tmp_path / "probe.json"
    save_template(probe, scattered(1, 30))

    def named(*words, status=0, times=1):
        """Return the JSON that a command prints, which names the entry."""
        result = run(*words, "--json")
        assert result.exit_code == status, result.output
        assert result.stderr.count(f"entry {DAMAGED} is skipped") == times
        return json.loads(result.stdout)

    document = named("identify", place, probe, "--workers", "1")
    assert document["damaged"] == 1
    assert document["probes"][0]["candidates"][0]["id"] == 1
    checks = named("gallery", "check", place, status=1, times=0)
    assert [one["groups"] for one in checks if "damaged" in one] == [[[DAMAGED]]]
    claim = ("--gallery", place, "--subject", "1")
    assert named("verify", probe, *claim, times=0)["impressions"] == 2
    sides = ("--references", place, "--probes", place, "-o", tmp_path / "s.csv", "--workers", "1")
    assert len(named("score", *sides, status=1, times=0)["failures"]) == 1
    assert len((tmp_path / "s.csv").read_text().splitlines()) > len(SOUND) ** 2
    result = run("gallery", "list", place, "--json")
    skipped = result.stderr.count(f"entry {DAMAGED} is skipped")
    assert len(json.loads(result.stdout)) + skipped == PRINTS
    assert run("extract", "--gallery", place, "-o", tmp_path / "out").exit_code == 1


def test_text_that_is_not_utf_8_is_damage_of_one_entry(tmp_path):
    fill(tmp_path / "g.db")
    changed(tmp_path / "g.db", NOT_UTF_8, DAMAGED)
    with open_gallery(tmp_path / "g.db") as gallery:
        assert [entry.id for entry in gallery.entries()] == SOUND
        assert list(gallery.damaged) == [DAMAGED]
