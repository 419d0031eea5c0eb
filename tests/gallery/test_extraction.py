from __future__ import annotations

import subprocess
import sys


def test_a_worker_does_not_import_the_library_of_the_database():
    code = "import sys, fpmatch.gallery.extraction, fpmatch.gallery.prints; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "sqlalchemy" not in done.stdout.split()
