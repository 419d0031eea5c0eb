import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fpmatch.errors import DatasetError
from fpmatch.gallery.batch.score_file import csv_lines
from fpmatch.gallery.listing.csv_rows import csv_cell
from fpmatch.lab.evaluation.rates.scores import (
    choose_matcher,
    finger_in_name,
    read_genuine_and_impostor,
    read_scores,
    split,
)

HEAD = "probe,reference,genuine,score\n"
NAMED = [("1_1", "1_2", 1, 0.9), ("1_1", "2_1", 0, 0.1), ("1_2", "2_1", 0, 0.2)]
ROWS = HEAD + "1_1,1_2,1,0.9\n1_1,2_1,0,0.1\n1_2,2_1,0,0.2\n"


def write(folder, text, name="scores.csv"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def pairs_of(found):
    """Return the pairs as they were given."""
    t = found.trials
    return [
        (found.prints[i], found.prints[j], int(g), s)
        for i, j, g, s in zip(
            found.probe, found.reference, t.genuine, t.similarity.tolist(), strict=True
        )
    ]


@pytest.mark.parametrize(
    "text",
    [
        ROWS,
        ROWS.replace(",", ";"),
        ROWS.replace(",", "\t").replace("\n", "\r\n"),
        "\ufeff# of my matcher\n\n"
        + ROWS.replace("probe,", "Probe,").replace("score", "Similarity"),
        ROWS.replace(",1,", ",genuine,").replace(",0,", ",Impostor,"),
        "score,reference,set,probe\n.9,1_2,scores,1_1\n.1,2_1,,1_1\n0.2,2_1,scores,1_2\n",
        "probe,reference,score,similarity\n1_1,1_2,50,0.9\n1_1,2_1,50,.1\n1_2,2_1,50,.2\n",
    ],
)
def test_a_table_is_understood(tmp_path, text):
    (found,) = read_scores(write(tmp_path, text))
    assert (found.name, found.matcher) == ("scores", "")
    assert pairs_of(found) == NAMED
    assert found.trials.fingers == 2


def test_names_that_contain_no_finger_need_labels_and_a_pattern_finds_fingers(tmp_path):
    text = ROWS.replace("1_1", "ann a").replace("1_2", "ann b").replace("2_1", "bob c")
    (found,) = read_scores(path := write(tmp_path, text))
    assert [pair[2:] for pair in pairs_of(found)] == [pair[2:] for pair in NAMED]
    assert found.trials.fingers == 0
    finger_of = finger_in_name(r"(?P<subject>\w+) (?P<impression>\w)")
    (found,) = read_scores(path, finger_of=finger_of)
    assert (found.trials.fingers, found.trials.probe.tolist()) == (2, [0, 0, 0])


def test_failed_comparisons_are_as_low_as_any_and_prints_without_any_have_failed(tmp_path):
    rows = "probe,reference,similarity,reason\n1_1,1_2,-3,\n1_2,2_1,,reference: torn\n"
    (found,) = read_scores(path := write(tmp_path, rows + "1_1,2_1,NaN,\n"))
    assert found.trials.similarity.tolist() == [-3, -3, -3]
    assert found.compared.tolist() == [True, False, False]
    assert found.never_compared == ["2_1"]
    (found,) = read_scores(path, distances=True)
    assert (found.trials.similarity.tolist(), found.distances) == ([3, 0, 0], True)


def test_genuine_and_impostor_files_have_the_score_last(tmp_path):
    genuine = write(tmp_path, "101,1,0.9\n101,2,nan\n", "g")
    impostor = write(tmp_path, "name,score\nx,0.1\ny,0.2\n", "i")
    found = read_genuine_and_impostor(genuine, impostor)
    assert [values.tolist() for values in split([found.trials])] == [[0.9, 0.0], [0.1, 0.2]]
    for text, why in (("score\n", "holds no score"), ("1\nx\n", "line 2: 'x' is not a finite")):
        with pytest.raises(DatasetError, match=why):
            read_genuine_and_impostor(genuine, write(tmp_path, text, "i"))


def test_each_pair_counts_once_and_no_print_with_itself(tmp_path):
    rows = "probe,reference,score\n1_1,1_1.tif,9\n1_1,1_2,3\n1_2,1_1,3\n1_1,2_1,1\n"
    (found,) = read_scores(write(tmp_path, rows))
    assert pairs_of(found) == [("1_1", "1_2", 1, 3.0), ("1_1", "2_1", 0, 1.0)]
    (found,) = read_scores(write(tmp_path, rows + "2_1,1_1,2\n"))  # the order matters to it
    assert len(pairs_of(found)) == 4


def test_fingers_are_numbered_by_their_names_and_sets_by_matcher_and_database(tmp_path):
    text = "matcher,set,probe,reference,score\nm,a,10_1,9_1,0\nm,a,9_1,9_2,1\nn,a,9_1,10_1,1\n"
    found = read_scores(path := write(tmp_path, text))
    assert [(one.matcher, one.name) for one in found] == [("m", "a"), ("n", "a")]
    assert found[0].trials.probe.tolist() == [1, 0]
    assert choose_matcher(found, "n", path) == found[1:]
    with pytest.raises(DatasetError, match=r"s\.csv: holds scores of m, n, none of paper"):
        choose_matcher(found, "paper", "s.csv")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "line 1: not a file of scores: the first line names the columns"),
        ("# nothing\n\n", "not a file of scores"),
        ("probe,reference,score,Score\n1_1,1_2,1,0\n", "line 1: two columns are named score"),
        (HEAD, "holds no comparison"),
        ("1_1,1_2,0.9\n1_1,2_1,0.1\n", "line 1: not a file of scores: the first line names"),
        (ROWS + "\n1_1,2_2,yes,1\n", "line 6: genuine must be 1 or 0, not 'yes'"),
        (ROWS + "3_1,2_1,1,2\n", "line 5: '3_1' and '2_1' are of different fingers by their"),
        (ROWS + "2_2,2_1,0,2\n", "line 5: '2_2' and '2_1' are of one finger by their names"),
        (HEAD + "left,2_1,,0.5\n", "line 2: 'left' and '2_1' are not both named FFF_M"),
        (HEAD + ",2_1,0,0.5\n", "line 2: no name of a print"),
        (HEAD + "1_1,2_1,0,high\n", "line 2: 'high' is not a finite number"),
        (HEAD + "1_1,2_1,0,1_000\n", "line 2: '1_000' is not a finite number"),
        (HEAD + "1_1,2_1,0,-inf\n", "line 2: '-inf' is not a finite number"),
        (ROWS + "1_1,1_2,1,7\n", "line 5: '1_1' and '1_2' are compared again, with another score"),
        (ROWS + "1_1,2_2,0,1,7\n", "line 5: 5 columns instead of 4"),
        (b"\xff\xfe\x00", "not a CSV file in UTF-8"),
        (HEAD.encode("utf-16"), "not a CSV file in UTF-8"),
        (HEAD + '1_1,"' + "x" * 200_000 + '",2,1\n', "line 2: not a CSV file: field larger"),
        (None, "cannot be read: no such file"),
    ],
    ids=lambda value: str(value)[-40:],
)
def test_a_file_that_is_none_is_named_in_one_line(tmp_path, run, content, reason):
    path = tmp_path / "scores.csv"
    if content is not None:
        write(tmp_path, content)
    with pytest.raises(DatasetError, match=r"^.*scores\.csv: ") as caught:
        read_scores(path)
    assert reason in str(caught.value)
    result = run("rates", path)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == f"fpmatch: error: {caught.value}\n"


