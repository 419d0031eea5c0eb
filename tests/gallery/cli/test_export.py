"""`fpmatch extract --gallery`: which files it writes, and what excludes it."""

import pytest

from fpmatch.formats.files import load_record, load_template
from fpmatch.gallery.gallery import open_gallery
from fpmatch.gallery.listing.entry import Label
from fpmatch.gallery.store.rows import new_entry
from fpmatch.templates.minutiae import Minutiae, Template
from tests.conftest import assert_refused


def test_export(run, place, tmp_path):
    out = tmp_path / "out"
    result = run("extract", "--gallery", place, "-o", out)
    assert result.stdout == f"3 templates: {out}\n"
    stems = ("1_1", "1_2", "a%2Fb_thumb_1")
    assert {path.name for path in out.iterdir()} == {
        f"{stem}.{suffix}" for stem in stems for suffix in ("csv", "json")
    }
    with open_gallery(place) as gallery:
        assert load_template(out / "1_2.json") == dict(gallery.templates())[2]
    iso = run("extract", "--gallery", place, "-o", out, "--format", "iso2005", "--subject", "1")
    assert iso.stdout == f"2 templates: {out}\n"
    assert sorted(path.name for path in out.glob("*.iso")) == ["1_1.iso", "1_2.iso"]
    assert load_record(out / "1_1.iso").format == "iso2005"
    assert all(line.startswith(f"fpmatch: note: {out}") for line in iso.stderr.splitlines())


def test_export_does_not_mix_up_names(run, place, tmp_path):
    with open_gallery(place) as gallery:
        template = Template(Minutiae([1], [1], [0]), 300, 300)
        gallery.add([new_entry(Label("A/B_thumb_1"), "x", b"x" * 32, template)])
    result = run("extract", "--gallery", place, "-o", tmp_path / "out")
    assert_refused(result, "entries 3 and 4 would both be written as A%2FB_thumb_1")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("--gallery g.db a.png", "IMAGE|DIR... cannot be combined with --gallery"),
        ("--gallery g.db --json", "--json cannot be combined with --gallery"),
        ("--gallery g.db --format stages", "--format stages cannot be combined with --gallery"),
        ("--subject 1 a.png", "--subject needs --gallery"),
        ("", "Missing argument 'IMAGE|DIR...'"),
    ],
)
def test_what_is_of_images_is_refused_with_a_gallery(run, tmp_path, words, reason):
    result = run("extract", *words.split(), "-o", tmp_path / "out")
    assert (result.exit_code, result.stdout) == (2, "")
    assert reason in result.stderr
    assert not (tmp_path / "out").exists()
