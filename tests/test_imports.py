"""What is imported is declared in pyproject.toml, and what is declared is imported."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from sling2sim2real.base.errors import EXTRAS as TOLD
from tests.project import ROOT, texts

OURS = {
    "app",
    "examples",
    "pipeline",
    "rig",
    "sling2sim2real",
    "stages",
    "tests",
    "tools",
    "validation",
}
# By path, extras that come beside what everybody has.
EXTRAS = {
    "pipeline/flow/cluster.py": "cluster",
    "sling2sim2real/exporting/mujoco_replay.py": "validation",
    "sling2sim2real/exporting/newton_band.py": "validation",
    "sling2sim2real/cli/preflight/timeline.py": "rerun",
    "examples/sam3_masks.py": "sam3",
    "tests/examples/test_sam3_masks.py": "sam3",
    "tests/examples/tiny_sam3.py": "sam3",
    "tests/": "dev",
    "tests/recording/test_kinematics.py": "validation",  # skipped where that is missing
    "tests/recording/masks/": "validation",
    "tests/validation/": "validation",
    "tests/exporting/": "validation",
    "tests/cli/preflight/": "validation",
    "tests/rig/recorder/test_record.py": "validation",
    "tools/": "dev",
    "tools/site.py": "docs",
    "validation/": "validation",
    "validation/campaigns/": "dev",
    "validation/recordings/": "dev",
    "sling2sim2real/engines/physx/": "physx",
}
ELSEWHERE = "examples/franka/"  # runs in environments of its own: franky's, and ROS 2
INSTALLED_AS = {
    "pxr": {"usd-core"},
    "rerun": {"rerun-sdk"},
}  # packages of extras whose distribution is called otherwise
INDIRECT = {
    "physx-usd-schemas": "ovphysx reads scenes by it",
    "newton-usd-schemas": "the same",
    "fastapi": "newer ones break Prefect's server",
    "mkdocs-material": "the theme of mkdocs.yml",
    "mkdocstrings": "a plug-in there",
    "onnxscript": "torch's ONNX exporter imports it",
    "pytest-xdist": "a plug-in of pytest's",
    "basedpyright": "make lint",
    "ruff": "make lint",
    "uv": "tools/setup.sh",
    "threadpoolctl": "by the script of a test",
    "codespell": "the same",
    "pre-commit": "the same at each commit",
    "pre-commit-hooks": "large files, at each commit",
}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def declared(extra: str = "") -> set[str]:
    """Distributions of an extra, and of the extras in it; of everybody's by default."""
    lines = PROJECT["optional-dependencies"][extra] if extra else PROJECT["dependencies"]
    names = set()
    for line in map(Requirement, lines):
        if line.name == PROJECT["name"]:
            names |= set().union(*map(declared, line.extras))
        else:
            names.add(normal(line.name))
    return names


def imported(file: Path) -> Iterator[str]:
    """Packages of others that a file imports, wherever in it, and asks pytest for."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            names = [name.name for name in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names = [node.module]
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "importorskip":
            names = [node.args[0].value]
        else:
            continue
        tops = {name.split(".")[0] for name in names}
        yield from tops - OURS - sys.stdlib_module_names


PACKAGES = packages_distributions()


def distributions(package: str) -> set[str]:
    """Any of which may be declared for a package; one that is not installed bears its name."""
    return {normal(name) for name in PACKAGES.get(package, [package])} | INSTALLED_AS.get(
        package, set()
    )


def test_what_is_imported_is_declared_for_who_imports_it() -> None:
    """What a stage or a command imports comes by `make setup`, or by an extra that it names."""
    everybody, used = declared() | declared("run"), set()
    for file in sorted(file for top in OURS for file in (ROOT / top).rglob("*.py")):
        name = file.relative_to(ROOT).as_posix()
        if name.startswith(ELSEWHERE):
            continue
        paths = sorted((path for path in EXTRAS if name.startswith(path)), key=len)
        allowed = everybody.union(*(declared(EXTRAS[path]) for path in paths))
        for package in imported(file):
            candidates = distributions(package)
            used |= candidates
            assert candidates & allowed, f"{name} imports {package}: declare {sorted(candidates)}"
    extras = set().union(*map(declared, PROJECT["optional-dependencies"]))
    idle = (everybody | extras) - used - INDIRECT.keys()
    assert not idle, "declared, and imported by nobody"


HINTS = (  # a package that is missing, and the extra that is to bring it
    r"(\w+) is not installed: [^']*'\.\[(\w+)\]'",
    r"(\w+), which must be installed \(extra `(\w+)`\)",
    r"importorskip\(\"(\w+)\"[^)]*'\.\[(\w+)\]'",
)


def test_who_is_told_to_install_an_extra_gets_what_is_missing() -> None:
    """In messages, docstrings, pages and the reasons of tests that are skipped."""
    extras, told = PROJECT["optional-dependencies"], []
    for file in texts("*.py", "*.md", "*.j2"):
        text = file.read_text("utf-8")
        text = re.sub(r'"\s*\n\s*f?"', "", text)  # strings that go on in the next line
        named = re.findall(r"'\.\[(\w+)\]'|extra `(\w+)`", text)
        unknown = {first or second for first, second in named} - extras.keys()
        assert not unknown, f"{file}: no extra {unknown}"
        told += [(file, *hint) for shape in HINTS for hint in re.findall(shape, text)]
    assert len(told) >= 8
    for file, package, extra in told:
        candidates = distributions(package.lower())
        assert candidates & declared(extra), f"{file}: {extra} does not bring {package}"
        assert not candidates & declared(), f"{file}: everybody has {package}"


LIGHT = """
import sys
absent = set({absent!r})
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in absent:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Absent())
from sling2sim2real.cli import aim, export, launch, plan, preflight
import sling2sim2real as s2s
s2s.identify, s2s.aim, s2s.launch, s2s.read_mcap
from sling2sim2real.cli.cli import main
sys.argv = ["sling", *{words!r}]
main()
"""


def light(folder: Path, *words: str) -> subprocess.CompletedProcess:
    """`sling` in a folder, by a Python without what the extra `run` brings."""
    script = LIGHT.format(absent=TOLD["run"].split(), words=words)
    return subprocess.run(
        [sys.executable, "-c", script],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )


@pytest.mark.slow
def test_a_light_install_suffices_and_says_what_it_lacks(tmp_path: Path) -> None:
    brought = {name for package in TOLD["run"].split() for name in distributions(package)}
    assert declared("run") <= brought
    assert not declared() & brought
    how = "make setup, or pip install '.[run]' -c constraints.txt in the project's folder"
    assert light(ROOT, "--help").returncode == 0
    # beside no params.yaml, as after `pip install` alone
    assert light(tmp_path, "check", "no.mcap").stderr.endswith("error: no.mcap: no such file\n")
    for lacking in (light(ROOT, "flow"), light(tmp_path, "ui")):
        assert lacking.returncode == 1
        assert re.fullmatch(rf"error: \w+ is not installed: {re.escape(how)}\n", lacking.stderr)
