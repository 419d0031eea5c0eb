"""Template formats of other packages: read and written wherever ours are."""

import numpy as np
import pytest
from plugin_packages import ROOT, fpmatch, install, install_points, shown_commands, shown_package

from fpmatch import load_template, save_template
from fpmatch.base.plugins import FORMATS, forget_plugins
from fpmatch.errors import TemplateError
from fpmatch.formats.registry import CODECS, codec_of_name, known_codecs
from fpmatch.gallery.listing.prints import find_prints
from fpmatch.prints.reading import content_of

GUIDE = "add_a_format.md"
PRINTS = [ROOT / "sample_data" / f"101_{n}.tif" for n in (1, 3)]
CARELESS = """
from fpmatch.formats.record import Codec

def fail(*given):
    raise KeyError("fault")

same = lambda *given: 3
CODEC = Codec("careless", "Careless", (".careless",), fail, fail, fail)
IDLE = Codec("idle", "Idle", (".idle",), lambda head: head == b"idle", same, same)
"""


@pytest.fixture
def deg(tmp_path, site):
    install(shown_package(GUIDE, tmp_path / "fpmatch-deg"), site)
    forget_plugins()


@pytest.fixture
def broken(site, deg):
    """Install formats that cannot be loaded or that raise errors, and one of a known name."""
    (site / "careless.py").write_text(CARELESS)
    points = {
        "absent": "no_such_module:CODEC",
        "careless": "careless:CODEC",
        "idle": "careless:IDLE",
        "json": "careless:CODEC",
    }
    install_points(site, "broken", {FORMATS: points})
    forget_plugins()


@pytest.mark.usefixtures("deg")
def test_a_template_is_written_and_read(template, tmp_path):
    names = [codec.name for codec in known_codecs()]
    assert sorted(names) == sorted([*(one.name for one in CODECS), "deg"])
    assert names.index("deg") < names.index("minutiae-csv")  # which any table of numbers could be
    path = tmp_path / "print.deg"
    assert save_template(path, template) == ("kind, quality and the ridge field dropped",)
    read = load_template(path)
    assert np.allclose(read.minutiae.xy, template.minutiae.xy)
    assert np.allclose(read.minutiae.angle, template.minutiae.angle)
    assert find_prints([tmp_path])[0].path == path


@pytest.mark.usefixtures("deg")
@pytest.mark.parametrize(
    "text", ["#deg 1", "#deg a b c", "#deg 9 9 500\n1 2", "#deg 9 9 500\n1 2 x"]
)
def test_an_error_of_its_own_is_one_of_the_file(run, tmp_path, text):
    path = tmp_path / "bad.deg"
    path.write_text(text)
    with pytest.raises(TemplateError, match="format deg: ValueError"):
        load_template(path)
    result = run("verify", path, path)
    assert result.exit_code == 2
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"fpmatch: error: {path}: format deg: ")


def test_every_command_takes_it(site, deg, run, tmp_path):
    commands = shown_commands(GUIDE)
    assert [words[0] for words in commands] == ["convert", "verify"]
    for words in commands:
        result = run(*(ROOT / word if word.startswith("sample_data") else word for word in words))
        assert result.exit_code == 0, result.stderr
    assert run("extract", *PRINTS, "-o", "templates", "--format", "deg").exit_code == 0
    assert "Minutiae in degrees" in run("inspect", "templates/101_1.deg").stdout
    assert run("convert", "templates/101_1.deg", "a.json", "--from", "deg").exit_code == 0
    assert run("enrol", "prints.db", "templates").exit_code == 0
    assert run("extract", "--gallery", "prints.db", "-o", "out", "--format", "deg").exit_code == 0
    words = ("--references", "out", "--probes", "templates", "-o", "s.csv", "--workers", 2)
    done = fpmatch("score", *words, cwd=tmp_path / "work", path=site)
    assert done.returncode == 0, done.stderr
    assert len((tmp_path / "work/s.csv").read_text().splitlines()) == 1 + 4
    assert "|deg]" in "".join(run("extract", "--help-all").stdout.split())
    wrong = run("convert", PRINTS[0], "a.json", "--format", "degrees")
    assert wrong.exit_code == 2
    assert "'deg'" in wrong.stderr


@pytest.mark.usefixtures("broken")
@pytest.mark.filterwarnings("ignore:format careless")
def test_a_format_at_fault_is_named_and_the_others_work(template, tmp_path, run):
    save_template(tmp_path / "a.deg", template)
    with pytest.warns(UserWarning, match="format careless: recognises: KeyError"):
        assert content_of(tmp_path / "a.deg") == "template"
    assert codec_of_name("json").title == "fpmatch JSON 2"
    unknown, idle = tmp_path / "a.unknown", tmp_path / "b.idle"
    unknown.write_text("neither")
    idle.write_bytes(b"idle")
    absent = "no_such_module:CODEC cannot be loaded"
    faults = {
        f"known format; {absent}": lambda: load_template(unknown),
        f"format absent: {absent}": lambda: save_template(unknown, template, file_format="absent"),
        "format careless: KeyError: 'fault'": lambda: save_template(
            tmp_path / "a.careless", template
        ),
        "idle: TypeError: returned int, not Encoded": lambda: save_template(
            tmp_path / "a.idle", template
        ),
        "idle: TypeError: returned int, not TemplateRecord": lambda: load_template(idle),
    }
    for reason, call in faults.items():
        with pytest.raises(TemplateError) as caught:
            call()
        assert reason in str(caught.value)
    refused = run("verify", unknown, unknown)
    assert refused.exit_code == 2
    assert f"not an image of a known format; {absent}" in refused.stderr
    assert {path.name for path in tmp_path.iterdir()}.isdisjoint({"a.careless", "a.idle"})
