"""Settings of a server: limits, gallery, hosts, token."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from fpmatch.engine.local import available_cores
from fpmatch.gallery.names import FVC_PATTERN

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fpmatch.web.access import Client


@dataclass(frozen=True, slots=True)
class Limits:
    """Bound what one request may cost.

    Parameters
    ----------
    file_megabytes : float
        Largest upload.
    megapixels : float
        Largest image, before it is decoded.
    megapixels_at_500_dpi : float
        Largest image at 500 dpi: four flat fingers side by side have 2.5.
    seconds : float
        Longest work on one request, without waiting.
    upload_seconds : float
        Longest transfer of a request.
    waiting : int
        Most requests in the server that wait for a worker; others wait before they are read.
    wait_seconds : float
        Longest time that a request waits before it is read; then it is refused.
    queue : int
        Most requests that wait before they are read; others are refused.
    megabytes_at_once : float
        Most data of all requests in the server; a single one is always accepted.
    candidates : int
        Most candidates of one identification.
    """

    file_megabytes: float = 32.0
    megapixels: float = 32.0
    megapixels_at_500_dpi: float = 4.0
    seconds: float = 30.0
    upload_seconds: float = 60.0
    waiting: int = 32
    wait_seconds: float = 30.0
    queue: int = 512
    megabytes_at_once: float = 512.0
    candidates: int = 100


@dataclass(frozen=True, slots=True)
class Settings:
    """Hold the settings of a server.

    Parameters
    ----------
    hosts : tuple of str
        Its names in requests, in lower case and without a port. With tokens, IP addresses are
        accepted too: no other site can take them over by DNS rebinding.
    clients : mapping of bytes to Client
        Clients by the SHA-256 of their tokens, of which every request must contain one; none
        where only this machine can reach the server.
    gallery : str or None
        File or URL of the gallery to search and to enrol in.
    pattern : str
        Pattern of names of enrolled files with subject, finger and impression.
    audit_log : str or None
        File of the audit log.
    workers : int
        Number of worker processes.
    limits : Limits
        Limits of one request.
    """

    hosts: tuple[str, ...] = ("localhost", "127.0.0.1", "[::1]")
    clients: Mapping[bytes, Client] = field(default_factory=dict, repr=False)
    gallery: str | None = None
    audit_log: str | None = None
    pattern: str = FVC_PATTERN
    workers: int = field(default_factory=available_cores)
    limits: Limits = Limits()
