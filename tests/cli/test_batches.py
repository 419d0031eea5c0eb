"""A batch with damaged files among them is dealt with to the end, and exactly those are named.

A long run is `python -m research check batches`.
"""

from fpmatch.lab.synthesis.sensor import Sensor
from research.checks.batches import DAMAGES, check_batches, make_batches

SMALL = Sensor("small", 180, 200)


def test_every_command_names_exactly_the_damaged_ones(tmp_path):
    verdicts = check_batches(tmp_path, 2 * len(DAMAGES), SMALL, every=2)
    assert len({verdict.command for verdict in verdicts}) == 9
    assert {verdict.command: verdict.faults for verdict in verdicts if verdict.faults} == {}


def test_every_way_of_damage_is_tried_once(tmp_path):
    images, templates = make_batches(tmp_path, 2 * len(DAMAGES), SMALL, 2, fingers=1)
    assert len(images.damaged) == len(templates.damaged) == len(DAMAGES)
    assert len({path.suffix for path in images.files}) == 5