names = st.text(
    st.characters(blacklist_categories=["Cs"], blacklist_characters="\0"), min_size=1, max_size=6
)
scores = st.floats(-1e9, 1e9).map(lambda value: value + 0.0)


@given(st.lists(names, min_size=2, max_size=5, unique=True), st.data())
def test_what_is_written_is_read_whatever_the_names(tmp_path_factory, prints, data):
    prints = list(dict.fromkeys(map(csv_cell, prints)))  # as names of prints are
    assume(len(prints) > 1 and len({one.rpartition(".")[0] or one for one in prints}) > 1)
    fingers = {name: str(data.draw(st.integers(0, 2), label=name)) for name in prints}
    pairs = [(a, b) for k, a in enumerate(prints) for b in prints[k + 1 :]]
    rows = [(a, b, int(fingers[a] == fingers[b]), data.draw(st.none() | scores)) for a, b in pairs]
    path = tmp_path_factory.mktemp("round") / "trip.csv"
    head = ("matcher", "set", "probe", "reference", "genuine", "similarity")
    lines = [["m", "s", *row[:3], "" if row[3] is None else row[3]] for row in rows]
    path.write_bytes(csv_lines([head, *lines]))
    (found,) = read_scores(path, finger_of=fingers.get)
    stems = {name: name.rpartition(".")[0] for name in prints}
    same = [stems[a] == b or stems[b] == a for a, b in pairs]
    rows = [row for row, one in zip(rows, same, strict=True) if not one]
    lowest = min([0.0, *(row[3] for row in rows if row[3] is not None)])
    if not any(same):
        assert found.compared.tolist() == [row[3] is not None for row in rows]
        assert pairs_of(found) == [(*row[:3], lowest if row[3] is None else row[3]) for row in rows]
