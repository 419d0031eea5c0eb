"""What a user has, of every kind and through every door, is one print, or one line of refusal."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fpmatch import as_template, extract, read_image, verify
from fpmatch.errors import FpmatchError
from fpmatch.formats.files import load_template, save_template
from fpmatch.prints.reading import content_of

SAMPLES = Path(__file__).parents[2] / "sample_data"
ORIENTATION = 274
# How the pixels of an upright print are stored with each value of the tag.
STORED = {
    1: lambda p: p,
    2: np.fliplr,
    3: lambda p: np.rot90(p, 2),
    4: np.flipud,
    5: np.transpose,
    6: np.rot90,
    7: lambda p: np.rot90(p, 2).T,
    8: lambda p: np.rot90(p, -1),
}
PIXELS = read_image(SAMPLES / "101_1.tif").pixels


def saved(pixels, form, orientation=1, **options):
    """Return the bytes of a file with these pixels, where need be with a tag of orientation."""
    image = Image.fromarray(np.ascontiguousarray(STORED[orientation](pixels)))
    if orientation > 1:
        exif = Image.Exif()
        exif[ORIENTATION] = orientation
        options["exif"] = exif
    stream = io.BytesIO()
    image.save(stream, form, **options)
    return stream.getvalue()


def template_bytes(folder, suffix):
    path = folder / f"made{suffix}"
    save_template(path, extract(PIXELS, 500))
    return path.read_bytes()


RGBA = np.dstack([PIXELS] * 3 + [np.full_like(PIXELS, 255)])
KINDS = {
    "8 bits": lambda _: saved(PIXELS, "PNG"),
    "PNG with dpi": lambda _: saved(PIXELS, "PNG", dpi=(510, 510)),
    "TIFF with dpi": lambda _: saved(PIXELS, "TIFF", dpi=(510, 510)),
    "JPEG with dpi": lambda _: saved(PIXELS, "JPEG", dpi=(510, 510)),
    "turned PNG": lambda _: saved(PIXELS, "PNG", 6, dpi=(510, 510)),
    "mirrored JPEG": lambda _: saved(PIXELS, "JPEG", 2),
    "turned TIFF": lambda _: saved(PIXELS, "TIFF", 8),
    "white ridges": lambda _: saved(255 - PIXELS, "PNG"),
    "16 bits": lambda _: saved(PIXELS.astype(np.uint16) * 257, "PNG"),
    "alpha": lambda _: saved(RGBA, "PNG"),
    "JSON template": lambda folder: template_bytes(folder, ".json"),
    "ISO template": lambda folder: template_bytes(folder, ".iso"),
    "garbage": lambda _: bytes(range(128, 256)) * 9,
    "cut short": lambda _: saved(PIXELS, "PNG")[:9000],
    "empty": lambda _: b"",
}
WITHOUT_TAGS = {"8 bits", "white ridges", "16 bits", "alpha"}
TEMPLATES = {"JSON template", "ISO template"}


def reason_of(door):
    """Return a template and "", or None and the reason of the refusal without names."""
    try:
        return door(), ""
    except FpmatchError as error:
        return None, without_hint(str(error).split(": ", 1)[1])


def without_hint(reason):
    """Return a reason without the option of the commands that may help."""
    return reason.strip().partition("; if its")[0]


def by_command(run, folder, source, **options):
    result = run("extract", source, "-o", folder, **options)
    if result.exit_code:
        assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
        assert not list(folder.glob("*.json"))
        return None, without_hint(result.stderr.split(": ", 3)[3])
    (written,) = folder.glob("*.json")
    return load_template(written), ""


@pytest.mark.parametrize("kind", KINDS)
def test_every_door_gives_one_answer(kind, run, tmp_path):
    data = KINDS[kind](tmp_path)
    path = tmp_path / "given"
    path.write_bytes(data)
    template, reason = expected = reason_of(lambda: as_template(path))
    usual = "template" if kind in TEMPLATES else "image"
    assert content_of(path) == ("" if kind in {"garbage", "empty"} else usual)
    assert bool(reason) == (kind in {"garbage", "cut short", "empty"})
    assert reason_of(lambda: as_template(data)) == expected
    assert reason_of(lambda: as_template(str(path))) == expected
    if kind == "cut short":
        with pytest.raises(FpmatchError, match=r"^damaged PNG image"):
            as_template(Image.open(io.BytesIO(data)))
    assert by_command(run, tmp_path / "a", path) == expected
    assert by_command(run, tmp_path / "b", "-", input=data) == expected
    if reason:
        assert reason_of(lambda: extract(data)) == expected
        assert without_hint(run("verify", path, path).stderr).endswith(reason)
        return
    if kind not in TEMPLATES:
        opened = Image.open(io.BytesIO(data))  # by a path Pillow scrambles a turned TIFF
        read = [read_image(given) for given in (path, data, opened)]
        if kind in WITHOUT_TAGS:
            read.append(read_image(np.asarray(Image.open(path))))
        for image in read:
            assert np.array_equal(image.pixels, read[0].pixels)
            assert (image.dpi, image.notes) == (read[0].dpi, read[0].notes)
            assert extract(image) == as_template(image) == template
        assert np.abs(read[0].pixels.astype(int) - PIXELS).mean() < 4  # JPEG
        assert read[0].dpi == (510 if "with dpi" in kind or kind == "turned PNG" else None)
        assert extract(opened) == extract(data) == template
    compared = json.loads(run("verify", path, path, "--json").stdout)
    assert compared["score"] == pytest.approx(verify(data, data).score)
    assert compared["resolution"]["probe"]["dpi"] == template.dpi


@pytest.mark.parametrize("form", ["PNG", "TIFF", "JPEG", "WEBP"])
@pytest.mark.parametrize("orientation", STORED)
def test_an_image_is_upright_as_its_tag_says(form, orientation):
    lossless = {"lossless": True} if form == "WEBP" else {}
    data = saved(PIXELS, form, orientation, **lossless)
    for given in (data, Image.open(io.BytesIO(data))):
        read = read_image(given).pixels
        assert read.shape == PIXELS.shape
        assert np.abs(read.astype(int) - PIXELS).mean() < (4 if form == "JPEG" else 0.01)


@pytest.mark.parametrize("form", ["PNG", "TIFF", "JPEG"])
def test_two_resolutions_are_turned_with_the_image(form):
    squeezed = np.asarray(Image.fromarray(PIXELS).resize((PIXELS.shape[1] // 2, PIXELS.shape[0])))
    data = saved(squeezed, form, 6, dpi=(500, 250))  # stored rows are columns
    assert read_image(data).pixels.shape == pytest.approx(PIXELS.shape, abs=1)
    assert read_image(data).dpi == 500


MODES = [*("1", "L", "LA", "P", "PA", "RGB", "RGBA", "RGBa", "RGBX", "CMYK", "YCbCr", "LAB")]
MODES += ["HSV", "I", "F", "I;16", "I;16L", "I;16B", "I;16N"]


@pytest.mark.parametrize("mode", MODES)
def test_a_constant_image_of_every_mode_of_pil_has_no_minutiae(mode):
    assert not len(extract(Image.new(mode, (200, 180))).minutiae)
