"""What the tests of galleries share: an empty gallery on SQLite and on PostgreSQL, and prints."""

import os
import secrets
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import platformdirs
import pytest

from fpmatch.gallery.encryption.keys import make_keys
from fpmatch.gallery.gallery import open_gallery

sys.path.append(str(Path(__file__).parent))  # of `made_prints`

POSTGRES_PROGRAMS = sorted(Path("/usr/lib/postgresql").glob("*/bin"))


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """Give the user another cache folder, and return it."""
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda name: tmp_path / "cache" / name)
    return tmp_path / "cache"


@pytest.fixture
def local_cluster():
    """Return a cluster of two workers on this machine, of this test alone."""
    distributed = pytest.importorskip("distributed", reason="Dask (extra dask) is not installed")
    here = {"host": "127.0.0.1", "dashboard_address": ":0", "silence_logs": 60}
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **here) as started:
        yield started


@pytest.fixture(scope="session")
def postgresql(tmp_path_factory):
    """Start a PostgreSQL server of our own on loopback; return its URL without a database."""
    pytest.importorskip("psycopg", reason="psycopg is not installed (fpmatch[postgres])")
    if not POSTGRES_PROGRAMS:
        pytest.skip("PostgreSQL's server is not installed (/usr/lib/postgresql)")
    programs = POSTGRES_PROGRAMS[-1]
    root = os.geteuid() == 0  # the server refuses to run as root
    if root and shutil.which("setpriv") is None:
        pytest.skip("PostgreSQL's server does not run as root, and there is no setpriv")
    folder = Path("/tmp", f"fpmatch-postgresql-{secrets.token_hex(8)}")
    folder.mkdir(mode=0o700)
    if root:
        shutil.chown(folder, "nobody")
    become = ["setpriv", "--reuid=nobody", "--clear-groups"] if root else []

    def call(program, *words):
        command = [*become, programs / program, *words]
        subprocess.run(
            [str(word) for word in command],
            check=True,
            cwd=folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=60,
        )

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    try:
        call("initdb", "-D", folder / "data", "-U", "fpmatch", "-A", "trust", "-N", "-E", "UTF8")
        settings = f"-h 127.0.0.1 -p {port} -k {folder} -c fsync=off"
        call("pg_ctl", "-D", folder / "data", "-w", "-o", settings, "-l", folder / "log", "start")
        try:
            yield f"postgresql://fpmatch@127.0.0.1:{port}"
        finally:
            call("pg_ctl", "-D", folder / "data", "-m", "immediate", "stop")
    finally:
        shutil.rmtree(folder)


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.slow)])
def where(request, tmp_path):
    """Return the place of a gallery that is not made yet, on either kind of database."""
    if request.param == "sqlite":
        return str(tmp_path / "gallery.db")
    import psycopg

    server = request.getfixturevalue("postgresql")
    name = f"t{secrets.token_hex(8)}"
    with psycopg.connect(f"{server}/postgres", autocommit=True) as connection:
        connection.execute(f"CREATE DATABASE {name}")
    return f"{server}/{name}"


@pytest.fixture
def source(tmp_path, monkeypatch):
    """Return the source of a new key, which the environment gives."""
    source = f"file:{tmp_path / 'keys.txt'}"
    make_keys(source)
    monkeypatch.setenv("FPMATCH_KEY", source)
    return source


@pytest.fixture
def gallery(tmp_path):
    """Return an open gallery in a file, empty."""
    with open_gallery(tmp_path / "gallery.db", create=True) as opened:
        yield opened
