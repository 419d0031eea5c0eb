"""Settings of a server: limits, gallery, hosts; clients, their tokens and what each may request."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from stat import S_IRWXO
from typing import TYPE_CHECKING, Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fpmatch.base.output import reason
from fpmatch.base.parsing import ParseError, parse_toml
from fpmatch.base.threads import available_cores
from fpmatch.errors import FpmatchError, unknown_name

if TYPE_CHECKING:
    from collections.abc import Mapping

STATIC: Final = Path(__file__).with_name("static")  # the web interface
MIN_TOKEN: Final = 16  # letters
_LIMITS: Final = "limits"  # the table that is no client


class SettingsError(FpmatchError):
    """A token, an address or a file of settings cannot be used."""


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


class _Table(BaseModel):
    """A table of the file of settings: strict about types, unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


_Number = Annotated[float, Field(ge=0.001, le=1e6)]
_Count = Annotated[int, Field(ge=1, le=1_000_000)]


class Limits(_Table):
    """Bound what one request, one client and all together may cost."""

    file_megabytes: _Number = 32.0  # of an upload
    megapixels: _Number = 32.0  # of an image, before it is decoded
    megapixels_at_500_dpi: _Number = 4.0  # four flat fingers side by side have 2.5
    seconds: _Number = 30.0  # of work on one request, without waiting
    # that a request waits for a worker; then it is refused
    wait_seconds: Annotated[float, Field(ge=0, le=1e6)] = 30.0
    requests: _Count = 64  # that have arrived and are not answered; others are refused
    megabytes_at_once: _Number = 512.0  # of these; a single one is always accepted
    candidates: _Count = 100  # of one identification
    slow_seconds: _Number = 10.0  # until a header has arrived, and the first of a body or an answer
    kilobytes_per_second: _Number = 50.0  # at least of a body or an answer, after these seconds


class _ClientTable(_Table):
    role: Literal["read", "verify", "enrol", "admin"]
    token: str | None = None
    sha256: Annotated[str, Field(pattern="^[0-9a-fA-F]{64}$")] | None = None


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
    workers: int = field(default_factory=available_cores)
    limits: Limits = field(default_factory=Limits)

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
        model = Limits if name == _LIMITS else _ClientTable
        what = name if name == _LIMITS else f"client {name}"
        try:
            if not isinstance(table, dict):
                raise SettingsError("must be a table", code="table")
            given = model.model_validate(table)
            if isinstance(given, Limits):
                limits = given
                continue
            if (given.token is None) == (given.sha256 is None):
                raise SettingsError("needs either token or sha256", code="token")
            if given.token is not None:
                digest = digest_of(check_token(given.token))
            else:
                digest = bytes.fromhex(given.sha256 or "")
        except ValidationError as error:
            why = f"{what}: {fault_in(error, model)}"
            raise SettingsError(why, path=path, code="value") from None
        except SettingsError as error:
            raise SettingsError(f"{what}: {error}", path=path, code=error.code) from None
        if digest in clients:
            other = clients[digest].name
            raise SettingsError(f"clients {other} and {name} have the same token", path=path)
        clients[digest] = Client(name, Role[given.role.upper()])
    return Settings(clients=clients, limits=limits)


def fault_in(error: ValidationError, model: type[BaseModel]) -> str:
    """Return the first fault of a document as one sentence; a similar name for an unknown one."""
    first = error.errors()[0]
    if first["type"] == "extra_forbidden":
        return unknown_name("key", str(first["loc"][-1]), model.model_fields)
    where = "".join(f"{part}: " for part in first["loc"])
    return f"{where}{first['msg'][0].lower()}{first['msg'][1:]}"
