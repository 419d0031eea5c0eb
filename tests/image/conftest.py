"""Make `made_images` and `made_files` importable for the tests beside and below it."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
