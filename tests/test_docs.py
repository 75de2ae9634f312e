"""What README and docs say is so: links, commands, stages, keys, Python."""

import argparse
import ast
import importlib.util
import re
import shlex
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from sling2sim2real.card.text import GLOSSARY
from sling2sim2real.cli import checkout
from sling2sim2real.cli.cli import parser
from sling2sim2real.quantities import QUANTITIES
from tests.project import DEFAULTS, ROOT, texts
from validation.pages import CODE_BLOCK

LINK = re.compile(r"\]\((?!https?:)([^)#]*)(?:#([^)]*))?\)")
OURS = "app|docs|examples|pipeline|reports|sling2sim2real|stages|tests|tools|validation"
CODE = re.compile(rf"`((?:{OURS})/[\w./-]+)`")
SPAN = re.compile(r"(?<!`)`([^`\n]+)`(?!`)")
SETTING = re.compile(r"\w+=\S*")  # of the environment, before a command
IGNORED = {
    "reports/index.html",
    "reports/appendix.html",
    "reports/bands",
    "reports/summary.json",
}  # a run writes them
PARAMS = YAML(typ="safe").load(DEFAULTS)
STAGES = YAML(typ="safe").load(ROOT / "dvc.yaml")["stages"]
TARGETS = set(re.findall(r"^([a-z][a-z -]*):", (ROOT / "Makefile").read_text(), re.MULTILINE))
ELSEWHERE = {"git", "pip", "pre-commit"}


def written() -> list[Path]:
    """Pages that people write for users; no stage does."""
    return [page for page in texts("*.md", ":!tests") if "reports" not in page.parts]


def blocks(language: str, *files: Path) -> list[tuple[Path, str]]:
    """Code blocks of a language."""
    return [
        (page, code)
        for page in files or written()
        for kind, code in CODE_BLOCK.findall(page.read_text(encoding="utf-8"))
        if kind == language
    ]


def commands(code: str) -> list[list[str]]:
    """The words of each command of a block, without settings of its environment."""
    lines = code.replace("\\\n", " ").splitlines()
    word_lists = [shlex.split(line, comments=True) for line in lines]
    for words in word_lists:
        while words and SETTING.fullmatch(words[0]):
            words.pop(0)
    return [words for words in word_lists if words]


def anchors(page: Path) -> set[str]:
    """Of its headings, as GitHub names them."""
    text = CODE_BLOCK.sub("", page.read_text(encoding="utf-8"))
    heads = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).strip().replace(" ", "-") for head in heads}


def made_by_a_run(path: Path) -> bool:
    return any(path.is_relative_to(ROOT / ignored) for ignored in IGNORED)


def test_links_paths_and_anchors_of_every_page_are_there() -> None:
    named, wrong = 0, []
    for page in texts("*.md", ":!tests"):
        text = page.read_text(encoding="utf-8")
        links = [
            (page.parent / target if target else page, head) for target, head in LINK.findall(text)
        ]
        links += [(ROOT / target, "") for target in CODE.findall(text)]
        for path, head in links:
            path, named = path.resolve(), named + 1
            if made_by_a_run(path):
                continue
            if not path.exists() or (head and head not in anchors(path)):
                wrong.append((str(page.relative_to(ROOT)), str(path), head))
    assert named > 100
    assert wrong == []


def test_the_glossary_has_each_label_of_a_card() -> None:
    rows = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8").splitlines()
    for quantity in QUANTITIES.values():
        row = re.compile(rf"\| {re.escape(quantity.label)}( \S+)? \|")
        assert any(map(row.match, rows)), quantity.label
    assert (ROOT / "reports/bands/band1/card" / GLOSSARY).resolve() == ROOT / "docs/glossary.md"


def test_every_page_is_in_the_index() -> None:
    index = (ROOT / "docs/README.md").read_text(encoding="utf-8")
    linked = {(ROOT / "docs" / target).resolve() for target, _ in LINK.findall(index)}
    assert {page for page in written() if page.name != "README.md"} - linked == set()
    notes = {page for page in written() if page.name == "README.md"} - linked
    assert notes == {ROOT / "docs/README.md"}


