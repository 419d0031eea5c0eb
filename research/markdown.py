"""Tables of the documentation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


def markdown_table(rows: Sequence[Sequence[str]]) -> str:
    """Return rows of cells, the first of which is the head, as a table in Markdown.

    Examples
    --------
    >>> print(markdown_table([["", "EER"], ["one set", "1.2 %"]]))
    |  | EER |
    | --- | ---: |
    | one set | 1.2 % |
    """
    head, *body = rows
    rule = ["---", *["---:"] * (len(head) - 1)]
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, rule, *body))


def calibration_table(rows: Sequence[Mapping[str, Any]], *, digits: int) -> str:
    """Return how often impostors reach each score, as ``scripts/check_calibration`` wrote it.

    Parameters
    ----------
    rows : sequence of mapping
        What `CalibrationCheck.as_json` returned, a database each.
    digits : int
        Digits of the shares in percent.

    Returns
    -------
    str
        Markdown, a row a database.
    """
    head = ["", "impostor pairs"]
    for at in rows[0]["scores"]:
        head += [f"at {at['score']:g} or more", "times what it says"]
    body = []
    for row in rows:
        cells = [row["name"], f"{row['impostors']:,}"]
        for at in row["scores"]:
            cells += [f"{100 * at['share']:.{digits}f} %", f"{at['factor']:.2f}"]
        body.append(cells)
    return markdown_table([head, *body])
