import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fpmatch.errors import DatasetError
from fpmatch.gallery.batch.score_file import csv_lines
from fpmatch.gallery.listing.csv_rows import csv_cell
from fpmatch.lab.evaluation.rates.scores import (
    choose_matcher,
    read_genuine_and_impostor,
    read_scores,
)

NAMED = [("1_1", "1_2", 1, 0.9), ("1_1", "2_1", 0, 0.1), ("1_2", "2_1", 0, 0.2)]
LETTERS = [("ann a", "ann b", 1, 0.9), ("ann a", "bob", 0, 0.1), ("ann b", "bob", 0, 0.2)]


def write(folder, text, name="scores.txt"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def text_of(rows, separator=",", head=None, order=(0, 1, 2, 3)):
    lines = [[str(row[k]) for k in order] for row in rows]
    return "".join(f"{separator.join(line)}\n" for line in ([head] if head else []) + lines)


def pairs_of(found):
    """Return the pairs as they were given."""
    t = found.trials
    return [
        (found.prints[i], found.prints[j], int(g), s)
        for i, j, g, s in zip(
            found.probe, found.reference, t.genuine, t.similarity.tolist(), strict=True
        )
    ]


HEAD = ["probe", "reference", "genuine", "score"]


@pytest.mark.parametrize(
    "text",
    [
        text_of(NAMED, ",", HEAD),
        text_of(NAMED, ";", HEAD),
        text_of(NAMED, "\t", HEAD),
        text_of(NAMED, " ", HEAD),
        text_of(NAMED, ";", HEAD).replace(".", ","),
        "\ufeff" + text_of(NAMED, ",", ["Probe", "REFERENCE", "Label", "Similarity"]),
        "# of my matcher\n\n" + text_of(NAMED, " "),
        text_of(NAMED, ",", order=(0, 1, 3, 2)),
        text_of(NAMED, " ", order=(0, 1, 3)),
        text_of(NAMED, " ", order=(3, 0, 1)),  # bozorth3 -A outfmt=spg
        text_of(NAMED, ",", ["score", "probe", "gallery"], order=(3, 0, 1)),
        text_of(NAMED, ",", HEAD).replace(",1,", ",genuine,").replace(",0,", ",Impostor,"),
        "set,probe,reference,score,similarity,distance\n"
        + "".join(f"scores,{a},{b},50,{s},7\n" for a, b, _, s in NAMED),
    ],
)
def test_a_table_is_understood(tmp_path, text):
    (found,) = read_scores(write(tmp_path, text))
    assert (found.name, found.matcher) == ("scores", "")
    assert pairs_of(found) == NAMED
    assert found.trials.fingers == 2


def test_any_string_is_a_name_where_the_pairs_are_marked(tmp_path):
    (found,) = read_scores(write(tmp_path, text_of(LETTERS, ",", HEAD)))
    assert pairs_of(found) == LETTERS
    assert (found.trials.fingers, found.trials.probe.tolist()) == (2, [0, 0, 0])


def test_a_pattern_finds_fingers_in_names(tmp_path):
    path = write(tmp_path, text_of(LETTERS, ",", order=(0, 1, 3)))
    (found,) = read_scores(path, finger_of=lambda name: name[:3])
    assert pairs_of(found) == LETTERS
    with pytest.raises(DatasetError, match=r"line 1, whether .* 'ann a' and 'ann b' are not named"):
        read_scores(path)


BOB_5 = "ann m_ann ann p/1 0.9\nann m_ann bob p/2 0.1\nbob m_bob ann p/1 nan\n"


def test_tables_of_bob_have_the_fingers(tmp_path):
    (five,) = read_scores(write(tmp_path, BOB_5))
    assert five.prints == ("p/1", "m_ann", "p/2", "m_bob")
    assert five.trials.genuine.tolist() == [True, False, False]
    assert five.trials.similarity.tolist() == [0.9, 0.1, 0.0]
    assert five.compared.tolist() == [True, True, False]
    four = BOB_5.replace(" m_ann", "").replace(" m_bob", "")
    (four,) = read_scores(write(tmp_path, four))
    assert (four.prints, four.trials.fingers) == ((), 2)
    assert four.trials.genuine.tolist() == [True, False, False]
    as_csv = (
        "probe_template_id,probe_subject_id,bio_ref_template_id,bio_ref_subject_id,score,eyes\n"
        "p/1,ann,m_ann,ann,0.9,left\np/2,bob,m_ann,ann,0.1,\np/1,ann,m_bob,bob,,\n"
    )
    (found,) = read_scores(write(tmp_path, as_csv))
    assert found.prints == five.prints
    assert found.trials.genuine.tolist() == five.trials.genuine.tolist()


@pytest.mark.parametrize(
    "text",
    [
        "score,genuine\n0.9,1\n0.8,1\n0.1,0\nnan,0\n",
        "0.9 1\n0.8 1\n0.1 0\nnan 0\n",
        "1;0,9\n1;0,8\n0;0,1\n0;nan\n",
        "genuine,impostor\n0.9,0.1\n0.8,nan\n",
        "genuine,impostor\n,0.1\n0.9,nan\n0.8\n",
    ],
)
def test_scores_without_names(tmp_path, text):
    (found,) = read_scores(write(tmp_path, text))
    assert (found.prints, found.trials.fingers) == ((), 0)
    assert [values.tolist() for values in found.split()] == [[0.9, 0.8], [0.1, 0.0]]
    assert found.compared.tolist() == [True, True, True, False]


def test_genuine_and_impostor_files_have_the_score_last(tmp_path):
    genuine = write(tmp_path, "101 1 0.9\n101 2 0.8\n", "g")
    impostor = write(tmp_path, "name score\nx 0.1\ny 0.2\n", "i")
    found = read_genuine_and_impostor(genuine, impostor)
    assert [values.tolist() for values in found.split()] == [[0.9, 0.8], [0.1, 0.2]]


def test_a_file_of_one_kind_has_no_columns_of_both(tmp_path):
    both = write(tmp_path, "genuine;impostor\n7;0.5\n", "both")
    with pytest.raises(DatasetError, match="no column 'similarity', 'score' or 'distance'"):
        read_genuine_and_impostor(both, both)


def test_distances_are_taken_negatively_and_must_be_declared(tmp_path):
    path = write(tmp_path, text_of(NAMED, ",", [*HEAD[:3], "distance"]))
    with pytest.raises(DatasetError, match=r"column 'distance': .* need --distances"):
        read_scores(path)
    (found,) = read_scores(path, distances=True)
    assert found.distances
    assert found.trials.similarity.tolist() == [-0.9, -0.1, -0.2]
    path = write(tmp_path, "1_1 1_2 3\n1_1 2_1 nan\n1_2 2_1 9\n")
    (found,) = read_scores(path, distances=True)
    assert found.trials.similarity.tolist() == [-3, -9, -9]  # as low as any


def test_pairs_in_both_orders(tmp_path):
    rows = "probe,reference,score\n1_1,1_1,9\n1_1,1_2,3\n1_2,1_1,3\n1_1,2_1,1\n"
    (found,) = read_scores(write(tmp_path, rows))
    assert pairs_of(found) == [("1_1", "1_2", 1, 3.0), ("1_1", "2_1", 0, 1.0)]
    (found,) = read_scores(write(tmp_path, rows + "2_1,1_1,2\n"))  # the order matters to it
    assert len(pairs_of(found)) == 4
    with pytest.raises(DatasetError, match=r"line 6, column 'score': 1_1 and 1_2 .* in line 3$"):
        read_scores(write(tmp_path, rows + "1_1,1_2,4\n"))


def test_a_file_of_score_has_each_pair_once(tmp_path):
    path = tmp_path / "db.csv"
    path.write_text(
        "probe,reference,similarity,score,reason\n"
        "1_1,1_1,9,9,\n1_1,1_2,3,3,\n1_2,1_1,3,3,\n1_2,2_1,,,reference: torn\n"
    )
    (found,) = read_scores(path)
    assert (found.name, found.matcher, found.prints) == ("db", "", ("1_1", "1_2", "2_1"))
    assert found.trials.similarity.tolist() == [3, 0]
    assert found.compared.tolist() == [True, False]
    assert found.never_compared == ["2_1"]
    assert choose_matcher([found], "any", path) == [found]
    with pytest.raises(DatasetError, match="cannot be read: is a directory"):
        read_scores(tmp_path)


def test_a_file_and_its_label_in_a_gallery_are_one_print(tmp_path):
    rows = "101_1.tif 101_1 9\n101_1.tif 101_2 8\n101_1.tif 102_1 1\n"
    (found,) = read_scores(write(tmp_path, rows))
    assert pairs_of(found) == [("101_1.tif", "101_2", 1, 8.0), ("101_1.tif", "102_1", 0, 1.0)]


def test_fingers_are_numbered_as_an_evaluation_does(tmp_path):
    rows = "10_1 10_2 1\n9_1 10_1 0\n9_1 9_2 1\n"
    (found,) = read_scores(write(tmp_path, rows))
    assert found.trials.probe.tolist() == [1, 0, 0]


START = "set,probe,reference,genuine,similarity\n"
GOOD = START + "a,1_1.tif,1_2.tif,1,0.5\n"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "holds no comparison"),
        ("# nothing\n\n", "holds no comparison"),
        (START, "holds no comparison"),
        (
            "a,b\nx,y\n",
            "line 1: not a file of scores: no column 'similarity', 'score' or 'distance'",
        ),
        (GOOD + "\na,1_1,2_1,yes,1\n", "line 4, column 'genuine': must be 1 or 0, not 'yes'"),
        (GOOD + "a,1_1.tif,2_1.tif,1,2\na,1_2.tif,2_1.tif,0,1\n", "line 4: genuine is 0, but"),
        (
            START + "a,left.tif,2_1.tif,,0.5\n",
            "line 2, column 'genuine': whether the pair is genuine",
        ),
        (START + "a,,2_1.tif,0,0.5\n", "line 2, column 'probe': no name of a print"),
        (START + "a,1_1.tif,2_1.tif,0,high\n", "line 2, column 'similarity': 'high' is not a"),
        (START + "a,1_1.tif,2_1.tif,0,1_000\n", "line 2, column 'similarity': '1_000' is not a"),
        (START + "a,1_1.tif,2_1.tif,0,inf\n", "line 2, column 'similarity': 'inf' is not a finite"),
        (GOOD + "a,1_1.tif,1_2.tif,1,0\n", "line 3, column 'similarity': 1_1.tif and 1_2.tif"),
        (GOOD[:-1] + ",7\n", "line 2, column 6: 6 columns instead of 5"),
        ("score,genuine\n0.5,\n", "line 2, column 'genuine': whether the pair is genuine"),
        ("score\n0.5\n", "line 2, whether the pair is genuine is not known: there is no column"),
        ("0.5\n0.6\n", "line 1, whether the pair is genuine is not known: there is no column"),
        ("0.5 0.6\n0.1 0.2\n", "what its 2 columns contain is not clear: name them"),
        ("1 0\n0 1\n", "what its 2 columns contain is not clear: name them"),
        ("1_1 2_1 0.5\n1_1 2_2 x\n", "line 2, column 3: 'x' is not a number, as line 1 has"),
        ("1_1 2_1 0.5\n\n1_1 2_2\n", "line 3, column 3: '' is not a number, as line 1 has"),
        ("a b c d e f 0.5\n", "what its 7 columns contain is not clear"),
        (
            "probe,reference,probe_subject,reference_subject,score\na,b,1,2,1\na,c,2,3,1\n",
            "line 3, column 'probe_subject': 'a' is of finger '2', and in an earlier row '1'",
        ),
        (b"\xff\xfe\x00", "line 1: not a CSV file in UTF-8 (byte 0xff)"),
        (START + 'a,"' + "x" * 200_000 + '",2,0,1\n', "line 2: not a CSV file: field larger"),
        (START + 'a,"1_1,2,0,1\n', "not a CSV file: unexpected end of data"),
        (None, "cannot be read: no such file"),
    ],
    ids=lambda value: str(value)[-40:],
)
def test_a_file_that_is_none_is_named(tmp_path, content, reason):
    path = tmp_path / "scores.csv"
    if content is not None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(DatasetError, match=r"^.*scores\.csv: ") as caught:
        read_scores(path)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


