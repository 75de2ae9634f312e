"""Notes what a stage reads of params.yaml; Python runs this first where it lies on PYTHONPATH.

tests/test_pipeline.py compares the notes, `$AUDIT/<stage>.<process>.json`, with the `params:` of
dvc.yaml.
"""

import atexit
import gc
import json
import os
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

read: set[str] = set()
gc.set_threshold(100_000, 50, 50)  # it is looked for garbage while torch is imported


class Section:
    """A stand-in for a section of the parameters that notes each leaf as it is read."""

    def __init__(self, section: object, path: str = "") -> None:
        self._section, self._path = section, path

    def __getattr__(self, name: str) -> object:
        if name == "model_dump_json":  # a memory's fingerprint: no result depends on it
            return self._section.model_dump_json
        if name == "model_dump":
            return self._dumped
        if name not in type(self._section).model_fields:  # another method may read everything
            note(self._path)
            return getattr(self._section, name)
        return noted(getattr(self._section, name), f"{self._path}.{name}".lstrip("."))

    def _dumped(self, **options: object) -> dict:
        """What its `model_dump` gives, each leaf of which is read."""
        content = self._section.model_dump(**options)
        note_leaves(content, self._path)
        return content

    def __iter__(self) -> Iterator[tuple[str, object]]:
        return ((name, getattr(self, name)) for name in type(self._section).model_fields)


class Entries(Mapping):
    """The same for a mapping by names, such as `bands`."""

    def __init__(self, entries: dict, path: str) -> None:
        self._entries, self._path = entries, path

    def __getitem__(self, name: str) -> object:
        return noted(self._entries[name], f"{self._path}.{name}")

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def __ror__(self, first: dict) -> dict:
        return {**first, **self}


def note_leaves(value: object, path: str) -> None:
    """Note all that lies below a value."""
    if not (isinstance(value, dict) and value):
        note(path)
        return
    for name, part in value.items():
        note_leaves(part, f"{path}.{name}".lstrip("."))


def noted(value: object, path: str) -> object:
    if isinstance(value, dict):
        if not value:
            note(path)
        return Entries(value, path)
    if hasattr(type(value), "model_fields"):
        return Section(value, path)
    note(path)
    return value


def note(path: str) -> None:
    read.add(path)
    if path.startswith("methods."):  # what a method leaves out is as the defaults say
        from sling2sim2real.settings.identification import MethodDefaults

        read.update(
            f"method_defaults.{key}"
            for key in path.split(".")[2:3] or MethodDefaults.model_fields
            if key in MethodDefaults.model_fields
        )


def install(stage: str) -> None:
    os.environ["AUDITED"] = stage
    sys.path.insert(0, os.getcwd())
    from pipeline import params

    load = params.load
    params.load = lambda *path: Section(load(*path))
    file = Path(os.environ["AUDIT"], f"{stage}.{os.getpid()}.json")
    atexit.register(lambda: file.write_text(json.dumps(sorted(read))))


if sys.orig_argv[1:2] == ["-m"] and sys.orig_argv[2].startswith("stages."):
    module, *item = sys.orig_argv[2:]
    step = module.removeprefix("stages.")
    install("@".join(filter(None, (step, "-".join(item)))))
elif "AUDITED" in os.environ:  # a process that a stage started
    install(os.environ["AUDITED"])
