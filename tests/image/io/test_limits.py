"""No file makes a reader use more than 1 GB or 5 s; the limit of pixels is that of four palms."""

import json
import subprocess
import sys

import numpy as np
import pytest

from fpmatch import extract, read_image
from fpmatch.errors import ImageError
from fpmatch.image.io.grey import GreyImage, ImageLimits, RawSize, grey_image
from fpmatch.image.io.read import decode_image
from tests.image.hostile_files import IMAGES, SIDE, white
from tests.image.made_files import rings, saved

MOST_MEGABYTES = 1000
MOST_SECONDS = 5
READ = """
import json, resource, sys
from pathlib import Path
from fpmatch import read_image
from fpmatch.errors import FpmatchError
try:
    read_image(sys.argv[1])
except FpmatchError as error:
    used = resource.getrusage(resource.RUSAGE_SELF)
    peak, status = used.ru_maxrss, Path("/proc/self/status")
    if status.exists():  # on Linux ru_maxrss has that of the process before, too
        peak = int(status.read_text().partition("VmHWM:")[2].split()[0])
    print(json.dumps([str(error), peak / 1000, used.ru_utime + used.ru_stime]))
"""


@pytest.mark.slow
@pytest.mark.parametrize("kind", IMAGES)
def test_hostile_files_are_refused_in_one_line_with_little_memory_and_time(tmp_path, kind):
    make, words = IMAGES[kind]
    path = tmp_path / "print"
    path.write_bytes(make())
    run = subprocess.run(
        [sys.executable, "-c", READ, path], capture_output=True, check=True, text=True
    )
    message, megabytes, seconds = json.loads(run.stdout)
    print(f"{kind}: {path.stat().st_size} bytes, {megabytes:.0f} MB, {seconds:.2f} s")  # noqa: T201
    assert message.startswith(f"{path}: ")
    assert words in message
    assert "\n" not in message
    assert len(message) < 500
    assert megabytes < MOST_MEGABYTES
    assert seconds < MOST_SECONDS


@pytest.mark.parametrize(
    ("side", "dpi", "given", "most"),
    [
        (4001, None, None, "16 megapixels, as its file states no resolution"),
        (4001, 500, None, "16 megapixels at 500 dpi"),
        (4001, 200, None, "16 megapixels at 200 dpi"),
        (6001, 750, None, "36 megapixels at 750 dpi"),
        (6001, 1000, 750, "36 megapixels at 750 dpi"),
        (4001, None, 500, "16 megapixels at 500 dpi"),
        (8001, 4000, None, "64 megapixels"),
    ],
)
def test_the_limit_of_pixels_is_that_of_four_palms_at_the_resolution(side, dpi, given, most):
    head = saved(rings(), "BMP", **({} if dpi is None else {"dpi": (dpi, dpi)}))
    changed = bytearray(head)
    changed[18:26] = np.array([side, side], "<u4").tobytes()  # there are no such pixels
    with pytest.raises(ImageError, match=f"more than {most}"):
        decode_image(bytes(changed), "print.bmp", dpi=given)


def test_a_resolution_admits_larger_images(tmp_path):
    path = tmp_path / "print.png"
    path.write_bytes(white("PNG", dpi=(1000, 1000)))
    assert read_image(path).pixels.shape == (SIDE, SIDE)
    path.write_bytes(saved(np.full((4100, 4100), 255, np.uint8), "PNG"))
    with pytest.raises(ImageError, match=r"\(--dpi\)"):
        read_image(path)
    assert read_image(path, dpi=1000).pixels.shape == (4100, 4100)


def test_frames_and_arrays_have_the_limit_too():
    size, pixels = RawSize(4100, 4100), np.full((4100, 4100), 255, np.uint8)
    with pytest.raises(ImageError, match="16 megapixels"):
        decode_image(bytes(size.bytes), "frame", raw_sizes=[size])
    for image in (pixels, grey_image(pixels), GreyImage(pixels, 500.0)):
        with pytest.raises(ImageError, match="16 megapixels at 500 dpi"):
            extract(image)
    with pytest.raises(ImageError, match="more than 1 megapixels"):
        ImageLimits(max_megapixels=1).check(1100, 1100, 1000)