def test_every_command_is_one() -> None:
    """Those of `bash` blocks, word for word as they stand there."""
    seen = set()
    for page, code in blocks("bash"):
        for words in commands(code):
            tool = words[0].removeprefix(".venv/bin/")
            seen.add(tool)
            check = {"sling": sling, "make": make, "dvc": dvc, "python": python}.get(tool)
            try:
                if check:
                    check(words[1:])
                else:
                    assert tool in ELSEWHERE
            except (AssertionError, SystemExit) as error:
                pytest.fail(f"{page.name}: {shlex.join(words)}: {error}")
    assert seen >= {"sling", "make", "dvc", "python"}


def sling(words: list[str]) -> None:
    if words[0] in checkout.COMMANDS:
        parser_of(words[0]).parse_args(words[1:])
    else:
        parser().parse_args(words)


def make(words: list[str]) -> None:
    assert set(words) <= {target for names in TARGETS for target in names.split()}


def python(words: list[str]) -> None:
    if words[:1] == ["-m"]:
        assert importlib.util.find_spec(words[1])
    paths = [word for word in words if "/" in word and "=" not in word]
    assert all((ROOT / path).exists() for path in paths)


def dvc(words: list[str]) -> None:
    """The stages and parameters that a command names are there."""
    for value in (words[i + 1] for i, word in enumerate(words) if word == "-S"):
        expect_key(value.partition("=")[0])
    if words[0] == "repro":
        for name in (word for word in words[1:] if not word.startswith("-")):
            stage, _, item = name.partition("@")
            band, _, method = item.partition("-")
            assert stage in STAGES, f"no stage {stage}"
            assert not band or band in PARAMS["bands"], f"no band {band}"
            assert not method or method in PARAMS["methods"], f"no method {method}"


def expect_key(name: str) -> None:
    node = PARAMS
    for key in name.split("."):
        assert key in node, f"params.yaml has no {name}"
        node = node[key]


def test_every_key_is_one() -> None:
    """Of params.yaml, where a page names it with its section: `trials.repeats`."""
    named = {span for page in written() for span in SPAN.findall(page.read_text(encoding="utf-8"))}
    keys = {span for span in named if re.fullmatch(r"[a-z_]+(\.[a-z_0-9]+)+", span)}
    keys = {span for span in keys if span.partition(".")[0] in PARAMS and not is_file(span)}
    assert len(keys) > 40
    for key in sorted(keys):
        expect_key(key)


def is_file(name: str) -> bool:
    """Such as policy.onnx."""
    return name.rpartition(".")[2] in {"csv", "json", "md", "onnx", "png", "pt", "py", "yaml"}


def parser_of(name: str) -> argparse.ArgumentParser:
    """Of a command: its own, or that of the module of a checkout."""
    if name in checkout.COMMANDS:
        module = checkout.COMMANDS[name][0]
        here = importlib.util.find_spec(f"{module}.__main__") if module == "pipeline.flow" else None
        return importlib.import_module(f"{module}.__main__" if here else module).parser()
    (subs,) = (action for action in parser()._actions if action.choices)
    return subs.choices[name]


def test_every_option_is_one() -> None:
    """Commands in sentences, of messages too: `sling check --sheet`; placeholders may follow."""
    subs = next(
        action for action in parser()._actions if action.choices and "check" in action.choices
    ).choices
    count = 0
    for file in (*written(), *texts("*.j2", "*.py", ":!tests")):
        text = re.sub(r'"\s*\n\s*f?"', "", file.read_text(encoding="utf-8"))
        for span in re.findall(r"`((?:sling|make) [^`{}\n]+)`", text):
            tool, name, *more = span.split()
            if tool == "make":
                make([name])
                count += 1
            elif name[0].isalpha():
                assert name in subs, f"{file}: {span}"
                flags = {word.partition("=")[0].strip("[]") for word in more if word[:2] == "--"}
                options = parser_of(name)._option_string_actions
                assert flags <= set(options), f"{file}: {span}"
                count += 1
    assert count > 60


def test_python_imports_what_there_is() -> None:
    """README's runs on a tiny project in tests/test_pipeline.py."""
    for _, code in blocks("python"):
        imports = [
            node
            for node in ast.walk(ast.parse(code))
            if isinstance(node, ast.Import | ast.ImportFrom)
        ]
        exec(ast.unparse(ast.Module(imports, [])), {})
