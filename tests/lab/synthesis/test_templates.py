import numpy as np
import pytest

from fpmatch.errors import DatasetError, ImageError
from fpmatch.lab.synthesis.templates import make_templates
from fpmatch.matching.matchers.unit_circle import MATCHER


def same(a, b):
    return a.minutiae == b.minutiae and a.field == b.field and (a.width, a.dpi) == (b.width, b.dpi)


def test_each_template_is_the_same_alone_and_among_others():
    together = list(make_templates(7, range(3, 38), impressions=2))
    for finger in (3, 35, 37):
        for impression in (1, 2):
            (alone,) = make_templates(7, [finger], first_impression=impression)
            assert same(alone, together[2 * (finger - 3) + impression - 1])


def test_impressions_of_a_finger_match_and_those_of_others_do_not():
    prints = [MATCHER.prepare(t) for t in make_templates(3, range(8), 2, preset="easy")]
    for k in range(0, len(prints), 2):
        mates = MATCHER.compare(prints[k], prints[k + 1]).similarity
        others = [MATCHER.compare(prints[k], p).similarity for p in prints[k + 2 :]]
        assert mates > max([8.0, *others])


def test_another_seed_gives_other_fingers():
    (one,), (other,) = (make_templates(seed, [5]) for seed in (0, 1))
    assert not same(one, other)


def test_templates_have_the_size_and_resolution_of_their_sensor():
    for template in make_templates(0, [1, 2], sensors=["optical-296x560"]):
        assert (template.width, template.height, template.dpi) == (296, 560, 569.0)
        m = template.minutiae
        assert len(m) >= 5
        assert m.x.min() >= 0
        assert (m.x < template.width).all()
        assert (m.y < template.height).all()
        inside = template.field.mask[
            (m.y / template.field.step).astype(int), (m.x / template.field.step).astype(int)
        ]
        assert np.mean(inside) > 0.8


def test_sensors_take_impressions_in_turn():
    names = ["plain-288x384", "capacitive-300x300", "plain-288x384"]
    made = list(make_templates(0, range(35), impressions=4, sensors=names))
    assert [t.width for t in made] == [288, 300, 288, 288] * 35
    (alone,) = make_templates(0, [34], first_impression=4, sensors=names)
    assert same(alone, made[-1])


@pytest.mark.parametrize(
    ("seed", "fingers", "options", "error"),
    [
        (-1, [1], {}, DatasetError),
        (2**63, [1], {}, DatasetError),
        (0, [-1], {}, DatasetError),
        (0, [2**60], {}, DatasetError),
        (0, [1], {"impressions": 0}, DatasetError),
        (0, [1], {"impressions": 1001}, DatasetError),
        (0, [1], {"first_impression": 0}, DatasetError),
        (0, [1], {"sensors": ["none"]}, DatasetError),
        (0, [1], {"sensors": []}, DatasetError),
        (0, [1], {"preset": "none"}, ImageError),
    ],
)
def test_numbers_out_of_range_are_refused(seed, fingers, options, error):
    with pytest.raises(error):
        list(make_templates(seed, fingers, **options))
