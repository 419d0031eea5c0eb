"""Cells of tables: what a spreadsheet would compute is escaped."""

from hypothesis import given
from hypothesis import strategies as st

from fpmatch.gallery.listing.csv_rows import csv_cell

ANY_TEXT = st.text(max_size=20) | st.text(
    st.sampled_from("\x00\x1b\n\r\t\u2028\ud800=+-@＝－a\\"), max_size=9
)


@given(ANY_TEXT)
def test_no_cell_begins_as_a_formula(text):
    cell = csv_cell(text)
    assert cell == csv_cell(cell)
    assert cell[:1] not in {"=", "@", "＝", "＋", "－", "＠", "\t", "\r"}
    if cell[:1] in {"+", "-"}:
        float(cell)
