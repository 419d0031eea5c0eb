"""`fpmatch extract`: templates and stages, what it writes, and what becomes of bad images."""

import json
import shutil

import pytest

from fpmatch import assess, extract, load_template, save_template


def names(folder):
    return {entry.name for entry in folder.iterdir()}


def test_templates_are_those_of_the_library(run, prints, tmp_path):
    out = tmp_path / "new" / "out"
    assessed = {name: assess(prints / f"{name}.png") for name in ("1_1", "2_1")}
    result = run("extract", prints / "1_1.png", prints / "2_1.png", "-o", out)
    assert (result.exit_code, result.stderr) == (0, "")
    assert names(out) == {"1_1.json", "1_1.csv", "2_1.json", "2_1.csv"}
    for path in out.iterdir():
        saved = load_template(path)
        assert saved.minutiae == assessed[path.stem].template.minutiae
        assert (saved.width, saved.height, saved.dpi) == (280, 300, 500)
    total = sum(len(one.template.minutiae) for one in assessed.values())
    assert result.stdout.startswith(f"2 of 2 templates, {total} minutiae, quality ")


def test_json_has_files_quality_and_failures(run, prints, tmp_path):
    out, image = tmp_path / "out", prints / "1_1.png"
    save_template(tmp_path / "t.json", extract(image))
    given = (image, tmp_path / "t.json", prints / "text.png", prints / "blank.png")
    result = run("extract", *given, "-o", out, "--json")
    assert result.exit_code == 2
    document = json.loads(result.stdout)
    of_image, template, blank = document["templates"]
    assert of_image["files"] == [str(out / "1_1.json"), str(out / "1_1.csv")]
    assert of_image["quality"] == assess(image).quality.as_dict()
    assert (template["quality"], template["minutiae"]) == (None, of_image["minutiae"])
    note, failure = result.stderr.splitlines()
    assert note.startswith(f"fpmatch: note: {prints / 'blank.png'}: quality 0; no ridges: ")
    assert failure == f"fpmatch: error: {document['failures'][0]}"
    assert blank["minutiae"] == 0


def test_stages_are_pictures_with_a_sheet_of_them_all(run, prints, tmp_path):
    out = tmp_path / "stages"
    words = ("extract", prints / "1_1.png", "-o", out, "--format", "stages", "--json")
    result = run(*words)
    assert (result.exit_code, result.stderr) == (0, "")
    pictures = sorted((out / "1_1").glob("*.png"))
    assert len(pictures) > 8
    (one,) = json.loads(result.stdout)["templates"]
    assert one["files"] == [str(picture) for picture in pictures]
    assert run(*words[:-1]).stdout == f"1 of 1 image, {one['minutiae']} minutiae: {out}\n"
    save_template(tmp_path / "t.json", extract(prints / "1_1.png"))
    refused = run("extract", tmp_path / "t.json", "-o", out, "--format", "stages")
    assert (refused.exit_code, "a template has no stages" in refused.stderr) == (2, True)


def test_a_disk_that_fills_up_ends_the_work_and_says_what_is_written(run, prints, tiny_disk):
    (tiny_disk / "fill").write_bytes(bytes(48_000))
    names = [prints / name for name in ("1_1.png", "1_2.png", "2_1.png")]
    result = run("extract", *names, "-o", tiny_disk / "t", "--json")
    assert result.exit_code == 2
    document = json.loads(result.stdout)
    written = {file for one in document["templates"] for file in one["files"]}
    assert {str(path) for path in (tiny_disk / "t").iterdir()} >= written
    (failure,) = document["failures"]
    assert failure.endswith(": cannot be written: no space left on device")
    assert result.stderr == f"fpmatch: error: {failure}\n"
    assert not [path for path in tiny_disk.rglob("*") if path.name.startswith(".")]


def test_folders_are_taken_as_enrol_takes_them(run, prints, tmp_path):
    flat, deep = tmp_path / "flat", tmp_path / "deep"
    left = deep / "7" / "left"
    for folder, name in ((flat, "1_1.png"), (left, "1_1.png"), (deep / "8", "2_1.png")):
        folder.mkdir(parents=True)
        shutil.copy(prints / name, folder / "print.png")
        (folder / "notes.txt").write_text("no print")
    (deep / "dataset.toml").write_text("dpi = 569\n")
    out = tmp_path / "out"
    result = run("extract", flat, deep, "-o", out, "--format", "json")
    assert (result.exit_code, result.stdout.split(",")[0]) == (0, "3 of 3 templates")
    written = sorted(path.relative_to(out).as_posix() for path in out.rglob("*.json"))
    assert written == ["7/left/print.json", "8/print.json", "print.json"]
    assert load_template(out / "print.json").dpi == 500
    assert load_template(out / "8" / "print.json").dpi == 569
    again = run("extract", out / "7" / "left", "-o", tmp_path / "again", "--format", "json")
    assert (again.exit_code, names(tmp_path / "again")) == (0, {"print.json"})  # of templates
    lines = run("inspect", deep).stdout.splitlines()
    assert [line.split(":")[0] for line in lines] == [
        str(left / "print.png"),
        str(deep / "8/print.png"),
    ]
    twice = run("extract", flat, deep / "8", "-o", out)
    assert (twice.exit_code, "would both be written as print" in twice.stderr) == (2, True)


@pytest.mark.parametrize("output_format", ["json", "stages"])
@pytest.mark.parametrize("name", ["text.png", "gone.png", "folder.png"])
def test_nothing_is_left_where_nothing_was_written(run, prints, tmp_path, name, output_format):
    words = "extract", prints / name, "-o", tmp_path / "new" / "out", "--format", output_format
    result = run(*words)
    assert (result.exit_code, list(tmp_path.iterdir())) == (2, [])
    assert result.stderr.startswith(f"fpmatch: error: {prints / name}: ")
