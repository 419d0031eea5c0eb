"""`fpmatch key`: make, list and remove the keys of encrypted galleries and templates."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import click

from fpmatch.cli.command import Group
from fpmatch.cli.notes import say_note, show
from fpmatch.cli.options import json_option
from fpmatch.printable import json_text, printable

if TYPE_CHECKING:
    from fpmatch.base.encryption.keys import KeyRing

_SOURCE: Final = click.argument("source", metavar="FILE|SOURCE", required=False)


def _full_source(text: str | None) -> str:
    """Return the source that an argument means: without file:, env: or keyring: a file."""
    from fpmatch.base.encryption.keys import KEY_VARIABLE, KINDS, given_source

    if text is None and not given_source():
        raise click.UsageError(f"give a FILE or SOURCE, or set {KEY_VARIABLE}")
    chosen = given_source() if text is None else text
    return chosen if chosen.partition(":")[0] in KINDS else f"file:{chosen}"


@click.group(
    cls=Group,
    epilog="""\b
Sources:
  file:PATH     a text file that no other user may read: mode 0600
  keyring:NAME  the system keyring
  env:NAME      an environment variable with the text; it is not changed

A source has one key a line: its id and 32 bytes in base64. The first is the current key, with which
new galleries and templates are encrypted. The option --key of other commands, or the environment
variable FPMATCH_KEY, names a source.

\b
Examples:
  fpmatch key new keys.txt
  fpmatch key new keyring:prints
  fpmatch key new keys.txt --add
  fpmatch key list keys.txt
""",
)
def key() -> None:
    """Make, list and remove the keys of encrypted galleries and templates.

    Without its keys, encrypted data are lost: keep a copy of them elsewhere.
    """


@key.command(
    epilog="""\b
Examples:
  fpmatch key new keys.txt
  fpmatch key new keyring:prints
  fpmatch key new keys.txt --add
"""
)
@_SOURCE
@click.option(
    "--add", is_flag=True, help="Put the new key before those that are there, as the current one."
)
@json_option
def new(source: str | None, add: bool, as_json: bool) -> None:
    """Make a random key, and write it to a new FILE or to the system keyring."""
    from fpmatch.base.encryption.key_text import add_key, make_keys

    keys = (add_key if add else make_keys)(_full_source(source))
    show(
        json_text(_as_dict(keys)) if as_json else f"{printable(keys.source)}: new key {keys.ids[0]}"
    )
    say_note("without this key the data are lost: keep a copy of it elsewhere")


@key.command(
    "list",
    epilog="""\b
Examples:
  fpmatch key list keys.txt
  fpmatch key list keyring:prints --json
""",
)
@_SOURCE
@json_option
def list_(source: str | None, as_json: bool) -> None:
    """List the ids of the keys in FILE or SOURCE, the current one first; not the keys."""
    from fpmatch.base.encryption.keys import load_keys

    keys = load_keys(_full_source(source))
    lines = [f"{key_id}{'  current' * (key_id == keys.ids[0])}" for key_id in keys.ids]
    show(json_text(_as_dict(keys)) if as_json else "\n".join(lines))


@key.command(
    epilog="""\b
Examples:
  fpmatch key remove keys.txt 4290bd01905d96eb
"""
)
@click.argument("source", metavar="FILE|SOURCE")
@click.argument("key_id", metavar="ID")
@json_option
def remove(source: str, key_id: str, as_json: bool) -> None:
    """Remove the key ID, which is not the current one, from FILE or SOURCE.

    First let `fpmatch gallery rewrite --encrypt` seal with the current key what is sealed with it.
    """
    from fpmatch.base.encryption.key_text import remove_key

    keys = remove_key(_full_source(source), key_id)
    show(
        json_text(_as_dict(keys))
        if as_json
        else f"{printable(keys.source)}: removed {printable(key_id)}; left: {', '.join(keys.ids)}"
    )


def _as_dict(keys: KeyRing) -> dict[str, object]:
    return {"source": keys.source, "current": keys.ids[0], "keys": list(keys.ids)}
