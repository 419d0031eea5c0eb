"""docs/reference/formats.md and the schema beside it say what the formats are."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from fpmatch.formats.registry import CODECS, codec_of_name
from tests.formats.made_records import record_of, sample_record, written

DOCS = Path(__file__).parents[2] / "docs" / "reference"
PAGE = (DOCS / "formats.md").read_text(encoding="utf-8")
SCHEMA = json.loads((DOCS / "template.schema.json").read_text(encoding="utf-8"))
pytestmark = pytest.mark.docs


def test_the_table_lists_every_format_with_its_suffixes():
    rows = re.findall(r"^\| `([\w-]+)` \| ([^|]+) \| ([^|]+) \| (yes|no) \|", PAGE, re.MULTILINE)
    assert {row[0] for row in rows} == {codec.name for codec in CODECS}
    for name, title, suffixes, is_written in rows:
        codec = codec_of_name(name)
        assert title == codec.title
        assert tuple(re.findall(r"`(\.[\w-]+)`", suffixes)) == codec.suffixes
        assert (is_written == "yes") is (codec.encode is not None)


def test_the_schema_has_the_members_that_are_written(template):
    unstated = record_of(replace(template, dpi_known=False))
    for record in (sample_record(), record_of(template), unstated):
        document = json.loads(written("json", record))
        optional = set() if record is unstated else {"dpi_known"}
        assert list(document) == [one for one in SCHEMA["properties"] if one not in optional]
        assert list(document["minutiae"]) == list(SCHEMA["properties"]["minutiae"]["properties"])
        if document["ridge_field"] is not None:
            field = SCHEMA["properties"]["ridge_field"]
            assert set(field["required"]) <= set(document["ridge_field"])
            assert set(document["ridge_field"]) <= set(field["properties"])
