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
