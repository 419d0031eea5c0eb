"""`fpmatch extract`: templates and stages, what it writes, and what becomes of bad images."""

import json
import shutil

from PIL import Image

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


def test_what_is_wrong_with_an_image_is_noted(run, prints, tmp_path):
    images = (prints / "blank.png", prints / "1_1.png")
    result = run("extract", *images, "-o", tmp_path, "--format", "json")
    assert names(tmp_path) == {"blank.json", "1_1.json"}
    assert result.exit_code == 0
    (note,) = result.stderr.splitlines()
    assert note.startswith(f"fpmatch: note: {prints / 'blank.png'}: quality 0; no ridges: ")
    assert len(load_template(tmp_path / "blank.json").minutiae) == 0


def test_json_tells_files_and_quality(run, prints, tmp_path):
    out, image = tmp_path / "out", prints / "1_1.png"
    save_template(tmp_path / "t.json", extract(image))
    result = run("extract", image, tmp_path / "t.json", prints / "text.png", "-o", out, "--json")
    assert result.exit_code == 2
    document = json.loads(result.stdout)
    of_image, template = document["templates"]
    assert of_image["files"] == [str(out / "1_1.json"), str(out / "1_1.csv")]
    assert of_image["quality"] == assess(image).quality.as_dict()
    assert template["quality"] is None
    assert template["minutiae"] == of_image["minutiae"] > 0
    (failure,) = document["failures"]
    assert failure.startswith(f"{prints / 'text.png'}: ")


def test_failures_are_listed_at_the_end_and_the_rest_is_kept(run, prints, tmp_path):
    bad = ["text.png", "gone.png", "truncated.png", "tiny.png", "folder.png", "empty.png"]
    images = [prints / name for name in (*bad[:3], "1_1.png", *bad[3:])]
    result = run("extract", *images, "-o", tmp_path)
    assert result.exit_code == 2
    assert names(tmp_path) == {"1_1.json", "1_1.csv"}
    assert result.stdout.startswith("1 of 7 templates, ")
    for line, name in zip(result.stderr.splitlines(), bad, strict=True):
        assert line.startswith(f"fpmatch: error: {prints / name}: ")


def test_the_assumed_resolution_is_said_once_for_many(run, prints, tmp_path):
    shutil.copy(prints / "untagged.tif", tmp_path / "again.tif")
    words = ("extract", prints / "untagged.tif", tmp_path / "again.tif", "-o", tmp_path / "out")
    assert run(*words).stderr.count("500 dpi assumed") == 1
    assert run(*words, "--dpi", 569).stderr == ""
    assert load_template(tmp_path / "out" / "again.json").dpi == 569


def test_a_template_has_no_stages(run, prints, tmp_path):
    run("extract", prints / "1_1.png", "-o", tmp_path)
    words = ("extract", tmp_path / "1_1.json", "-o", tmp_path / "out", "--format", "stages")
    result = run(*words)
    assert (result.exit_code, "a template has no stages" in result.stderr) == (2, True)


def test_stages_are_pictures_with_a_sheet_of_them_all(run, prints, tmp_path):
    out = tmp_path / "stages"
    words = ("extract", prints / "1_1.png", "-o", out, "--format", "stages", "--json")
    result = run(*words)
    assert (result.exit_code, result.stderr) == (0, "")
    pictures = sorted((out / "1_1").glob("*.png"))
    (one,) = json.loads(result.stdout)["templates"]
    assert one["files"] == [str(picture) for picture in pictures]
    assert len(pictures) > 8
    assert run(*words[:-1]).stdout == f"1 of 1 image, {one['minutiae']} minutiae: {out}\n"
    for picture in pictures:
        with Image.open(picture) as opened:
            assert opened.width >= 280


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
