"""Files that ship the package agree with it; `packaging/check_dist` and the workflows build it."""

import json
import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from fpmatch._version import __version__
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


def test_the_recipe_has_the_version_of_the_package():
    assert read_yaml("packaging/conda/recipe.yaml")["context"]["version"] == __version__


def test_the_recipe_needs_what_the_package_needs(project):
    recipe = read_yaml("packaging/conda/recipe.yaml")["requirements"]
    needed = names(project["project"]["dependencies"]) - {"opencv-python-headless"}
    assert names(recipe["run"]) == needed | {"python", "py-opencv"}


def test_the_lock_has_every_dependency_of_the_image_from_its_floor_on(project):
    text = (ROOT / "packaging/requirements.lock").read_text("utf-8")
    locked = re.findall(r"^([a-z0-9_.-]+)(?:\[\w+\])?==([^\s;]+).*\n    --hash", text, re.M)
    extras = project["project"]["optional-dependencies"]
    needed = [*project["project"]["dependencies"], *project["build-system"]["requires"]]
    needed += [one for name in ("web", "postgres", "encryption") for one in extras[name]]
    for requirement in map(Requirement, needed):
        versions = [version for name, version in locked if name == requirement.name.lower()]
        assert versions, requirement
        assert all(version in requirement.specifier for version in versions), requirement


def steps(name):
    """Return what follows a word of Dockerfile, such as RUN."""
    text = (ROOT / "Dockerfile").read_text("utf-8").replace("\\\n", "")
    return re.findall(rf"^{name} (.+)$", text, re.M)


def test_the_image_serves_with_a_log_and_a_health_check():
    pytest.importorskip("fastapi", reason="the extra web is not installed")
    from fpmatch.server.access import is_public
    from fpmatch.server.routes import operations_router

    program, command, *options = json.loads(steps("ENTRYPOINT")[-1])
    assert (program, command) == ("fpmatch", serve.name)
    options += read_yaml("compose.yaml")["services"]["server"]["command"]
    given = serve.make_context(command, options).params
    assert given["log"] == "json"
    (path,) = re.findall(rf":{given['port']}(/\w+)'", steps("HEALTHCHECK")[-1])
    assert path == "/ready"
    assert path in {getattr(route, "path", None) for route in operations_router.routes}
    assert is_public({"type": "http", "method": "GET", "path": path})


def test_workflows_ask_for_no_more_rights_than_they_need():
    for path in sorted((ROOT / ".github/workflows").glob("*.yml")):
        workflow = yaml.safe_load(path.read_text("utf-8"))
        assert workflow["permissions"] == {"contents": "read"}
        for name, job in workflow["jobs"].items():
            rights = {"id-token": "write"} if name == "publish" else {}
            assert job.get("permissions", {}) == rights
            assert "timeout-minutes" in job or "uses" in job, name
