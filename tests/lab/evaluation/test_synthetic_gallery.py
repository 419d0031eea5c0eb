import pytest

from fpmatch.gallery.gallery import Gallery, open_gallery
from fpmatch.gallery.store.stored_template import pack_template
from fpmatch.lab.evaluation import synthetic_gallery
from fpmatch.lab.evaluation.synthetic_gallery import make_gallery
from fpmatch.lab.synthesis.templates import make_templates


def content_of(path):
    with open_gallery(path) as gallery:
        return {str(entry.label): entry.template for _, entry in gallery.packed_entries()}


@pytest.fixture
def few_at_once(monkeypatch):
    monkeypatch.setattr(synthetic_gallery, "TEMPLATES_AT_ONCE", 4)


def test_a_gallery_has_the_templates_of_its_fingers(tmp_path, few_at_once):
    made = make_gallery(tmp_path / "g.db", fingers=5, impressions=2, seed=3, workers=1)
    assert (made.fingers, made.impressions, made.made) == (5, 2, 10)
    templates = make_templates(3, range(101, 106), 2)
    names = [f"{finger}_{m}" for finger in range(101, 106) for m in (1, 2)]
    expected = {n: pack_template(t) for n, t in zip(names, templates, strict=True)}
    assert content_of(tmp_path / "g.db") == expected


def test_an_interrupted_gallery_is_completed(tmp_path, few_at_once, monkeypatch):
    words = {"fingers": 7, "impressions": 2, "workers": 1}
    make_gallery(tmp_path / "whole.db", **words)
    add, calls = Gallery.add_packed, []

    def interrupted(self, *arguments):
        calls.append(1)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return add(self, *arguments)

    monkeypatch.setattr(Gallery, "add_packed", interrupted)
    with pytest.raises(KeyboardInterrupt):
        make_gallery(tmp_path / "half.db", **words)
    assert len(content_of(tmp_path / "half.db")) == 8
    assert make_gallery(tmp_path / "half.db", **words).made == 6
    assert content_of(tmp_path / "half.db") == content_of(tmp_path / "whole.db")
