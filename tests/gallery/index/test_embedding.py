"""Embeddings: pictures of prints, similar for prints of one finger, alike wherever they lie."""

import numpy as np
import pytest

from fpmatch.base.network import Network
from fpmatch.errors import FpmatchError
from fpmatch.gallery.index import embedding
from fpmatch.gallery.index.embedding import (
    LENGTH,
    SIDE,
    embeddings,
    pictures,
    turned_embeddings,
)
from fpmatch.matching.matchers.unit_circle import MATCHER
from fpmatch.templates.minutiae import Minutiae, RidgeField, Template
from research.templates.making import make_templates


def prepared(finger, impressions=1):
    return [MATCHER.prepare(t) for t in make_templates(77, [finger], impressions)]


def test_a_picture_has_all_minutiae_and_the_whole_area():
    (print_,) = prepared(3)
    (shown,) = pictures([print_], 64)
    assert shown.shape == (6, 64, 64)
    assert shown[5].sum() == pytest.approx(len(print_), abs=1e-3)
    assert shown[2].sum() * 256 == pytest.approx(print_.region.area, rel=0.02)
    assert np.hypot(*shown[:2]).max() <= 1 + 1e-5


def test_embeddings_of_a_finger_point_the_same_way():
    pairs = [embeddings(prepared(finger, 2)).astype(int) for finger in range(12)]
    own = [int(a @ b) for a, b in pairs]
    others = [int(pairs[k][0] @ pairs[k - 1][1]) for k in range(12)]
    assert np.median(own) > np.max(others)
    assert all(80_000 < int(a @ a) < 100_000 for a, _ in pairs)


def test_a_print_has_one_embedding_alone_and_among_many():
    prints = [print_ for finger in range(5) for print_ in prepared(finger)]
    together = embeddings(prints)
    assert together.shape == (5, LENGTH)
    apart = np.concatenate([embeddings([print_]) for print_ in prints])
    assert (together == apart).all()
    assert (pictures(prints) == np.concatenate([pictures([print_]) for print_ in prints])).all()
    assert embeddings([]).shape == (0, LENGTH)


def test_turned_embeddings_are_those_of_the_turned_print():
    (template,) = make_templates(77, [4], 1)
    m, field, size = template.minutiae, template.field, template.height
    of_probe = turned_embeddings(MATCHER.prepare(template)).astype(int)
    for quarter in range(1, 4):
        m = Minutiae(m.y, size - m.x, m.angle + np.pi / 2, m.kind, m.quality)
        turned = np.rot90(field.orientation) + np.float32(np.pi / 2)
        field = RidgeField(field.step, turned % np.float32(np.pi), np.rot90(field.mask), None)
        given = Template(m, size, size, 500.0, field)
        (own,) = embeddings([MATCHER.prepare(given)]).astype(int)
        assert (of_probe @ own).argmax() == quarter
        assert of_probe[quarter] @ own > 0.9 * (own @ own)


def test_a_damaged_network_is_one_line(tmp_path):
    path = tmp_path / "network.onnx"
    path.write_bytes(embedding.NETWORK_FILE.read_bytes()[:-1])
    with pytest.raises(FpmatchError, match="damaged, or the network of another version"):
        Network(path, embedding.NETWORK_SHA256)(np.zeros((1, 6, SIDE, SIDE), np.float32))
