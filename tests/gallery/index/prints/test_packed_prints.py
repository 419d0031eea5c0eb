"""What packed prints of every kind do alike: join, take, come back from a file, refuse damage."""

import numpy as np
import pytest
from matching_prints import SIZES, some_templates, template_of

from fpmatch.errors import MatcherError
from fpmatch.gallery.index.prints import compact_template, prepared_prints, stored_descriptors
from fpmatch.gallery.store.array_file import read_arrays, write_arrays
from fpmatch.matching.parameters import MatchParameters
from fpmatch.matching.prints.prepare import prepare

KINDS = {
    "prepared": (prepared_prints, prepared_prints.PreparedPrints, prepare),
    "descriptors": (stored_descriptors, stored_descriptors.StoredDescriptors, prepare),
    "compact": (compact_template, compact_template.CompactTemplates, lambda template: template),
}
every_kind = pytest.mark.parametrize("kind", KINDS)


def packed_of(kind, sizes=SIZES):
    _, packer, made = KINDS[kind]
    return packer.pack(map(made, some_templates(sizes)))


def arrays_of(packed):
    arrays = packed.arrays().items()
    return {name: (array.dtype, array.shape, array.tobytes()) for name, array in arrays}


@every_kind
@pytest.mark.parametrize("sizes", [(), (0,), SIZES])
def test_parts_files_and_chosen_prints_are_those_of_the_whole(kind, sizes, tmp_path):
    module, packer, made = KINDS[kind]
    prints, whole = [*map(made, some_templates(sizes))], packed_of(kind, sizes)
    parts = packer.concatenate([packer.pack(part) for part in (prints[:2], [], prints[2:])])
    assert arrays_of(parts) == arrays_of(whole)
    assert len(whole) == len(sizes)
    assert len(packer.concatenate([])) == 0
    path = tmp_path / "packed"
    write_arrays(path, whole.arrays(), module.COLUMNS, {})
    mapped = packer.of_arrays(read_arrays(path, module.COLUMNS, {}))
    assert arrays_of(mapped) == arrays_of(whole)
    which = [k for k in (3, 3, 0, 1, 4) if k < len(sizes)]
    taken = mapped.take(np.array(which, np.intp))
    assert arrays_of(taken) == arrays_of(packer.pack([prints[k] for k in which]))
    for outside in (-1, len(sizes), 99):
        with pytest.raises(IndexError, match=f"of {len(sizes)}"):
            whole[outside]


@pytest.mark.parametrize("kind", ["prepared", "descriptors"])
def test_more_minutiae_than_a_byte_can_number_are_refused(kind):
    points = np.zeros((4, 300))
    points[0], points[2] = np.arange(300) * 7.0, 1
    beyond = MatchParameters()
    object.__setattr__(beyond, "max_minutiae", 300)  # out of range
    crowd = prepare(template_of(points), beyond)
    few = prepare(template_of(points), MatchParameters(max_minutiae=6))
    with pytest.raises(MatcherError, match="300"):
        KINDS[kind][1].pack([crowd])
    assert len(KINDS[kind][1].pack([few])) == 1


DAMAGES = {
    "prepared": [
        *(("minutiae_start", 0, 1), ("minutiae_start", 1, 10**9), ("minutiae_start", 2, 20)),
        *(("minutiae_start", 1, -1), ("minutiae_start", 1, 2**63 - 1), ("minutiae_start", 3, 24)),
        *(("cell_start", 1, 10**9), ("cell_start", 1, -(2**63)), ("cell_start", 3, 0)),
        *(("xy", 3, np.nan), ("direction", 0, np.inf), ("direction", 4, np.nan)),
        *(("count", 0, 13), ("count", 24, 255), ("neighbour", 4, 12), ("neighbour", 299, 4)),
        *(("orientation_bins", 7, 32), ("orientation_bins", 299, 255)),
        *(("shape", 0, 100), ("shape", 0, -9), ("shape", 2, -1), ("shape", 3, 2**31 - 1)),
        *(("index", 0, -1), ("index", 3, 2), ("index", 24, -(2**31)), ("index", 13, 0)),
        *(("step", 1, np.nan), ("step", 1, 0.0), ("step", 2, -16.0), ("step", 0, np.inf)),
        *(("to_500dpi", 0, np.nan), ("to_500dpi", 1, 0.0), ("to_500dpi", 2, -1.0)),
        *(("xy", 0, 1e30), ("direction", 1, 0.5), ("step", 0, 1e-300), ("to_500dpi", 0, 1e300)),
        *(("index", 24, 2**16), ("step", 0, 1e300), ("direction", 2, 1e30)),
        *(("has_flow", 0, 2), ("has_ridges", 2, 255), ("inside", 0, -1), ("inside", 1, 10**9)),
    ],
    "descriptors": [
        *(("content_start", 0, 1), ("content_start", 1, 10**9), ("content_start", 2, -1)),
        *(("content_start", 1, 2**63 - 1), ("content_start", 1, -(2**63))),
        *(("origin", 0, np.nan), ("origin", 3, np.inf), ("origin", 1, 1e30)),
        *(("size", 1, 257), ("step", 0, 8), ("step", 2, 255), ("has_flow", 0, 2)),
    ],
    "compact": [
        *(("content_start", 0, 1), ("content_start", 1, 10**9), ("content_start", 1, -1)),
        *(("content_start", 2, 3), ("content_start", 3, 0), ("content_start", 1, 2**63 - 1)),
        ("content_start", 2, -(2**63)),
    ],
}


@pytest.mark.parametrize(
    ("kind", "damage"), [(kind, damage) for kind in DAMAGES for damage in DAMAGES[kind]]
)
def test_numbers_that_would_lead_astray_are_refused(kind, damage):
    packed, (name, at, value) = packed_of(kind, (12, 9, 4)), damage
    array = getattr(packed, name).copy()
    array.ravel()[at] = value
    with pytest.raises(MatcherError) as caught:
        type(packed).of_arrays(packed.arrays() | {name: array})
    assert caught.value.code == "damaged"
