"""Settings of a server: limits, gallery, hosts, token."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from fpmatch.base.threads import available_cores
from fpmatch.gallery.listing.entry import FVC_PATTERN

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fpmatch.server.access import Client


@dataclass(frozen=True, slots=True)
class Limits:
    """Bound what one request, one client and all together may cost."""

    file_megabytes: float = 32.0  # of an upload
    megapixels: float = 32.0  # of an image, before it is decoded
    megapixels_at_500_dpi: float = 4.0  # four flat fingers side by side have 2.5
    seconds: float = 30.0  # of work on one request, without waiting
    waiting: int = 2  # requests that have arrived and wait for a worker; others wait before them
    wait_seconds: float = 30.0  # that a request waits for its turn; then it is refused
    queue: int = 512  # requests that wait for their turn; others are refused
    megabytes_at_once: float = 512.0  # of all large requests; a single one is always accepted
    candidates: int = 100  # of one identification
    header_seconds: float = 10.0  # until the header of a request has arrived
    upload_seconds: float = 60.0  # until its body has
    stalled_seconds: float = 10.0  # without a byte of a body, or of an answer being read
    kilobytes_per_second: float = 4.0  # at least of a body or an answer, after these seconds
    unread_megabytes: float = 8.0  # of all answers that clients have not read
    connections: int = 512  # of all clients, and fewer where open files are short
    connections_per_client: int = 64  # of one address


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings of a server.

    `hosts` are its names in requests, in lower case and without a port. `clients` are known by the
    SHA-256 of their tokens, of which every request must contain one, if there are any. With it, IP
    addresses are accepted as hosts, too: no other site can take them over by DNS rebinding.
    """

    hosts: tuple[str, ...] = ("localhost", "127.0.0.1", "[::1]")
    clients: Mapping[bytes, Client] = field(default_factory=dict, repr=False)
    gallery: str | None = None  # file or URL
    audit_log: str | None = None  # file
    pattern: str = FVC_PATTERN  # of names of enrolled files
    workers: int = field(default_factory=available_cores)
    limits: Limits = Limits()
