"""Settings of a server: limits, gallery, hosts; clients, their tokens and what each may request."""

from __future__ import annotations

import hashlib
import os
from dataclasses import asdict, dataclass, field
from enum import IntEnum
from pathlib import Path
from stat import S_IRWXO
from typing import TYPE_CHECKING, Any, Final

from fpmatch.base.output import reason
from fpmatch.base.parsing import ParseError, parse_toml
from fpmatch.base.threads import available_cores
from fpmatch.errors import FpmatchError, unknown_name
from fpmatch.gallery.listing.entry import FVC_PATTERN

if TYPE_CHECKING:
    from collections.abc import Mapping

STATIC: Final = Path(__file__).with_name("static")  # the web interface
MIN_TOKEN: Final = 16  # letters
_HEX_DIGITS: Final = 64
_LIMITS: Final = "limits"  # the table that is no client
_LARGEST: Final = 1_000_000  # of a limit


class SettingsError(FpmatchError):
    """A token, or a file of settings, cannot be used."""


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
    """Return a token; SettingsError if it is too short, or not printable ASCII without spaces."""
    if len(token) < MIN_TOKEN:
        raise SettingsError(f"a token must have at least {MIN_TOKEN} letters", code="token")
    if not (token.isascii() and token.isprintable() and " " not in token):
        raise SettingsError("a token consists of ASCII letters without spaces", code="token")
    return token


@dataclass(frozen=True, slots=True)
class Limits:
    """Bound what one request, one client and all together may cost."""

    file_megabytes: float = 32.0  # of an upload
    megapixels: float = 32.0  # of an image, before it is decoded
    megapixels_at_500_dpi: float = 4.0  # four flat fingers side by side have 2.5
    seconds: float = 30.0  # of work on one request, without waiting
    wait_seconds: float = 30.0  # that a request waits for a worker; then it is refused
    requests: int = 64  # that have arrived and are not answered; others are refused
    megabytes_at_once: float = 512.0  # of these; a single one is always accepted
    candidates: int = 100  # of one identification
    slow_seconds: float = 10.0  # until a header has arrived, and the first of a body or an answer
    kilobytes_per_second: float = 50.0  # at least of a body or an answer, after these seconds


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
    pattern: str = FVC_PATTERN  # of names of enrolled files
    workers: int = field(default_factory=available_cores)
    limits: Limits = Limits()

    @property
    def processes(self) -> int:
        """Worker processes: where there is a gallery, one that no request of it can hold."""
        return self.workers + (self.gallery is not None)


def load_settings(path: str | os.PathLike[str]) -> Settings:
    """Read the clients and the limits of a server from a TOML file.

    The table ``limits`` has values of `Limits` by their names. Each other table is a client, named
    by its title, with a ``role`` ("read", "verify", "enrol" or "admin") and either its ``token`` or
    the ``sha256`` of its token in hexadecimal digits. Raises SettingsError, which names the table,
    also where users outside the file's group may read a token.
    """
    try:
        with Path(path).open("rb") as stream:
            exposed = os.name == "posix" and bool(os.fstat(stream.fileno()).st_mode & S_IRWXO)
            document = parse_toml(stream.read())
    except OSError as error:
        raise SettingsError(f"cannot be read: {reason(error)}", path=path) from error
    except ParseError as error:
        raise SettingsError(f"is not TOML: {error}", path=path) from error
    if not document:
        raise SettingsError("contains neither clients nor limits", path=path)
    if exposed and any("token" in table for table in document.values() if isinstance(table, dict)):
        why = f"other users may read the tokens; first: chmod o-rwx {path}"
        raise SettingsError(why, path=path, code="not private")
    limits, clients = Limits(), dict[bytes, Client]()
    for name, table in document.items():
        try:
            if name == _LIMITS:
                limits = _parse_limits(table)
                continue
            digest, role = _parse(table)
        except SettingsError as error:
            what = name if name == _LIMITS else f"client {name}"
            raise SettingsError(f"{what}: {error}", path=path, code=error.code) from error
        if digest in clients:
            other = clients[digest].name
            raise SettingsError(f"clients {other} and {name} have the same token", path=path)
        clients[digest] = Client(name, role)
    return Settings(clients=clients, limits=limits)


def _parse_limits(table: Any) -> Limits:
    """Return the limits of a table; those that it does not name are the usual ones."""
    if not isinstance(table, dict):
        raise SettingsError("must be a table", code="table")
    usual = asdict(Limits())
    for name, value in table.items():
        if name not in usual:
            raise SettingsError(unknown_name("limit", name, usual), code="key")
        whole = isinstance(usual[name], int)
        least = 0 if name == "wait_seconds" else 1 if whole else 0.001
        number = type(value) is int or (type(value) is float and not whole)
        if not (number and least <= value <= _LARGEST):
            kind = "whole number" if whole else "number"
            raise SettingsError(f"{name} must be a {kind} from {least} to {_LARGEST}", code="value")
    return Limits(**{name: type(usual[name])(value) for name, value in table.items()})


def _parse(table: Any) -> tuple[bytes, Role]:
    """Return the digest of the token of one client, and its role."""
    if not isinstance(table, dict):
        raise SettingsError("must be a table with role and token", code="table")
    unknown = table.keys() - {"role", "token", "sha256"}
    if unknown:
        raise SettingsError(f"unknown key {min(unknown)}", code="key")
    roles = {role.name.lower(): role for role in Role}
    role = table.get("role")
    if not isinstance(role, str) or role not in roles:
        raise SettingsError(f"its role must be one of {', '.join(roles)}", code="role")
    return _digest(table), roles[role]


def _digest(table: Mapping[str, Any]) -> bytes:
    token, digest = table.get("token"), table.get("sha256")
    if (token is None) == (digest is None):
        raise SettingsError("needs either token or sha256", code="token")
    if isinstance(token, str):
        return digest_of(check_token(token))
    try:
        if isinstance(digest, str) and len(digest) == _HEX_DIGITS:
            return bytes.fromhex(digest)
    except ValueError:
        pass
    raise SettingsError(f"its sha256 must have {_HEX_DIGITS} hexadecimal digits", code="token")
