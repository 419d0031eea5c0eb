"""The command ``fpmatch``, and the table of its sub-commands."""

from __future__ import annotations

from typing import Final

import click

from fpmatch._version import __version__
from fpmatch.cli.command import Program

# See `Program`; the folders after the first are wings.
COMMANDS: Final = {
    ("Commands", "cli"): {
        "verify": "Decide whether two images show the same finger.",
        "extract": "Write templates of images, or each stage as a picture.",
        "convert": "Write a template in another format: ISO, ANSI, NIST, JSON, CSV.",
        "inspect": "Show what files contain: format, size, minutiae, quality.",
        "doctor": "Show what is installed: versions, kernels, extras, plug-ins.",
    },
    ("Galleries and batches", "gallery.cli"): {
        "enrol": "Enrol prints in a gallery, a database of templates.",
        "identify": "Rank the subjects of a gallery by how well they match a probe.",
        "gallery": "Show and change a gallery: list, check, remove, rewrite.",
        "key": "List and make the keys of encrypted galleries.",
        "score": "Compare all probes with all references, scores into a file.",
    },
    ("Server", "server.cli"): {
        "serve": "Serve a web interface to compare prints, and an HTTP API.",
    },
    ("Laboratory", "lab.cli"): {
        "explain": "Show each step of the method on two prints.",
        "evaluate": "Measure error rates on databases of prints.",
        "rates": "Compute error rates of scores of any matcher.",
        "synth": "Make synthetic prints with ground truth.",
        "calibrate": "Fit scores to the rates of your own prints.",
        "points": "Find the transform between two point sets.",
    },
}

fpmatch = Program(
    name="fpmatch",
    help="Verify fingerprints: two images in; a decision, its score and the transform out.",
    context_settings={
        "help_option_names": ["-h", "--help"],
        "max_content_width": 100,
        "show_default": True,
    },
    epilog="""\b
Examples:
  fpmatch verify probe.tif reference.tif
  fpmatch verify probe.tif reference.tif --json --overlay overlay.png
  fpmatch COMMAND --help

Exit status: 0 match or done, 1 no match or some failures, 2 input that cannot be used (with one
line on stderr), 3 inconclusive.
""",
)
fpmatch.sections = COMMANDS
click.version_option(
    __version__, message="%(prog)s %(version)s", help="Show the version and exit."
)(fpmatch)
