"""`research.training.index`: the model that the terms of prints come to."""

import json

import numpy as np
import pytest

from fpmatch.gallery.index.loss import loss_table
from fpmatch.gallery.index.model import MODEL_FILE, TERMS, index_model
from research.training.index import document_of, model_of_edges


def test_a_model_has_the_shares_of_lengths_and_of_directions_from_either_end(rng):
    terms = rng.integers(0, TERMS, 500).astype(np.uint16)
    model = model_of_edges(terms, 9)
    assert model.lengths.sum() == pytest.approx(1)
    assert model.directions.sum() == pytest.approx(1)
    assert model.edges == len(terms) / 9
    # from the other end, the two sides change places, and the curvature its sign
    other = np.roll(model.directions.transpose(1, 0, 2), (12, 12), (0, 1))
    other = other[:, :, [5, 4, 3, 2, 1, 0, 6]]
    assert other == pytest.approx(model.directions)


def test_the_model_of_the_package_is_written_as_it_is():
    document = json.loads(MODEL_FILE.read_bytes())
    assert document_of(index_model(), loss_table()) == {
        name: document[name] for name in ("lengths", "directions", "edges", "loss")
    }
