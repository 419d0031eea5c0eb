"""Sides and a matcher whose scores are known; a module, so that workers can import it."""

import time

import numpy as np

from fpmatch.gallery.batch.sources import StoredTemplate, pack
from fpmatch.matching.result import Comparison, Matcher
from fpmatch.templates.minutiae import Minutiae, Template


class Line:
    """Prints of one minutia each, at places along a line; those at None have no template."""

    def __init__(self, places, place="line"):
        self.places = places
        self.place = self.title = place
        self.names = [f"{place}_{n}" for n in range(len(places))]
        self.fingers = list(self.names)
        self.content_hash = repr((place, places))

    def templates(self, engine, numbers):
        for x in (self.places[n] for n in numbers):
            if x is None:
                yield StoredTemplate(None, "no image, but text")
            else:
                data = pack(Template(Minutiae([x], [0], [0]), 300, 300))
                yield StoredTemplate(
                    data, dpi_assumed=x == 7, notes=("it is far off",) if x > 35 else ()
                )


class Near(Matcher):
    """Call prints alike that lie near each other, after a moment's thought."""

    name = "near"

    def __init__(self, seconds=0.0):
        self.seconds = seconds

    def prepare(self, template):
        return float(template.minutiae.x[0])

    def compare(self, probe, reference):
        time.sleep(self.seconds)
        similarity = 1 / (1 + abs(probe - reference))
        return Comparison(similarity, None, np.zeros((0, 2), np.int32), 0.0, 0.0, 0.0)
