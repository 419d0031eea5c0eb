"""`fpmatch key`: list and make the keys of encrypted galleries."""

from __future__ import annotations

import click

from fpmatch.cli.command import Command
from fpmatch.cli.notes import say_note, show
from fpmatch.cli.options import json_option
from fpmatch.printable import json_text, printable


def _full_source(text: str | None) -> str:
    """Return the source that an argument means: a file, with ``file:`` or without."""
    from fpmatch.gallery.encryption.keys import KEY_VARIABLE, SCHEME, given_source

    if text is None and not given_source():
        raise click.UsageError(f"give a FILE, or set {KEY_VARIABLE}")
    chosen = given_source() if text is None else text
    return chosen if chosen.startswith(SCHEME) else f"{SCHEME}{chosen}"


@click.command(
    cls=Command,
    epilog="""
FILE is a text file that no other user may read, of mode 0600, with one key a line: its id and 32
bytes in base64. The first is the current key, with which new galleries are encrypted; delete the
line of another once no gallery needs it. The option --key of other commands, or the environment
variable FPMATCH_KEY, names it as file:PATH.

\b
Examples:
  fpmatch key keys.txt --new
  fpmatch key keys.txt
  fpmatch key keys.txt --add
""",
)
@click.argument("source", metavar="FILE", required=False)
@click.option("--new", is_flag=True, help="Make a random key, and write it to a new FILE.")
@click.option(
    "--add", is_flag=True, help="Put a new key before those that are there, as the current one."
)
@json_option
def key(source: str | None, new: bool, add: bool, as_json: bool) -> None:
    """List the ids of the keys in FILE, the current one first, or change its keys.

    The keys are of encrypted galleries, which are lost without them: keep a copy
    elsewhere.
    """
    from fpmatch.gallery.encryption.keys import add_key, load_keys, make_keys

    if new and add:
        raise click.UsageError("--new and --add exclude each other")
    where = _full_source(source)
    if new or add:
        keys = (add_key if add else make_keys)(where)
        text = f"{printable(keys.source)}: new key {keys.ids[0]}"
        say_note("without this key the data are lost: keep a copy of it elsewhere")
    else:
        keys = load_keys(where)
        text = "\n".join([f"{keys.ids[0]}  current", *keys.ids[1:]])
    document = {"source": keys.source, "current": keys.ids[0], "keys": list(keys.ids)}
    show(json_text(document) if as_json else text)
