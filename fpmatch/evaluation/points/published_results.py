"""The paper's experiment on random point sets: its parameters, and the times it published.

Tables 1 and 2 of N. Choi, B.-G. Lee and J. J. Lee, "Point pattern matching algorithm using
unit-circle parametrization", section 4.2, give seconds a match, on average, on a processor of
1.66 GHz. Table 1 is the algorithm of van Wamelen, Li and Iyengar (2004), Table 2 the paper's own.
The paper does not say how often either of them was right.
"""

from __future__ import annotations

from typing import Final, NamedTuple

TARGET_FACTORS: Final = (2, 4, 8)
"""Points of Q for each point of P, in the order of the tables' columns."""


class PaperRow(NamedTuple):
    """One row of the paper's two tables."""

    m: int  # points of P; Q has 2, 4 and 8 times as many
    rho: float  # share of P that has a partner in Q, and that a match must reach
    eta: float  # radius of the jitter, in mean nearest-neighbour distances of Q
    lambda_: float  # matching distance, in the same unit
    van_wamelen_s: tuple[float, float, float]  # seconds in Table 1 for n = 2m, 4m and 8m
    unit_circle_s: tuple[float, float, float]  # the same in Table 2

    @property
    def setting(self) -> tuple[float, float, float]:
        """ρ, η and λ."""
        return self.rho, self.eta, self.lambda_


PAPER_ROWS: Final = (
    PaperRow(50, 0.95, 0.175, 0.428, (0.02, 0.053, 0.089), (0.00062, 0.00116, 0.00202)),
    PaperRow(100, 0.95, 0.175, 0.428, (0.051, 0.099, 0.23), (0.00117, 0.00216, 0.00347)),
    PaperRow(200, 0.95, 0.175, 0.428, (0.13, 0.257, 0.518), (0.0024, 0.00346, 0.00618)),
    PaperRow(400, 0.95, 0.175, 0.428, (0.347, 0.704, 1.401), (0.00367, 0.00611, 0.01209)),
    PaperRow(800, 0.95, 0.175, 0.428, (0.759, 1.596, 3.802), (0.00639, 0.0121, 0.02381)),
    PaperRow(50, 0.6, 0.25, 0.61, (0.504, 1.065, 2.852), (0.00058, 0.00121, 0.00219)),
    PaperRow(100, 0.6, 0.25, 0.61, (1.208, 2.102, 4.479), (0.00122, 0.00218, 0.00356)),
    PaperRow(200, 0.6, 0.25, 0.61, (2.854, 6.612, 11.853), (0.00194, 0.00346, 0.00626)),
    PaperRow(400, 0.6, 0.25, 0.61, (8.257, 17.007, 34.475), (0.00356, 0.00636, 0.01211)),
    PaperRow(50, 0.9, 0.4, 0.84, (0.138, 0.322, 0.613), (0.0006, 0.00115, 0.00214)),
    PaperRow(100, 0.9, 0.4, 0.84, (0.282, 0.607, 1.614), (0.0012, 0.00216, 0.00332)),
    PaperRow(200, 0.9, 0.4, 0.84, (0.797, 1.495, 3.61), (0.00218, 0.00349, 0.00648)),
    PaperRow(400, 0.9, 0.4, 0.84, (3.001, 5.862, 11.491), (0.00326, 0.00652, 0.01207)),
)
"""The 13 rows, in the order of the tables."""
