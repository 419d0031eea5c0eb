import numpy as np
import pytest

from fpmatch.errors import DatasetError, MatcherError
from fpmatch.lab.evaluation import impostors
from fpmatch.lab.evaluation.impostors import gather_impostors, impostors_of_report
from fpmatch.lab.evaluation.report.score_rows import write_scores


def test_scores_and_folders_give_the_same(options, report, tmp_path):
    scores = tmp_path / "scores.csv"
    folders = [row.extracted.dataset.impressions[0].path.parent for row in report.sets]
    write_scores(scores, report)
    expected = impostors_of_report(report)
    assert sum(one.trials.similarity.size for one in expected) == 252 - 21 + 240
    for sources in (folders, [scores]):
        found = gather_impostors(sources, **options)
        assert [one.name for one in found] == ["set, one", "b"]
        for one, other in zip(found, expected, strict=True):
            assert not one.trials.genuine.any()
            assert one.trials.fingers == other.trials.fingers
            np.testing.assert_array_equal(one.trials.similarity, other.trials.similarity)
    with pytest.raises(DatasetError, match="set, one: scores of this database are given twice"):
        gather_impostors([scores, scores], **options)
    with pytest.raises(DatasetError, match="b: given both as a folder and as scores"):
        gather_impostors([scores, folders[1]], **options)


def test_unusable_sources(options, tmp_path):
    with pytest.raises(DatasetError, match="no such folder"):
        gather_impostors([tmp_path / "nowhere"], **options)
    with pytest.raises(MatcherError, match="unknown matcher 'nobody'"):
        gather_impostors([tmp_path], matcher="nobody")


def test_dpi_and_polarity_of_the_prints_may_be_given(make_database, options, monkeypatch):
    asked = set()

    def extract(path, dpi, reader):
        asked.add((dpi, reader.folders[path.parent]))
        return options["extractor"](path, dpi)

    monkeypatch.setattr(impostors, "extract_image", extract)
    place = make_database("prints", toml="dpi = 569\n")
    given = {name: options[name] for name in ("matcher", "workers")}
    gather_impostors([place], **given, dpi=1000, reading={"polarity": "white"})
    assert asked == {(1000.0, "white")}
