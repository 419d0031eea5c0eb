"""What a server is told when it starts: its limits, its gallery, who may ask."""

from __future__ import annotations

from dataclasses import dataclass, field

from fpmatch.engine.local import available_cores
from fpmatch.gallery.names import FVC_PATTERN


@dataclass(frozen=True, slots=True)
class Limits:
    """Bound what one request may cost.

    Parameters
    ----------
    file_megabytes : float
        Largest upload.
    megapixels : float
        Largest picture, before a pixel is decoded.
    megapixels_at_500_dpi : float
        The same once it is at 500 dpi: four flat fingers side by side have two and a half.
    seconds : float
        That a worker may take for one request, waiting not counted.
    upload_seconds : float
        That a request may take to arrive.
    waiting : int
        Requests that may wait for a worker; what comes on top is refused.
    megabytes_at_once : float
        Of all requests that wait or are worked on, together; one alone is always let in.
    candidates : int
        Largest number of candidates that one identification may ask for.
    """

    file_megabytes: float = 32.0
    megapixels: float = 32.0
    megapixels_at_500_dpi: float = 4.0
    seconds: float = 30.0
    upload_seconds: float = 60.0
    waiting: int = 32
    megabytes_at_once: float = 512.0
    candidates: int = 100


@dataclass(frozen=True, slots=True)
class Settings:
    """Hold what a server is told.

    Parameters
    ----------
    hosts : tuple of str
        Names by which it may be asked for, in lower case and without a port. Addresses of digits
        are names that no stranger's page can take over, and always allowed where `token` is set.
    token : str or None
        Word that every request must bring; None where only this machine can ask.
    gallery : str or None
        File or URL of the gallery that may be searched and enrolled in.
    pattern : str
        How names of enrolled files tell subject, finger and impression.
    workers : int
        Processes that do the work.
    limits : Limits
        What one request may cost.
    """

    hosts: tuple[str, ...] = ("localhost", "127.0.0.1", "[::1]")
    token: str | None = field(default=None, repr=False)
    gallery: str | None = None
    pattern: str = FVC_PATTERN
    workers: int = field(default_factory=available_cores)
    limits: Limits = Limits()