names = st.text(
    st.characters(blacklist_categories=["Cs"], blacklist_characters="\0"), min_size=1, max_size=6
)
scores = st.floats(-1e9, 1e9).map(lambda value: value + 0.0)


@given(st.lists(names, min_size=2, max_size=5, unique=True), st.data())
def test_what_is_written_is_read_whatever_the_names(tmp_path_factory, prints, data):
    prints = list(dict.fromkeys(map(csv_cell, prints)))  # as names of prints are
    assume(len(prints) > 1)
    fingers = {name: data.draw(st.integers(0, 2), label=name) for name in prints}
    pairs = [(a, b) for k, a in enumerate(prints) for b in prints[k + 1 :]]
    rows = [(a, b, int(fingers[a] == fingers[b]), data.draw(st.none() | scores)) for a, b in pairs]
    path = tmp_path_factory.mktemp("round") / "trip.csv"
    head = ("matcher", "set", "probe", "reference", "genuine", "similarity")
    lines = [["m", "s", *row[:3], "" if row[3] is None else row[3]] for row in rows]
    path.write_bytes(csv_lines([head, *lines]))
    (found,) = read_scores(path)
    assert found.compared.tolist() == [row[3] is not None for row in rows]
    lowest = min([0.0, *(row[3] for row in rows if row[3] is not None)])
    assert pairs_of(found) == [(*row[:3], lowest if row[3] is None else row[3]) for row in rows]
    assert found.trials.fingers == len(set(fingers.values()))
