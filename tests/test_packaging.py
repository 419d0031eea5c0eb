"""Files that build and ship the package agree with it; `packaging/check_dist` builds it."""

import json
import re
import runpy
import shlex
import tomllib
from itertools import chain
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from fpmatch._version import __version__
from fpmatch.cli.doctor import CORE, EXTRAS
from fpmatch.server.cli.serve import serve

ROOT = Path(__file__).resolve().parents[1]
yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")


def read_yaml(name):
    return yaml.safe_load((ROOT / name).read_text("utf-8"))


@pytest.fixture(scope="module")
def project():
    return tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))


def names(requirements):
    """Return the names of requirements, without extras and versions."""
    return {re.split(r"[\[<>=~ ;]", each)[0].lower() for each in requirements}


def requirements(project):
    extras = project["project"]["optional-dependencies"]
    return [*map(Requirement, chain(project["project"]["dependencies"], *extras.values()))]


def test_the_version_is_the_same_everywhere():
    assert read_yaml("CITATION.cff")["version"] == __version__
    assert read_yaml("packaging/conda/recipe.yaml")["context"]["version"] == __version__


def test_the_same_pythons_are_built_tested_and_named(project):
    classifiers = "\n".join(project["project"]["classifiers"])
    versions = re.findall(r":: (3\.\d+)$", classifiers, re.M)
    assert versions[0] == project["project"]["requires-python"].removeprefix(">=")
    built = project["tool"]["cibuildwheel"]["build"]
    assert built == [f"cp{version.replace('.', '')}-*" for version in versions]
    jobs = read_yaml(".github/workflows/tests.yml")["jobs"]
    assert jobs["linux"]["strategy"]["matrix"]["python"] == versions
    assert {*jobs["others"]["strategy"]["matrix"]["python"]} == {versions[0], versions[-1]}


def test_the_packages_that_doctor_lists_are_those_of_the_project(project):
    extras = project["project"]["optional-dependencies"]
    assert {name.lower() for name in CORE} == names(project["project"]["dependencies"])
    assert set(extras) - set(EXTRAS) == {"bench", "browser", "dev", "docs", "test", "train"}
    for extra, packages in EXTRAS.items():
        assert set(packages) == names(extras[extra])


def test_the_recipe_needs_what_the_package_needs(project):
    recipe = read_yaml("packaging/conda/recipe.yaml")["requirements"]
    needed = names(project["project"]["dependencies"]) - {"opencv-python-headless"}
    assert names(recipe["run"]) == needed | {"python", "py-opencv"}


def test_the_lock_file_has_every_dependency_with_hashes(project):
    text = (ROOT / "packaging/requirements.lock").read_text("utf-8")
    locked = dict(re.findall(r"^([a-z0-9_.-]+)(?:\[\w+\])?==(.*(?:\n    --hash.*)+)", text, re.M))
    extras = project["project"]["optional-dependencies"]
    needed = names([*project["project"]["dependencies"], *extras["web"], *extras["postgres"]])
    needed |= names(project["build-system"]["requires"])
    assert needed <= {name.lower() for name in locked}
    assert "http" not in text


LOCKED = ("packaging/requirements.lock", "packaging/constraints.txt")


@pytest.mark.parametrize("name", LOCKED)
def test_locked_versions_satisfy_all_floors(project, name):
    text = (ROOT / name).read_text("utf-8")
    locked = re.findall(r"^([a-z0-9_.-]+)==([^\s;]+)", text, re.M)
    assert locked
    for requirement in requirements(project):
        versions = [version for package, version in locked if package == requirement.name.lower()]
        assert all(version in requirement.specifier for version in versions), requirement


def test_the_constraints_have_all_that_ci_installs(project):
    text = (ROOT / LOCKED[1]).read_text("utf-8")
    assert not re.search(r"^[^\s=]*\[|--hash|://", text, re.M)  # which pip refuses in constraints
    extras = project["project"]["optional-dependencies"]
    used = [text for name in ("dev", *EXTRAS, "browser", "docs", "test") for text in extras[name]]
    needed = names([*project["project"]["dependencies"], *used]) - {"fpmatch"}
    assert needed <= set(re.findall(r"^([a-z0-9_.-]+)==", text, re.M))


def test_no_version_with_a_known_advisory_is_permitted(project):
    """The last version with an advisory, of the packages that read what strangers send."""
    affected = {"starlette": "1.3.0", "python-multipart": "0.0.29", "h11": "0.14.0"}
    affected |= {"pillow": "12.3.0", "opencv-python-headless": "4.11.0.86", "jinja2": "3.1.5"}
    found = [one for one in requirements(project) if one.name in affected]
    assert affected.keys() == {one.name for one in found}
    assert not [one for one in found if affected[one.name] in one.specifier]


def steps(name):
    """Return what follows a word of Dockerfile, such as RUN."""
    text = (ROOT / "Dockerfile").read_text("utf-8").replace("\\\n", "")
    return re.findall(rf"^{name} (.+)$", text, re.M)


