from __future__ import annotations

from fpmatch.evaluation.run import evaluate
from fpmatch.evaluation.tables import format_report


def test_rows_in_percent_with_dashes_for_what_is_undefined(bench, make_database):
    folders = [make_database("a"), make_database("bee", contents={"1_1": "broken"})]
    report = evaluate(folders, matcher=bench.MATCHER, extractor=bench.extractor, workers=1)
    head, a, bee, mean, pooled = format_report(report).splitlines()
    assert head.split()[:4] == ["database", "genuine", "impostor", "EER"]
    assert a.split()[:5] == ["a", "30", "160", f"{100 * report.sets[0].rates.eer:.2f}", "%"]
    assert " - " in a
    assert "FMR10000" not in head  # no database has impostors enough for it
    rank_one = f"{100 * report.sets[1].identification.rank_one:.2f}"
    assert bee.split()[-7:-4] == [rank_one, "%", "1"]
    assert f"{100 * report.mean.eer:.2f} %" in mean
    assert pooled.split()[:3] == ["pooled", "60", "320"]
    assert pooled.split()[-1] == "1"
    assert len({line.index("%", 20) for line in (a, bee, mean, pooled)}) == 1
