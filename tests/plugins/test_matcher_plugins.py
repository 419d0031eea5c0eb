"""Matchers of other packages: found, used by every command, named where they fail."""

import re
import shutil
from pathlib import Path

import pytest
from plugin_packages import ROOT, fpmatch, install, install_points, shown_commands, shown_package

from fpmatch import Minutiae, Template, enrol, extract, save_template
from fpmatch.base.plugins import MATCHERS, forget_plugins, load_plugins
from fpmatch.errors import MatcherError
from fpmatch.matching.calibration import Calibration
from fpmatch.matching.registry import get_matcher, matcher_names

GUIDE = "add_a_matcher.md"
SAMPLES = ROOT / "sample_data"
BROKEN = {
    "absent": ("no_such_module:MATCHER", "No module named 'no_such_module' (install its package"),
    "leaving": ("leaving:MATCHER", "SystemExit: 3"),
    "module": ("counted:", "is no package.module:OBJECT"),
    "needy": ("needy:MATCHER", "No module named 'no_such_module'"),
    "faulty": ("faulty:MATCHER", "RuntimeError: two lines"),
    "nothing": ("counted:nothing", "has no attribute 'nothing'"),
    "shapeless": ("counted:nothing_found", "is no subclass of fpmatch.matching.result.Matcher"),
    "other": ("counted:Counted", "is named 'counted', its entry point 'other'"),
}


@pytest.fixture
def counted(tmp_path, site):
    package = shown_package(GUIDE, tmp_path / "fpmatch-counted")
    install(package, site)
    forget_plugins()
    return package


@pytest.fixture
def broken(site, counted):
    """Install one with matchers that cannot be loaded, and one with a name of fpmatch's own."""
    (site / "faulty.py").write_text("raise RuntimeError('two\\nlines')\n")
    (site / "leaving.py").write_text("raise SystemExit(3)\n")
    (site / "needy.py").write_text("import no_such_module\n")
    points = {name: place.removesuffix(":") for name, (place, _) in BROKEN.items()}
    install_points(site, "broken", {MATCHERS: points | {"unit-circle": "counted:Counted"}})
    forget_plugins()


@pytest.fixture(scope="module")
def few_prints(tmp_path_factory):
    """Return a folder with two impressions of each of two fingers."""
    folder = tmp_path_factory.mktemp("few") / "prints"
    folder.mkdir()
    for name in ("101_1", "101_3", "102_1", "102_2"):
        shutil.copy(SAMPLES / f"{name}.tif", folder)
    return folder


@pytest.mark.slow
def test_the_commands_of_the_guide_work_in_several_processes(site, counted, few_prints):
    commands = shown_commands(GUIDE)
    assert [words[-1] for words in commands] == ["counted", "paper"]
    for command in commands:
        command[command.index("sample_data")] = few_prints
        words = [*command, "--bootstrap", 0, "--workers", 2]
        done = fpmatch(*words, cwd=counted.parent, path=site)
        assert done.returncode == 0, done.stderr


def test_nothing_is_imported_from_the_working_directory(counted, few_prints):
    done = fpmatch("evaluate", few_prints, "--matcher", "counted:Counted", cwd=counted)
    assert (done.returncode, done.stdout, done.stderr.count("fpmatch: error: ")) == (2, "", 1)
    assert "nothing is imported from the working directory" in done.stderr


def test_one_that_no_process_can_be_sent_is_refused(run, site, counted, few_prints):
    (site / "unsent.py").write_text(
        "from counted import Counted\nMATCHER = Counted()\nMATCHER.rule = lambda: None\n"
    )
    words = ("evaluate", few_prints, "--matcher", "unsent:MATCHER", "--bootstrap", 0)
    refused = run(*words, "--workers", 2)
    assert refused.exit_code == 2
    assert refused.stderr.startswith("fpmatch: error: cannot be sent to other processes: ")
    assert run(*words, "--workers", 1).exit_code == 0


@pytest.mark.usefixtures("broken")
@pytest.mark.parametrize("name", BROKEN)
def test_a_matcher_that_cannot_be_loaded_is_one_line_with_the_reason(name):
    place, reason = BROKEN[name]
    with pytest.raises(MatcherError) as caught:
        get_matcher(name)
    assert f"matcher {name}: {place}" in str(caught.value)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)
    assert ("PYTHONPATH" in str(caught.value)) == (name == "absent")
    assert caught.value.code == "plug-in"


@pytest.mark.usefixtures("broken")
def test_the_others_work_beside_it(run, few_prints):
    assert set(load_plugins(MATCHERS)[1]) >= set(BROKEN)
    assert get_matcher("unit-circle").name == "unit-circle"
    both = ("--matcher", "counted", "--matcher", "paper")
    result = run("evaluate", few_prints, *both, "--bootstrap", 0, "--workers", 1)
    assert (result.exit_code, result.stderr) == (0, "")
    assert all(name in result.stdout for name in ("counted", "paper"))
    found = run("doctor")
    assert found.exit_code == 1
    assert "counted (fpmatch-counted 1.0, counted:Counted)" in found.stdout
    lines = found.stderr.splitlines()
    assert len(lines) == len(BROKEN) + 1
    assert any("unit-circle: the name is one of fpmatch's own" in line for line in lines)


