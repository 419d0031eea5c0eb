"""The documentation: nothing is missing from its reference, and its links lead somewhere."""

import builtins
import dis
import doctest
import importlib.util
import inspect
import pkgutil
import re
from pathlib import Path
from types import CodeType

import click
import numpy as np
import pytest

import fpmatch
from fpmatch import errors
from fpmatch.cli.group import fpmatch as main
from fpmatch.lab.points.results import read_results
from fpmatch.matching.registry import matcher_names
from research.experiments.point_targets import missed_targets

ROOT = Path(__file__).resolve().parent.parent
pytestmark = pytest.mark.docs
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
GENERATED = DOCS / "generated"
LINK = re.compile(r"\]\(([^)\s]+)\)|^```\{(?:figure|literalinclude)\} (\S+)$", re.MULTILINE)
BLOCKS_WITH_LINKS = ("```{figure}", "```{literalinclude}")

pages = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(DOCS).as_posix())


def words_of(page):
    """Return a page without its blocks of code."""
    kept = []
    fenced = shown = False
    for line in page.read_text(encoding="utf-8").splitlines():
        if line.startswith("```"):
            fenced = not fenced
            shown = fenced and line.startswith(BLOCKS_WITH_LINKS)
        if shown or not fenced:
            kept.append(line)
    return "\n".join(kept)


def links_of(page):
    """Return path and anchor of each link of a page to a place in the repository."""
    targets = [text or block for text, block in LINK.findall(words_of(page))]
    return [target.partition("#")[::2] for target in targets if "://" not in target]


