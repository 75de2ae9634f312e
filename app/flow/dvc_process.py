"""DVC's command line, as `dvc` runs it, with less to do for each stage; a script of its own.

After each stage DVC reads and writes all of dvc.lock by a YAML library that keeps comments and
quotes, of which dvc.lock has none: three seconds for a hundred stages. Here the library's plain
parser reads it, which is in C, and entries that are as they were are written as they were read. The
file has the same bytes.
"""

from __future__ import annotations

import gc
import io
import json
import re
import sys

import ruamel.yaml
from ruamel.yaml import YAML

LOCK = "schema: '2.0'\nstages:\n"  # how dvc.lock begins


class LockYAML(YAML):
    """`ruamel.yaml.YAML`, but quick with dvc.lock."""

    entries: dict[str, tuple[str, str]] = {}  # by stage, what was read last: as JSON, and its text

    def load(self, stream):
        if not (isinstance(stream, str) and stream.startswith(LOCK)) or "#" in stream:
            return super().load(stream)
        data = YAML(typ="safe").load(stream)
        texts = re.split(r"^(?=  \S)", stream[len(LOCK) :], flags=re.MULTILINE)[1:]
        stages = data["stages"].items()
        LockYAML.entries = {
            name: (json.dumps(entry), text)
            for (name, entry), text in zip(stages, texts, strict=True)
        }
        return data

    def dump(self, data, stream=None, **options):
        is_lock = isinstance(data, dict) and [*data] == ["schema", "stages"] and self.entries
        if stream is None or not (is_lock and data["stages"]):
            return super().dump(data, stream, **options)
        stream.write(LOCK)
        for name, entry in data["stages"].items():
            before, text = self.entries.get(name, ("", ""))
            if json.dumps(entry) == before:
                stream.write(text)
            else:
                buffer = io.StringIO()
                super().dump({"stages": {name: entry}}, buffer)
                stream.write(buffer.getvalue().removeprefix("stages:\n"))


def main() -> int:
    gc.disable()  # to look for garbage takes a seventh of its time
    ruamel.yaml.YAML = LockYAML
    from dvc.cli import main as dvc

    return dvc()


if __name__ == "__main__":
    sys.exit(main())
