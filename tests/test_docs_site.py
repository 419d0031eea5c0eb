"""The documentation: nothing is missing from its reference, and its links lead somewhere."""

import dis
import importlib.util
import pkgutil
import re
from pathlib import Path

import numpy as np
import pytest

import fpmatch
from fpmatch.cli.group import summaries
from fpmatch.matching.registry import matcher_names

ROOT = Path(__file__).resolve().parent.parent
pytestmark = pytest.mark.docs
DOCS = ROOT / "docs"
GENERATED = DOCS / "generated"
LINK = re.compile(
    r"\]\(([^)\s]+)\)|src=\"([^\"]+)\"|^```\{(?:figure|literalinclude)\} (\S+)$", re.MULTILINE
)
BLOCK = re.compile(r"^```(\{(?:figure|literalinclude)\} \S+$)?.*?^```$", re.MULTILINE | re.DOTALL)
every_page = pytest.mark.parametrize(
    "page", [*sorted(DOCS.rglob("*.md")), *ROOT.glob("[CR]*.md")], ids=lambda page: page.name
)


def text_of(page):
    """Return a page without what its blocks of code contain."""
    return BLOCK.sub(r"```\1", page.read_text(encoding="utf-8"))


def links_of(page):
    """Return path and anchor of each link of a page to a place in the repository."""
    links = map("".join, LINK.findall(text_of(page)))
    return [link.partition("#")[::2] for link in links if "://" not in link]


def anchors_of(page):
    """Return the anchors of a page's headings, as GitHub and the site both make them."""
    headings = re.findall(r"^#+ (.+)$", text_of(page), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@every_page
def test_local_links_lead_to_files_and_to_headings_in_them(page):
    for path, anchor in links_of(page):
        target = (page.parent / path).resolve() if path else page
        if GENERATED in target.parents:
            continue  # `scripts/docs` makes these, and warns of those that are missing
        assert target.exists(), path
        assert ROOT in target.parents, path
        assert not anchor or target.is_dir() or anchor in anchors_of(target), f"{path}#{anchor}"


def test_every_stage_of_an_extraction_is_shown(fingers):
    recorder = fpmatch.StageRecorder()
    fpmatch.extract(fingers[0], dpi=500, recorder=recorder)
    shown = [Path(path).name for path, _ in links_of(DOCS / "explanation" / "how_it_works.md")]
    drawn = [name for name in shown if re.match(r"\d\d_", name)]
    assert drawn == [f"{n:02}_{name}.png" for n, name in enumerate(recorder.stages, start=1)]


@every_page
def test_a_path_to_code_ends_at_a_file_with_the_name(page):
    paths = re.findall(r"`([\w/]+\.py)`\s\(`(\w+)`\)", page.read_text(encoding="utf-8"))
    assert paths or page.stem not in {"where_is_what", "newcomer_tasks"}
    for file, name in paths:
        text = (ROOT / file).read_text(encoding="utf-8")
        assert re.search(rf"^\s*(def |class )?{name}\b", text, re.MULTILINE), (file, name)


@every_page
def test_files_and_modules_that_a_page_names_exist(page):
    if page.name == "CHANGELOG.md":
        pytest.skip("a record of names, old ones too")
    text = page.read_text(encoding="utf-8")
    for name in re.findall(r"`((?:fpmatch|scripts|tests|docs|research)/[\w/.-]+)`", text):
        assert (ROOT / name).exists(), name
    for name in re.findall(r"`((?:fpmatch|research)(?:\.\w+)+)`", text):
        assert pkgutil.resolve_name(name) is not None


def test_every_public_name_is_in_the_reference():
    text = (DOCS / "reference" / "api.md").read_text(encoding="utf-8")
    documented = re.findall(r"^(?:   |\.\. py:data:: )fpmatch\.(\w+)$", text, re.MULTILINE)
    assert sorted(set(documented) - {"errors"}) == sorted(fpmatch.__all__)


def test_each_command_has_a_page_and_each_name_of_the_reference_a_place(tmp_path, monkeypatch):
    pages = module_of(DOCS / "reference_pages.py")
    monkeypatch.setattr(pages, "GENERATED", tmp_path)
    pages.write_command_pages()
    pages.write_python_pages()
    assert {page.stem for page in tmp_path.glob("commands/*.rst")} == set(summaries())
    text = (DOCS / "reference" / "api.md").read_text(encoding="utf-8")
    names = re.findall(r"^   (fpmatch\.[\w.]+)$", text, re.MULTILINE)
    written = [page.read_text(encoding="utf-8") for page in tmp_path.glob("python/*.rst")]
    described = re.findall(r"^\.\. auto\w+:: (\S+)$", "".join(written), re.MULTILINE)
    assert sorted(described) == sorted(names)


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


def test_the_site_gives_its_examples_no_names():
    pytest.importorskip("sphinx", reason="the extra docs is not installed")
    setup = compile(module_of(DOCS / "conf.py").doctest_global_setup, "setup", "exec")
    stored = [step for step in dis.get_instructions(setup) if step.opname == "STORE_NAME"]
    assert {step.argval for step in stored if not step.argval.startswith("_")} == set()


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