def anchors_of(page):
    """Return the anchors of a page's headings, as GitHub and the site both make them."""
    headings = re.findall(r"^#+ (.+)$", words_of(page), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def commands_of(command, name):
    """Yield a command and those below it, each with its full name."""
    yield name, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for part in command.list_commands(context):
            yield from commands_of(command.get_command(context, part), f"{name} {part}")


@pages
def test_local_links_lead_to_files_and_to_headings_in_them(page):
    for path, anchor in links_of(page):
        target = (page.parent / path).resolve() if path else page
        if GENERATED in target.parents:
            continue  # the next tests look after these
        assert target.exists(), path
        assert ROOT in target.parents, path
        assert not anchor or anchor in anchors_of(target), f"{path}#{anchor}"


def test_every_stage_of_an_extraction_is_shown(fingers):
    recorder = fpmatch.StageRecorder()
    fpmatch.extract(fingers[0], dpi=500, recorder=recorder)
    shown = [Path(path).name for path, _ in links_of(DOCS / "explanation" / "how_it_works.md")]
    drawn = [name for name in shown if re.match(r"\d\d_", name)]
    assert drawn == [f"{n:02}_{name}.png" for n, name in enumerate(recorder.stages, start=1)]


def test_every_step_of_the_case_study_is_shown():
    pytest.importorskip("matplotlib")
    from research.case_study.command import case_study

    figures = case_study(ROOT / "sample_data", ("103_1", "103_2"))
    shown = [Path(path).name for path, _ in links_of(DOCS / "tutorial" / "case_study.md")]
    assert [name for name in shown if name.endswith(".png")] == [f.file_name for f in figures]


def test_every_page_has_its_place_in_the_contents():
    listed = re.findall(r"^[\w*/-]+$", (DOCS / "index.md").read_text("utf-8"), re.MULTILINE)
    found = {page for pattern in listed for page in DOCS.glob(f"{pattern}.md")}
    assert found >= set(PAGES) - {DOCS / "index.md"}


def paths_to_code():
    """Return the steps of each path of the page "Where is what"."""
    page = (DOCS / "reference" / "where_is_what.md").read_text(encoding="utf-8")
    return [re.findall(r"`([^`]+)`", row.split("|")[2]) for row in page.splitlines() if "`" in row]


def test_the_readme_leads_to_the_contents_and_to_the_paths_to_code():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "](docs/index.md)" in readme
    assert "](docs/reference/where_is_what.md)" in readme


@pytest.mark.parametrize("steps", paths_to_code(), ids=" ".join)
def test_each_step_of_a_path_to_code_names_the_next(steps):
    files = [step for step in steps if "/" in step or step.endswith(".md")]
    texts = [(ROOT / file).read_text(encoding="utf-8") for file in files]
    for text, file, after in zip(texts, files, files[1:], strict=False):
        module = after.removesuffix(".py").replace("/", ".")
        named = (after, module, f'"{Path(after).stem}"')
        assert any(name in text for name in named), f"{file} does not name {after}"
    for symbol in steps[len(files) :]:
        assert re.search(rf"^\s*(def |class )?{symbol}\b", texts[-1], re.MULTILINE), symbol


@pytest.mark.parametrize("page", [*PAGES, *sorted(ROOT.glob("[CR]*.md"))], ids=lambda p: p.name)
def test_files_and_modules_that_a_page_names_exist(page):
    if page.name == "CHANGELOG.md":
        pytest.skip("a record of names, old ones too")
    text = page.read_text(encoding="utf-8")
    for name in re.findall(
        r"`((?:fpmatch|scripts|benchmarks|tests|docs|research)/[\w/.-]+)`", text
    ):
        assert (ROOT / name).exists(), name
    for name in re.findall(r"`((?:fpmatch|research)(?:\.\w+)+)`", text):
        assert pkgutil.resolve_name(name) is not None


def test_every_public_name_is_in_the_reference():
    text = (DOCS / "reference" / "api.md").read_text(encoding="utf-8")
    documented = re.findall(r"^\.\. (?:auto\w+|py:data):: fpmatch\.(\w+)$", text, re.MULTILINE)
    assert sorted(set(documented) - {"errors"}) == sorted(fpmatch.__all__)


def test_the_reference_of_commands_is_made_of_all_of_them():
    text = (DOCS / "reference" / "commands.md").read_text(encoding="utf-8")
    assert ".. click:: fpmatch.cli.group:fpmatch\n   :prog: fpmatch\n   :nested: full\n" in text
    for name, command in commands_of(main, "fpmatch"):
        assert command.help, name
        assert not command.hidden, name


def test_the_matcher_in_one_file_has_the_shape_of_ours(monkeypatch, template):
    from fpmatch.matching import matchers, registry

    folder = str(DOCS / "how-to" / "one_file")
    monkeypatch.setattr(matchers, "__path__", [*matchers.__path__, folder])
    assert "hough" in matcher_names()
    hough = registry.get_matcher("hough")
    other = fpmatch.Template(template.minutiae.take(range(5, 30)), 388, 374, dpi=569)
    none = fpmatch.Template(fpmatch.Minutiae.empty(), 9, 9)
    p, q, none = map(hough.prepare, (template, other, none))
    there, back = hough.compare(p, q), hough.compare(q, p)
    assert there.similarity == back.similarity
    assert len(there.pairs) >= 10
    assert sorted(there.pairs.tolist()) == sorted(back.pairs[:, ::-1].tolist())
    assert np.allclose(there.transform.inverse().matrix, back.transform.matrix)
    assert hough.compare(p, none).reason
    assert hough.compare(none, none).similarity == 0


def module_of(path):
    """Return a Python file of the documentation as a module."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_format_in_one_file_reads_what_it_writes(template):
    from fpmatch.formats.record import ReadingOptions, TemplateRecord, View

    codec = module_of(DOCS / "how-to" / "one_file" / "tab_format.py").CODEC
    data = codec.encode(TemplateRecord("", (View(template),))).data
    assert codec.recognises(data)
    assert codec.decode(data, ReadingOptions()).single().template.minutiae == template.minutiae
    head = b"#tab\t9\t9\t"
    for broken in (b"", b"#tab\t1\n", head + b"x\n", head + b"500\n1\t2\t3\t4\n", b"\xff"):
        with pytest.raises(fpmatch.FpmatchError):
            codec.decode(broken, ReadingOptions())


def unbound(program):
    """Return the names that a program uses and neither imports nor defines."""
    used, bound, codes = set(), set(dir(builtins)), [compile(program, "examples", "exec")]
    for code in codes:
        codes += [one for one in code.co_consts if isinstance(one, CodeType)]
        for step in dis.get_instructions(code):
            used |= {step.argval} if step.opname in {"LOAD_NAME", "LOAD_GLOBAL"} else set()
            bound |= {step.argval} if step.opname in {"STORE_NAME", "STORE_GLOBAL"} else set()
    return used - bound


@pages
def test_the_examples_of_a_page_import_what_they_use(page):
    text = page.read_text(encoding="utf-8")
    blocks = re.findall(r"^```\{(\w+)\}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    programs = [block for kind, block in blocks if kind in {"testcode", "testcleanup"}]
    for kind, block in blocks:
        if kind == "doctest":
            programs += [one.source for one in doctest.DocTestParser().get_examples(block)]
    assert unbound("\n".join(programs)) == set()


def shown_by_the_reference():
    """Return functions and classes that the reference shows, by name; of `errors` the classes."""
    text = (DOCS / "reference" / "api.md").read_text(encoding="utf-8")
    names = re.findall(r"^\.\. auto(?!module)\w+:: (fpmatch\.\S+)$", text, re.MULTILINE)
    names += [f"fpmatch.errors.{name}" for name, _ in inspect.getmembers(errors, inspect.isclass)]
    return {name: pkgutil.resolve_name(name) for name in names}


@pytest.mark.parametrize(("name", "shown"), shown_by_the_reference().items())
def test_the_examples_of_the_reference_import_what_they_use(name, shown):
    for one in doctest.DocTestFinder().find(shown, name, module=False, globs={}):
        assert unbound("".join(example.source for example in one.examples)) == set(), one.name


def test_the_site_gives_its_examples_no_names():
    pytest.importorskip("sphinx", reason="the extra docs is not installed")
    setup = compile(module_of(DOCS / "conf.py").doctest_global_setup, "setup", "exec")
    stored = [step for step in dis.get_instructions(setup) if step.opname == "STORE_NAME"]
    assert {step.argval for step in stored if not step.argval.startswith("_")} == set()


def test_the_site_and_its_examples_are_checked_before_a_change_is_taken():
    assert "scripts/docs" in (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()


def test_readers_see_square_millimetres_as_a_square():
    """Names of fields and columns keep `_mm2`."""
    written = [*PAGES, ROOT / "README.md"]
    written += [path for kind in ("py", "j2", "js") for path in ROOT.glob(f"fpmatch/**/*.{kind}")]
    assert len(written) > 100
    assert [path for path in written if re.search(r"\bmm2\b", path.read_text("utf-8"))] == []


@pytest.mark.skipif(
    importlib.util.find_spec("sphinx") is None, reason="the extra docs is not installed"
)
@pytest.mark.parametrize(
    ("html", "loaded"),
    [
        ('<a href="https://example.org">x</a>', False),
        ('<link rel="canonical" href="https://example.org">', False),
        ('<img src="_static/x.png"><link rel="stylesheet" href="x.css">', False),
        ('<script async src="https://example.org/x.js"></script>', True),
        ('<link rel="stylesheet" href="//example.org/x.css">', True),
        ("@import 'https://example.org/x.css'", True),
    ],
)
def test_what_a_page_loads_from_another_host_is_found(html, loaded):
    assert (module_of(DOCS / "conf.py").LOADED.search(html) is not None) == loaded


def test_the_kept_results_miss_no_target():
    assert missed_targets(read_results(DOCS / "data" / "pointsets_bench.json")) == []
