"""Settings of a server: limits, gallery, hosts; clients, their tokens and what each may request."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.output import reason
from fpmatch.base.parsing import ParseError, parse_toml
from fpmatch.base.threads import available_cores
from fpmatch.errors import FpmatchError
from fpmatch.gallery.listing.entry import FVC_PATTERN

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

MIN_TOKEN: Final = 16  # letters
_HEX_DIGITS: Final = 64


class TokenError(FpmatchError):
    """A token, or a file of tokens, cannot be used."""


class Role(IntEnum):
    """What a client may request; each role includes those before it."""

    READ = 1  # the state of server and gallery
    VERIFY = 2  # compare, identify, extract
    ENROL = 3  # add prints to the gallery
    ADMIN = 4  # remove prints from the gallery


@dataclass(frozen=True, slots=True)
class Client:
    """The name of a client, as logs have it, and its role."""

    name: str
    role: Role


# Whoever reaches a server without tokens: the users of this computer.
LOCAL: Final = Client("local", Role.ENROL)


def digest_of(token: str) -> bytes:
    """Return the SHA-256 of a token."""
    return hashlib.sha256(token.encode()).digest()


def check_token(token: str) -> str:
    """Return a token; TokenError if it is too short, or not printable ASCII without spaces."""
    if len(token) < MIN_TOKEN:
        raise TokenError(f"a token must have at least {MIN_TOKEN} letters", code="token")
    if not (token.isascii() and token.isprintable() and " " not in token):
        raise TokenError("a token consists of ASCII letters without spaces", code="token")
    return token


def load_clients(path: str | os.PathLike[str]) -> dict[bytes, Client]:
    """Read the clients of a server from a TOML file.

    Each table is a client, named by its title, with a ``role`` ("read", "verify", "enrol" or
    "admin") and either its ``token`` or the ``sha256`` of its token in hexadecimal digits. Returned
    are the clients by the SHA-256 of their tokens. Raises TokenError, which names the client.
    """
    try:
        document = parse_toml(Path(path).read_bytes())
    except OSError as error:
        raise TokenError(f"cannot be read: {reason(error)}", path=path) from error
    except ParseError as error:
        raise TokenError(f"is not TOML: {error}", path=path) from error
    clients: dict[bytes, Client] = {}
    for name, table in document.items():
        try:
            digest, role = _parse(table)
        except TokenError as error:
            raise TokenError(f"client {name}: {error}", path=path, code=error.code) from error
        if digest in clients:
            other = clients[digest].name
            raise TokenError(f"clients {other} and {name} have the same token", path=path)
        clients[digest] = Client(name, role)
    if not clients:
        raise TokenError("contains no client", path=path)
    return clients


def _parse(table: Any) -> tuple[bytes, Role]:
    """Return the digest of the token of one client, and its role."""
    if not isinstance(table, dict):
        raise TokenError("must be a table with role and token", code="table")
    unknown = table.keys() - {"role", "token", "sha256"}
    if unknown:
        raise TokenError(f"unknown key {min(unknown)}", code="key")
    roles = {role.name.lower(): role for role in Role}
    role = table.get("role")
    if not isinstance(role, str) or role not in roles:
        raise TokenError(f"its role must be one of {', '.join(roles)}", code="role")
    return _digest(table), roles[role]


def _digest(table: Mapping[str, Any]) -> bytes:
    token, digest = table.get("token"), table.get("sha256")
    if (token is None) == (digest is None):
        raise TokenError("needs either token or sha256", code="token")
    if isinstance(token, str):
        return digest_of(check_token(token))
    try:
        if isinstance(digest, str) and len(digest) == _HEX_DIGITS:
            return bytes.fromhex(digest)
    except ValueError:
        pass
    raise TokenError(f"its sha256 must have {_HEX_DIGITS} hexadecimal digits", code="token")


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

    @property
    def processes(self) -> int:
        """Worker processes: where there is a gallery, one that no request of it can hold."""
        return self.workers + (self.gallery is not None)
