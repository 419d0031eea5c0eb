"""`scripts/check_pages`: what fails is named with page and line."""

import subprocess
import sys
from pathlib import Path

import pytest

RUNNER = Path(__file__).resolve().parents[1] / "scripts" / "check_pages.py"
PAGE = """# A page

1. A list:

   ```sh
   fpmatch verify sample_data/101_1.tif sample_data/101_2.tif
   fpmatch inspect gone.tif
   ```

```python
print(1 / 0)
```

```bash
docker run fpmatch
```
"""


@pytest.mark.slow
def test_a_command_that_fails_is_named_with_page_and_line(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(PAGE, encoding="utf-8")
    command = [sys.executable, RUNNER, page]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert [line for line in done.stdout.splitlines() if str(tmp_path) in line] == [
        f"{page}:7: exit status 2: fpmatch inspect gone.tif",
        f"{page}:10: exit status 1: ```python",
    ]
    assert "ZeroDivisionError" in done.stderr
