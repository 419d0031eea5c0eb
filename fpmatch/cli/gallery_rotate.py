"""`fpmatch gallery rotate`: encrypt a gallery, or change its key."""

from __future__ import annotations

from dataclasses import asdict

import click

from fpmatch.cli.notes import say_note, show, show_line
from fpmatch.cli.options import json_option, key_option
from fpmatch.cli.progress import ProgressBars
from fpmatch.printable import json_text
from fpmatch.text_table import count


@click.command(
    epilog="""\b
Examples:
  fpmatch gallery rotate prints.db --key file:keys.txt
  fpmatch gallery rotate prints.db --decrypt --key file:keys.txt

Exit status: 0 when all templates are sealed with the current key, 1 when some are damaged, which
are left as they are, 2 when it could not be done.
"""
)
@click.argument("gallery")
@click.option("--decrypt", is_flag=True, help="Store all templates without encryption instead.")
@json_option
@key_option
def rotate(gallery: str, decrypt: bool, as_json: bool) -> int:
    """Encrypt all templates of GALLERY with the current key.

    The source of the keys has the new key first, as `fpmatch key new --add` puts it, and all keys
    that the gallery uses. A gallery that is not encrypted is encrypted; nothing of its plain
    templates is left in its files. Other programs may search it and enrol in it meanwhile, with the
    same source. A rotation that was interrupted continues when it is started again.
    """
    from fpmatch.gallery.gallery import open_gallery
    from fpmatch.gallery.store.sealing import PLAIN
    from fpmatch.gallery.tasks.rotation import rotate

    with open_gallery(gallery) as opened, ProgressBars({"rotate": "encrypting"}) as bars:
        done, name = rotate(opened, decrypt=decrypt, progress=bars.show), opened.name
    for number, why in done.damaged.items():
        say_note(f"{name}: entry {number}, left as it is: {why}")
    if as_json:
        damaged = [{"id": number, "reason": why} for number, why in done.damaged.items()]
        show(json_text({"gallery": name, **asdict(done), "damaged": damaged}))
    else:
        state = "not encrypted any more" if done.key == PLAIN else f"encrypted with key {done.key}"
        show_line(f"{name}: {state}; {count(done.sealed, 'template')} rewritten")
    return 1 if done.damaged else 0