def test_the_image_contains_the_package_and_runs_without_privileges():
    assert steps("USER")[-1] != "root"
    kept = set(re.findall(r"^!(.+)$", (ROOT / ".dockerignore").read_text("utf-8"), re.M))
    assert all((ROOT / name).exists() for name in kept)
    assert kept >= {"fpmatch", "pyproject.toml", "setup.py", "README.md", "LICENSE"}


def test_the_image_is_built_from_what_is_pinned():
    images = steps("FROM") + re.findall(r"image: (\S+:\S+)", (ROOT / "compose.yaml").read_text())
    assert all(re.search(r":\d\S*@sha256:[0-9a-f]{64}( |$)", image) for image in images)
    assert len({image.split()[0] for image in steps("FROM")}) == 1
    of_the_lock, of_the_package = (step for step in steps("RUN") if "pip install" in step)
    assert {"--require-hashes", "--only-binary"} <= {*of_the_lock.split()}
    assert {"--no-index", "--no-deps", "--no-build-isolation"} <= {*of_the_package.split()}


def test_the_image_serves_with_a_log_an_audit_log_and_a_health_check():
    pytest.importorskip("fastapi", reason="the extra web is not installed")
    from fpmatch.server.exchange import is_public
    from fpmatch.server.routes import operations_router

    program, command, *options = json.loads(steps("ENTRYPOINT")[-1])
    assert (program, command) == ("fpmatch", serve.name)
    options += read_yaml("compose.yaml")["services"]["server"]["command"]
    given = serve.make_context(command, options).params
    assert given["log"] == "json"
    assert given["audit_log"]
    (path,) = re.findall(rf":{given['port']}(/\w+)'", steps("HEALTHCHECK")[-1])
    assert path == "/ready"
    assert path in {getattr(route, "path", None) for route in operations_router.routes}
    assert is_public({"type": "http", "method": "GET", "path": path})


def test_the_check_of_the_container_does_each_step_and_the_recipe_of_the_guide():
    check = runpy.run_path(str(ROOT / "packaging/check_container"))
    assert {step for step, _ in check["STEPS"]} <= {*check["DONE"], *check["WORDS"], *check["IDLE"]}
    serve.make_context("serve", [*check["WORDS"]["ENTRYPOINT"][2:], *check["OPTIONS"]])
    guide = (ROOT / "docs/how-to/deploy.md").read_text("utf-8")
    lines = [shlex.split(line) for line in re.findall(r"^docker exec fpmatch (.+)$", guide, re.M)]
    assert [*check["SNAPSHOT"]] in lines
    assert f'-c "{check["RESTORE"][-1]}"' in guide
    assert f"--memory {check['GIGABYTES']}g" in guide


SERVE_OPTIONS = {option for parameter in serve.params for option in parameter.opts}


def test_the_services_keep_their_files_and_are_not_open_to_the_network():
    services = read_yaml("compose.yaml")["services"]
    required = re.findall(r"\$\{(\w+):\?", (ROOT / "compose.yaml").read_text("utf-8"))
    guide = (ROOT / "docs/how-to/deploy.md").read_text("utf-8")
    assert {*required} == {*re.findall(r"([A-Z_]+)=%s", guide)}
    mounted = {one.partition(":")[2] for one in services["server"]["volumes"]}
    assert mounted == {*json.loads(steps("VOLUME")[-1])}
    named = {one.partition(":")[0] for service in services.values() for one in service["volumes"]}
    assert named == {*read_yaml("compose.yaml")["volumes"]}
    assert "mem_limit" in services["server"]
    assert all(port.startswith("127.0.0.1:") for port in services["server"]["ports"])
    assert "ports" not in services["database"]


def test_the_guide_to_a_server_starts_it_with_options_that_exist():
    pytest.importorskip("anyio", reason="the extra web is not installed")
    from fpmatch.server.guard import FORM_BYTES, MOST_FILES
    from fpmatch.server.settings import Limits

    page = (ROOT / "docs/how-to/deploy.md").read_text("utf-8")
    start = r"(?:bin/fpmatch serve|cache/fpmatch fpmatch) (--[^\n]+)"
    lines = re.findall(start, page.replace("\\\n", ""))
    assert len(lines) == 2
    given = {word.partition("=")[0] for line in lines for word in line.split() if word[:2] == "--"}
    assert given <= SERVE_OPTIONS
    limit = re.search(r"client_max_body_size (\d+)m", page)
    assert limit is not None
    assert int(limit[1]) * 2**20 >= MOST_FILES * Limits().file_megabytes * 1e6 + FORM_BYTES


def test_workflows_ask_for_no_more_rights_than_they_need():
    for path in sorted((ROOT / ".github/workflows").glob("*.yml")):
        workflow = yaml.safe_load(path.read_text("utf-8"))
        assert workflow["permissions"] == {"contents": "read"}
        for name, job in workflow["jobs"].items():
            rights = {"id-token": "write"} if name == "publish" else {}
            assert job.get("permissions", {}) == rights
            assert "timeout-minutes" in job or "uses" in job, name


def test_the_source_distribution_names_folders_that_exist():
    lines = (ROOT / "MANIFEST.in").read_text("utf-8").splitlines()
    named = [line.split()[1:] for line in lines if line.split()[0] in {"include", "graft"}]
    assert all((ROOT / word).exists() for words in named for word in words)
