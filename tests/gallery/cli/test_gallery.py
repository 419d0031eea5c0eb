import json

from fpmatch.gallery.gallery import open_gallery


def test_the_summary_of_a_list(run, place):
    lines = run("gallery", "list", place, "--summary").stdout.splitlines()
    assert lines[0] == str(place)
    document = json.loads(run("gallery", "list", place, "--summary", "--json").stdout)
    assert document.pop("gallery") == str(place)
    assert [line.split()[0] for line in lines[1:]] == [*document]
    assert document == {"version": 3, "impressions": 3, "subjects": 2, "failures": 1, "keys": []}


def test_list(run, place):
    words = ("gallery", "list", place)
    header, *_, last = [line.split() for line in run(*words).stdout.splitlines()]
    assert header == ["number", "print", "dpi", "minutiae", "picture"]
    assert last == ["3", "a/b_thumb_1", "500", "1", "/prints/2.tif"]
    rows = json.loads(run(*words, "--subject", "1", "--json").stdout)
    assert [row["impression"] for row in rows] == ["1", "2"]
    assert rows[0]["sha256"] == 64 * "0"
    assert json.loads(run(*words, "--subject", "7", "--json").stdout) == []
    assert run(*words, "--failures").stdout == "/prints/9.tif: no minutiae found\n"
    rows = json.loads(run(*words, "--failures", "--json").stdout)
    assert rows == [{"source": "/prints/9.tif", "reason": "no minutiae found"}]


def test_remove(run, place):
    result = run("gallery", "remove", place, 1, "--failures")
    assert result.stdout == (
        f"removed 1 impression, cleared 1 failure; 2 impressions left: {place}\n"
    )
    result = run("gallery", "remove", place, "--subject", "a/b")
    assert result.stdout == f"removed 1 impression; 1 impression left: {place}\n"
    with open_gallery(place) as gallery:
        assert [entry.id for entry in gallery.entries()] == [2]
        assert gallery.failures() == []


def test_check_tells_which_fingers_disagree(run, place):
    result = run("gallery", "check", place)
    assert (result.exit_code, result.stderr) == (1, "")
    assert "  entry 2 does not match entry 1, score 0.0" in result.stdout
    (found,) = json.loads(run("gallery", "check", place, "--json").stdout)
    assert (found["subject"], found["consistent"], found["groups"]) == ("1", False, [[1], [2]])
    other = run("gallery", "check", place, "--subject", "a/b")
    assert (other.exit_code, other.stdout[:9]) == (0, "0 fingers")
