"""Headers of finger minutiae records: big-endian numbers, sizes, resolutions, products."""

from __future__ import annotations

import base64
import binascii
import math
import re
import struct
from typing import TYPE_CHECKING, Final, NamedTuple

from fpmatch.errors import TemplateError
from fpmatch.formats.codec import check_fits

if TYPE_CHECKING:
    from fpmatch.base.binary_records import ByteReader
    from fpmatch.formats.record import TemplateRecord
    from fpmatch.templates.minutiae import Template

MAGIC: Final = b"FMR\x00"
_IN_BASE64: Final = b"Rk1SA"  # the beginning, as the next byte is a space or a digit
_URL_SAFE: Final = bytes.maketrans(b"-_", b"+/")
_IN_HEX: Final = re.compile(rb"(?:0x|\\x)?(?P<magic>464d5200)", re.IGNORECASE)
CM_PER_INCH: Final = 2.54
ROUND_DPI: Final = 100  # nominal resolutions of scanners are multiples of this
MISMATCH: Final = 0.01  # of horizontal and vertical resolution, attributed to rounding


def per_cm(dpi: float) -> int:
    """Return a resolution in whole pixels per centimetre: 500 dpi are 197."""
    return round(dpi / CM_PER_INCH)


def dpi_of(per_cm_x: int, per_cm_y: int) -> float:
    """Return the dpi of a resolution in whole pixels per centimetre, both positive.

    Rounding leaves a range of 2.54 dpi: the result is the multiple of 100 in it, else the nearest
    whole number.
    """
    if abs(per_cm_x - per_cm_y) > max(1.0, MISMATCH * per_cm_x):
        raise TemplateError(
            f"horizontal and vertical resolution differ ({per_cm_x} and {per_cm_y} pixels a cm)"
        )
    low, high = (per_cm_x - 0.5) * CM_PER_INCH, (per_cm_x + 0.5) * CM_PER_INCH
    multiple = math.ceil(low / ROUND_DPI) * ROUND_DPI
    return float(multiple if multiple < high else round(per_cm_x * CM_PER_INCH))


def of_text(data: bytes) -> bytes | None:
    """Return the record whose base64 or hexadecimal digits a text is; None for other data.

    Of a text that is cut short, the record is cut short as well.
    """
    digits = re.sub(rb"\s+", b"", data.strip(b"\xef\xbb\xbf \t\r\n\"'")).rstrip(b"=")
    try:
        if digits.startswith(_IN_BASE64):
            digits = digits[: len(digits) - (len(digits) % 4 == 1)]
            digits = digits.translate(_URL_SAFE) + b"=" * (-len(digits) % 4)
            return base64.b64decode(digits, validate=True)
        if hexadecimal := _IN_HEX.match(digits):
            digits = digits[hexadecimal.start("magic") :]
            return binascii.unhexlify(digits[: len(digits) // 2 * 2])
    except binascii.Error as error:
        raise TemplateError(f"damaged text of a finger minutiae record ({error})") from error
    return None


class Frame(NamedTuple):
    """Image size in pixels and resolution in pixels per centimetre; 0 is unknown."""

    width: int
    height: int
    per_cm_x: int
    per_cm_y: int

    @classmethod
    def of(cls, template: Template, bits: int = 16) -> Frame:
        """Return the frame of a template; raises TemplateError if `bits` bits cannot hold it."""
        step = check_fits(per_cm(template.dpi), 16, "a resolution")
        for length in (template.width, template.height):
            check_fits(length - 1, 14, "a position")  # in all formats of the family
        width = check_fits(template.width, bits, "a width")
        return cls(width, check_fits(template.height, bits, "a height"), step, step)

    @classmethod
    def shared(cls, record: TemplateRecord) -> Frame:
        """Return the frame that all views share; raises TemplateError if they differ."""
        frames = {cls.of(view.template) for view in record.views}
        if len(frames) != 1:
            raise TemplateError(
                "the format has one size and resolution for all prints of a file, and these differ"
            )
        return frames.pop()

    def to_bytes(self) -> bytes:
        """Return width, height, horizontal and vertical resolution in two bytes each."""
        return struct.pack(">4H", *self)


def product_fields(reader: ByteReader, certification: int = 0) -> tuple[tuple[str, str], ...]:
    """Read product and capture device, with `certification` bytes between; zeros are unknown."""
    owner, kind, device = reader.numbers(f"HH{certification}xH")
    product = (("product", f"0x{owner:04x} 0x{kind:04x}"),) if owner or kind else ()
    return product + device_fields(device)


def device_fields(device: int) -> tuple[tuple[str, str], ...]:
    """Return the field of a capture device; 0 is unknown."""
    return (("capture device", f"0x{device:04x}"),) if device else ()
