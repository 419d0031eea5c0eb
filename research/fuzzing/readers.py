"""Which module of fpmatch reads files, requests or databases, and which target feeds it.

A test compares this with what the modules call: a new one must be entered here, with its targets,
or with the reason why nothing foreign comes that way.
"""

from __future__ import annotations

READING_CALLS = frozenset(
    {
        *("read_bytes", "read_text", "open", "loads", "np.load", "fromfile", "frombuffer"),
        *("memmap", "connect", "create_engine", "parse_json", "parse_toml", "unpack_from"),
        *("imdecode", "readNetFromONNX"),
    }
)
"""Calls by which bytes from outside become values."""

_OWN = "reads files of the package alone"
_OUT = "opens what it writes, or nothing"
_PICTURES = tuple(
    f"image-{kind}"
    for kind in ("png", "tiff", "bmp", "jpeg", "gif", "pnm", "webp", "jpeg2000", "ihead", "raw")
)
_TEMPLATES = ("csv", "json", "iso2005", "iso2011", "ansi2004", "an2", "xyt")

READERS: dict[str, tuple[str, ...] | str] = {
    "base/kernels.py": _OWN,
    "base/network.py": _OWN,
    "base/npy.py": ("npy", "points", "array-picture"),
    "base/output.py": _OUT,
    "base/parsing.py": (
        *_PICTURES,
        *_TEMPLATES,
        *("calibration", "truth", "dataset-info", "settings"),
    ),
    "base/plugins.py": "searches the metadata of installed packages for a name",
    "cli/doctor.py": "reads what the system states about memory",
    "cli/group.py": _OUT,
    "cli/verify.py": "hashes the files that were compared",
    "cli/wings.py": _OWN,
    "formats/fmr.py": ("iso2005", "iso2011", "ansi2004", "ansi2009"),
    "formats/json_format.py": ("json",),
    "gallery/batch/resumed_rows.py": ("unfinished-run",),
    "gallery/batch/run.py": ("unfinished-run",),
    "gallery/batch/sources.py": ("stored-template",),
    "gallery/batch/store.py": ("unfinished-run",),
    "gallery/encryption/keys.py": ("keys",),
    "gallery/engine/cluster.py": "a Dask scheduler is trusted; see docs/security.md",
    "gallery/engine/folder_lock.py": "opens a folder to lock it",
    "gallery/engine/local.py": "reads the script that was started",
    "gallery/engine/mapped.py": "maps memory of the process that started it",
    "gallery/engine/pieces.py": "unpickles what this process has just written",
    "gallery/engine/task.py": "unpickles what this process has just written",
    "gallery/gallery.py": ("gallery", "gallery-prepared", "gallery-index"),
    "gallery/index/files.py": (
        *("index-list", "index-list-forged"),
        *("index-segment", "index-segment-forged"),
    ),
    "gallery/index/loss.py": _OWN,
    "gallery/index/model.py": _OWN,
    "gallery/index/prepared.py": ("prepared", "prepared-forged"),
    "gallery/index/prints/_prepared_view_kernel.py": "opens prints that are in memory",
    "gallery/index/prints/compact_template.py": ("compact-template",),
    "gallery/index/prints/prepared_prints.py": ("prepared", "prepared-forged"),
    "gallery/listing/csv_rows.py": ("manifest", "pairs", "scores"),
    "gallery/store/array_file.py": (
        *("prepared", "prepared-forged", "packed-descriptors"),
        *("index-list", "index-segment"),
    ),
    "gallery/store/audit_chain.py": ("audit-log",),
    "gallery/store/audit_log.py": ("audit-log",),
    "gallery/store/database.py": ("gallery", "gallery-sealed"),
    "gallery/store/kept_files.py": "encrypts files without reading what they contain",
    "gallery/store/postgresql.py": "leaves what a server sends to psycopg",
    "gallery/store/stored_template.py": ("packed-template", "compact-template"),
    "gallery/tasks/enrol.py": "hashes the files that are enrolled",
    "image/dataset_folder.py": ("dataset-info",),
    "image/io/grey.py": ("image-raw",),
    "image/io/pillow_formats.py": _PICTURES,
    "image/io/resolution.py": _PICTURES,
    "image/quality/measures.py": _OWN,
    "lab/evaluation/ground_truth/truth.py": ("truth",),
    "lab/evaluation/rates/scores.py": "makes arrays of numbers that are checked",
    "lab/explain/page.py": _OUT,
    "lab/points/points_csv.py": ("points",),
    "lab/synthesis/database.py": ("truth-check",),
    "lab/synthesis/plan.py": ("dataset-info",),
    "matching/calibration.py": ("calibration",),
    "matching/pipeline/evidence.py": _OWN,
    "matching/pipeline/score_model.py": _OWN,
    "prints/reading.py": _OUT,
    "server/client.py": "sends files as they are",
    "server/pool.py": _OUT,
    "server/settings.py": ("settings",),
}
"""For each module that makes such a call, its targets, or why it has none."""
