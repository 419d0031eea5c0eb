"""Constructed images: waves, rings, dislocations, drawings, and what no sensor delivers."""

import cv2
import numpy as np
from hypothesis import example
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays


def along_and_across(shape, angle_deg, at=None):
    """Return each pixel's place along a direction (counter-clockwise on screen) and across it.

    `at` (x, y) is the origin; by default the centre of the image.
    """
    height, width = shape
    x0, y0 = at or ((width - 1) / 2, (height - 1) / 2)
    y, x = np.mgrid[:height, :width].astype(float)
    dx, up = x - x0, y0 - y
    angle = np.radians(angle_deg)
    along = dx * np.cos(angle) + up * np.sin(angle)
    across = dx * np.sin(angle) - up * np.cos(angle)
    return along, across


def plane_wave(angle_deg, period, shape=(96, 96), phase=0.0):
    """Return ridges (positive) that run straight at `angle_deg`, one every `period` pixels."""
    _, across = along_and_across(shape, angle_deg)
    return np.cos(2 * np.pi * across / period + phase).astype(np.float32)


def concentric_rings(shape, period):
    """Return circular ridges around the centre of the image."""
    along, across = along_and_across(shape, 0)
    return np.cos(2 * np.pi * np.hypot(along, across) / period).astype(np.float32)


def dislocation(angle_deg, period, kind, shape=(160, 160), at=None):
    """Return straight ridges with one minutia at `at`, whose direction is `angle_deg`.

    A turn in the phase of the wave makes one ridge more on the side of the direction: an ending
    where that side has a ridge in the middle, a bifurcation where it has a valley. After Larkin
    and Fletcher, "A coherent framework for fingerprint analysis", Optics Express 15 (2007).
    """
    along, across = along_and_across(shape, angle_deg, at)
    middle = {"ending": np.pi / 2, "bifurcation": -np.pi / 2}[kind]
    phase = 2 * np.pi * across / period - np.arctan2(along, across) + middle
    return np.cos(phase).astype(np.float32)


def as_picture(wave):
    """Return a wave as a sensor shows it: dark ridges."""
    return np.rint(128 - 100 * wave).astype(np.uint8)


def correlation(a, b):
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])


def parts(binary):
    """Count the eight-connected parts."""
    return int(cv2.connectedComponents(binary.astype(np.uint8), connectivity=8)[0]) - 1


def holes(binary):
    """Count the four-connected parts of the ground that do not reach the border."""
    ground = (~np.pad(binary, 1)).astype(np.uint8)
    return int(cv2.connectedComponents(ground, connectivity=4)[0]) - 2


def turn_between(a, b, *, period_deg=360.0):
    """Return the smallest turn in degrees from `a` to `b`, both in degrees."""
    difference = np.asarray(a, np.float64) - np.asarray(b, np.float64)
    half = period_deg / 2
    return np.abs((difference + half) % period_deg - half)


binaries = st.tuples(st.integers(1, 14), st.integers(1, 14)).flatmap(
    lambda shape: arrays(np.bool_, shape)
)
fat = st.builds(
    lambda binary, size: cv2.dilate(
        binary.astype(np.uint8), np.ones((size, size), np.uint8)
    ).astype(bool),
    binaries,
    st.integers(2, 4),
)
shapes = st.one_of(binaries, fat)
"""Any binary image of 1 to 14 pixels a side, or one of fat shapes."""


EXTREMES = [
    np.zeros((12, 15), bool),
    np.ones((12, 15), bool),
    np.pad([[True]], 5),
    *(np.ones(shape, bool) for shape in ((1, 1), (1, 20), (20, 1))),
    np.indices((9, 9)).sum(axis=0) % 2 == 0,
]


def extremes_too(test):
    """Add the images that every stage must bear to the examples of a test of binary images."""
    for image in EXTREMES:
        test = example(image)(test)
    return test


def hostile_pictures(shape=(64, 80)):
    """Return pictures in which there is no print."""
    rng = np.random.default_rng(7)
    y, x = np.indices(shape)
    return {
        "black": np.zeros(shape, np.uint8),
        "white": np.full(shape, 255, np.uint8),
        "grey": np.full(shape, 130, np.uint8),
        "noise": rng.integers(0, 256, shape, dtype=np.uint8),
        "black and white noise": rng.integers(0, 2, shape, dtype=np.uint8) * np.uint8(255),
        "checkerboard": ((y + x) % 2 * 255).astype(np.uint8),
        "ramp": (x * 255 // (shape[1] - 1)).astype(np.uint8),
        "edge": np.where(x < shape[1] // 2, 0, 255).astype(np.uint8),
        "one dot": np.where((y == 20) & (x == 20), 0, 255).astype(np.uint8),
    }


def lines(shape, *strokes):
    """Return straight lines one pixel wide, each from (x, y) to (x, y)."""
    canvas = np.zeros(shape, np.uint8)
    for start, end in strokes:
        cv2.line(canvas, start, end, 1)
    return canvas.astype(bool)