WRONG = """
from fpmatch.matching.result import Matcher, nothing_found

class Base(Matcher):
    answer = 1.0
    def __init__(self):
        self.name = type(self).__name__.lower()
    def prepare(self, template):
        return template
    def compare(self, probe, reference):
        return nothing_found("", self.answer)

class Raises(Base):
    def compare(self, probe, reference):
        raise ValueError("two\\nlines")

class Unprepared(Base):
    def prepare(self, template):
        raise KeyError("fault")

class Three(Base):
    def compare(self, probe, reference):
        return 3

class NaN(Base):
    answer = float("nan")

class Negative(Base):
    answer = -1.0

class Explains(Base):
    def explain(self, probe, reference, comparison):
        raise RuntimeError("no reason")
"""
SAYS = {
    "Raises": "matcher raises: compare: ValueError: two\\nlines (line ",
    "Unprepared": "matcher unprepared: prepare: KeyError: 'fault' (line ",
    "Three": "matcher three: compare returned int, not Comparison",
    "NaN": "matcher nan: compare returned a similarity of nan, where it is 0 or more",
    "Negative": "matcher negative: compare returned a similarity of -1.0, where it is 0 or more",
    "Explains": "matcher explains: explain: RuntimeError: no reason (line ",
}
COMMANDS = {
    "verify": "verify {a} {b} --calibration {curve}",
    "claim": "verify --gallery {gallery} --subject 101 {a} --calibration {curve}",
    "identify": "identify {gallery} {a} --calibration {curve}",
    "identify -o": "identify {gallery} --probes {prints} -o out.csv --calibration {curve} "
    "--workers 1",
    "score": "score --references {prints} --probes {prints} -o out.csv --workers 1",
    "evaluate": "evaluate {prints} --workers 1",
    "calibrate": "calibrate {prints} -o out.json --workers 1",
}
NAMED = re.compile(r"\S*10\d_\d\.json and (\S*10\d_\d\.json|entry \d|subject 101)|entry \d")


@pytest.fixture(scope="module")
def places(few_prints, tmp_path_factory):
    """Return what the commands above are given: templates, their gallery, a calibration."""
    folder = tmp_path_factory.mktemp("places")
    prints, gallery, curve = folder / "prints", folder / "g.db", folder / "curve.json"
    prints.mkdir()
    for path in few_prints.iterdir():
        save_template(prints / f"{path.stem}.json", extract(path))
    enrol(gallery, [prints])
    curve.write_text(Calibration(((0.0, 0.0), (10.0, 20.0)), tail_scale=1.0).as_json())
    sides = {"a": prints / "101_1.json", "b": prints / "102_1.json"}
    return {"prints": prints, "gallery": gallery, "curve": curve} | sides


@pytest.fixture
def wrong(site, places):
    """Install matchers that answer wrongly."""
    (site / "wrong.py").write_text(WRONG)
    return places


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("kind", SAYS)
def test_a_wrong_answer_is_one_line_that_names_matcher_and_pair(run, wrong, kind, command):
    if kind == "Explains" and command not in {"verify", "claim"}:
        return  # others explain no decision
    result = run(*COMMANDS[command].format(**wrong).split(), "--matcher", f"wrong:{kind}")
    assert (result.exit_code, result.stdout) == (2, "")
    line = result.stderr.splitlines()[-1]
    assert "Traceback" not in result.stderr
    assert SAYS[kind] in line
    pair = line.removeprefix("fpmatch: error: ").partition(": matcher ")[0]
    assert NAMED.fullmatch(pair), line
    assert not Path("out.csv").exists()


def test_it_is_found_by_its_name_and_by_its_place(run, site, counted, few_prints):
    assert {"counted", "paper", "unit-circle"} <= set(matcher_names())
    assert get_matcher("counted") is get_matcher("counted") is get_matcher("counted:Counted")
    p, q = (Template(Minutiae([1, 2, 3][:n], [1] * n, [0] * n), 9, 9) for n in (2, 3))
    matcher = get_matcher("counted")
    assert matcher.compare(matcher.prepare(p), matcher.prepare(q)).similarity == 2 / 3
    words = "verify", few_prints / "101_1.tif", few_prints / "101_3.tif", "--matcher", "counted"
    refused = run(*words)
    assert refused.exit_code == 2
    assert "matcher 'counted' has no calibration" in refused.stderr
    Path("curve.json").write_text(Calibration(((0.0, 0.0), (0.5, 60.0)), 1.0).as_json())
    verified = run(*words, "--calibration", "curve.json")
    assert verified.exit_code == 1, verified.stderr
    install_points(site, "again", {MATCHERS: {"counted": "counted:Counted"}})
    forget_plugins()
    with pytest.raises(MatcherError, match=r"several packages .*: again, fpmatch-counted"):
        get_matcher("counted")
