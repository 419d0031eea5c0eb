from __future__ import annotations

import gc
import os

from fpmatch.cli.importing import importing


def test_imports_start_no_threads_and_what_they_make_is_not_looked_through(monkeypatch):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "7")
    try:
        with importing():
            assert not gc.isenabled()
            assert os.environ["OPENBLAS_NUM_THREADS"] == "1"
        assert gc.isenabled()
        assert gc.get_freeze_count()
        assert os.environ["OPENBLAS_NUM_THREADS"] == "7"
    finally:
        gc.unfreeze()
