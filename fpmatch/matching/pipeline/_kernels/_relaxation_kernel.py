# mypy: ignore-errors
"""Kernel: relaxation of the local matches of two prints.

A candidate is a pair of minutiae, one of each print, whose neighbourhoods are similar. Two
candidates support each other where the second lies, in both prints, at about the same distance and
in about the same direction from the first, and where both turn by about the same angle. In a few
rounds every candidate takes over a share of the support of the others, so that candidates that no
other supports fade. No transform of the whole print is assumed: the tolerance of the distance
grows with the distance, because skin stretches.

Source: relaxation of local matches as in Cappelli, Ferrara, Maltoni, "Minutia Cylinder-Code", IEEE
TPAMI 32(12), 2010, section 4.2, with tolerances that grow with the distance.
"""

import cython
import numpy as np
from cython.cimports.libc.math import sqrt

from fpmatch.matching import constants

COINCIDENT = cython.declare(cython.double, constants.COINCIDENT)


@cython.final
@cython.cclass
class Relaxation:
    """The candidates of two prints and the support that they give one another.

    Prints have at most `size_a` and `size_b` minutiae. After `load`, candidate k of
    `count` is the pair ``(first[k], second[k])``, ``relaxed[k]`` its similarity after relaxation
    and ``support[k, m]`` the compatibility of candidates k and m, 0 to 1. `strength` is the mean of
    the four greatest relaxed similarities, missing ones counting as 0.
    """

    def __init__(self, parameters, size_a, size_b) -> None:
        p = parameters
        room = p.candidates
        self.capacity = room
        self.first, self.second, self.explained = np.zeros((3, room), np.int32)
        self.relaxed, self.gathered = np.zeros((2, room))
        self.support = np.zeros((room, room))
        self.place = np.zeros((4, room))
        self.rotation = np.zeros((2, room))
        self.row_best = np.zeros(size_a)
        self.row_column = np.zeros(size_a, np.int32)
        self.column_taken = np.zeros(size_b, np.int32)
        self.distance_px, self.distance_per_px = p.distance_px, p.distance_per_px
        self.min_rotation_cosine, self.min_angle_cosine = p.min_rotation_cosine, p.min_angle_cosine
        self.inertia = p.inertia
        self.least_share, self.least_seed_share = p.least_share, p.least_seed_share
        self.rounds = p.relaxation_rounds

    @cython.locals(k=cython.Py_ssize_t)
    def load(self, a, size_a, b, size_b, similarity):
        """Select the candidates of two prints and relax them; return their number.

        `a` and `b` are minutiae (4, N): x, y with y up, and the unit vector of the direction;
        ``similarity[i, j]`` is the local similarity of minutia i of A and minutia j of B.
        """
        self._select(size_a, size_b, similarity)
        for k in range(self.count):
            i: cython.Py_ssize_t = self.first[k]
            j: cython.Py_ssize_t = self.second[k]
            self.place[0, k], self.place[1, k] = a[0, i], a[1, i]
            self.place[2, k], self.place[3, k] = b[0, j], b[1, j]
            self.rotation[0, k] = a[2, i] * b[2, j] + a[3, i] * b[3, j]
            self.rotation[1, k] = a[2, i] * b[3, j] - a[3, i] * b[2, j]
            self.relaxed[k] = float(similarity[i, j])
            self.explained[k] = 0
            self.support[k, k] = 0.0
            for m in range(k):
                self.support[k, m] = self._compatibility(k, m)
                self.support[m, k] = self.support[k, m]
        return self._relax()

    def _select(self, size_a, size_b, similarity):
        """Select the pairs of the greatest similarity, each minutia once; the first of equals."""
        self.count = 0
        for i in range(size_b):
            self.column_taken[i] = 0
        for i in range(size_a):
            self._best_of_row(i, size_b, similarity)
        while self.count < self.capacity:
            best = -1
            most = 0.0
            for i in range(size_a):
                if self.row_best[i] > most:
                    if self.column_taken[self.row_column[i]]:
                        self._best_of_row(i, size_b, similarity)
                    if self.row_best[i] > most:
                        most = self.row_best[i]
                        best = i
            if best < 0:
                break
            self.first[self.count] = best
            self.second[self.count] = self.row_column[best]
            self.row_best[best] = 0.0
            self.column_taken[self.row_column[best]] = 1
            self.count += 1
        return self.count

    def _best_of_row(self, i, size_b, similarity):
        """Note the free minutia of B that is most similar to minutia i of A."""
        most = 0.0
        column: cython.int = 0
        for j in range(size_b):
            if float(similarity[i, j]) > most and not self.column_taken[j]:
                most = float(similarity[i, j])
                column = j
        self.row_best[i] = most
        self.row_column[i] = column
        return column

    def _compatibility(self, k, m):
        """Return how well two candidates agree, 0 to 1.

        It is the product of three terms, each 1 for perfect agreement and 0 at its tolerance: of
        the distances of the two minutiae in either print, of the rotations of the two pairs, and of
        the directions from one minutia to the other, turned by the mean rotation.
        """
        rotation = self.rotation[0, k] * self.rotation[0, m]
        rotation += self.rotation[1, k] * self.rotation[1, m]
        rotation -= self.min_rotation_cosine
        if rotation <= 0.0:
            return 0.0
        ax = self.place[0, m] - self.place[0, k]
        ay = self.place[1, m] - self.place[1, k]
        bx = self.place[2, m] - self.place[2, k]
        by = self.place[3, m] - self.place[3, k]
        length_a = sqrt(ax * ax + ay * ay)
        length_b = sqrt(bx * bx + by * by)
        shorter = min(length_a, length_b)
        if shorter < COINCIDENT:
            return 0.0
        distance = (length_a - length_b) / (self.distance_px + self.distance_per_px * shorter)
        distance = 1.0 - distance * distance
        if distance <= 0.0:
            return 0.0
        c = self.rotation[0, k] + self.rotation[0, m]
        s = self.rotation[1, k] + self.rotation[1, m]
        angle = (c * ax - s * ay) * bx + (s * ax + c * ay) * by
        angle = angle / (sqrt(c * c + s * s) * length_a * length_b) - self.min_angle_cosine
        if angle <= 0.0:
            return 0.0
        rotation = rotation / (1.0 - self.min_rotation_cosine)
        return distance * rotation * angle / (1.0 - self.min_angle_cosine)

    @cython.locals(k=cython.Py_ssize_t, m=cython.Py_ssize_t)
    def _relax(self):
        """Relax: every candidate keeps a share of its value and takes the rest from the others.

        Return their number.
        """
        n = self.count
        share = (1.0 - self.inertia) / (n - 1 if n > 1 else 1)
        support, relaxed, gathered = self.support, self.relaxed, self.gathered
        for r in range(self.rounds):
            for k in range(n):
                gathered[k] = 0.0
            for m in range(n):
                value = relaxed[m]
                for k in range(n):
                    gathered[k] += value * support[m, k]
            for k in range(n):
                relaxed[k] = self.inertia * relaxed[k] + share * gathered[k]
        first = second = third = fourth = 0.0
        for k in range(n):
            value = relaxed[k]
            first, value = max(first, value), min(first, value)
            second, value = max(second, value), min(second, value)
            third, value = max(third, value), min(third, value)
            fourth = max(fourth, value)
        self.strength = 0.25 * (first + second + third + fourth)
        return n

    @cython.locals(k=cython.Py_ssize_t)
    def hypothesis(self, size_a, whole, partner, weight):
        """Write the pairs of the next hypothesis; return their number, 0 where there is none left.

        Its seed is the strongest candidate that no earlier hypothesis explains; where that is much
        weaker than the strongest of all, there is no hypothesis left. Where `whole`, all
        candidates that are strong enough are its pairs; else each counts as much as it supports the
        seed. The weights are relative to the seed's.
        """
        seed: cython.Py_ssize_t = -1
        pairs: cython.int = 0
        most = strongest = 0.0
        for i in range(size_a):
            partner[i] = -1
            weight[i] = 0.0
        for k in range(self.count):
            if self.relaxed[k] > strongest:
                strongest = self.relaxed[k]
            if not self.explained[k] and self.relaxed[k] > most:
                most = self.relaxed[k]
                seed = k
        if seed < 0 or most < self.least_seed_share * strongest:
            return 0
        self.explained[seed] = 1
        for k in range(self.count):
            value = self.relaxed[k]
            if not whole and k != seed:
                value *= self.support[seed, k]
            value /= most
            if value >= self.least_share:
                partner[self.first[k]] = self.second[k]
                weight[self.first[k]] = value
                pairs += 1
        return pairs

    @cython.locals(k=cython.Py_ssize_t)
    def explain(self, partner):
        """Mark the candidates among these pairs as explained; return how many they are."""
        found: cython.int = 0
        for k in range(self.count):
            if partner[self.first[k]] == self.second[k]:
                self.explained[k] = 1
                found += 1
        return found

    @cython.locals(k=cython.Py_ssize_t)
    def support_of(self, partner):
        """Return the sum of the relaxed similarities of the candidates among these pairs."""
        total = 0.0
        for k in range(self.count):
            if partner[self.first[k]] == self.second[k]:
                total += self.relaxed[k]
        return total
