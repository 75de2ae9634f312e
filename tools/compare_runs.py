"""Whether two whole runs have the same numbers: θ files, Parquet rows, cells of reports' tables.

    python tools/compare_runs.py OLD NEW [--rename 'PATTERN=REPLACEMENT' ...]

OLD and NEW are folders of the project, each with its data/ and reports/ after `make run` on the
same machine. Values count as the same to the last digit. Files, keys, columns, tables and rows that
one run alone has are listed, but are no difference: a change may remove or add them. `--rename`
says, as a regular expression, what NEW calls otherwise than OLD: in paths, and in texts that are
values. Exit status 1 where a
value differs, 2 where there is nothing to compare.
"""

from __future__ import annotations

import argparse
import csv
import json
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

FOLDERS = ("data", "reports")
IGNORED_FOLDERS = {"raw", "validation", "benchmarks", "presets"}  # recordings; results of campaigns
IGNORED_KEYS = {"made_with", "seconds", "input_hash"}  # how it was made, and how fast
IGNORED_COLUMNS = {"seconds"}


@dataclass
class Comparison:
    """What was found: `differences` count, `only` is what one run alone has."""

    renames: list[tuple[str, str]] = field(default_factory=list)
    values: int = 0
    files: int = 0
    differences: list[str] = field(default_factory=list)
    only: list[str] = field(default_factory=list)

    def renamed(self, text: str) -> str:
        """What NEW calls what OLD calls `text`."""
        for pattern, replacement in self.renames:
            text = re.sub(pattern, replacement, text)
        return text

    def compare(self, where: str, old: Any, new: Any) -> None:
        """Walk through two values of the same place."""
        if isinstance(old, dict) and isinstance(new, dict):
            for key in sorted(old.keys() | new.keys(), key=str):
                place = f"{where}: {key}"
                if key not in new or key not in old:
                    self.only.append(f"{place} ({'OLD' if key in old else 'NEW'} only)")
                elif key not in IGNORED_KEYS:
                    self.compare(place, old[key], new[key])
        elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
            for index, (first, second) in enumerate(zip(old, new, strict=True)):
                self.compare(f"{where}[{index}]", first, second)
        else:
            self.values += 1
            old = self.renamed(old) if isinstance(old, str) else old
            if old != new and not (_is_nan(old) and _is_nan(new)):
                self.differences.append(f"{where}: {_short(old)} -> {_short(new)}")


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and value != value


def _short(value: Any) -> str:
    return f"{value!r:.60}"


def read_parquet(path: Path) -> dict[str, list]:
    """The columns, by name, without how long each row took."""
    table = pq.read_table(path)
    names = (name for name in table.column_names if name not in IGNORED_COLUMNS)
    return {name: _plain(table[name].to_pandas().to_list()) for name in names}


def _plain(value: Any) -> Any:
    """Arrays, at any depth, as lists."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    return [_plain(item) for item in value] if isinstance(value, list) else value


def read_csv(path: Path) -> dict[str, dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return _by_first_cell(list(csv.reader(file)))


def read_tables(path: Path) -> dict[str, dict]:
    """The tables of a Markdown page, by the heading above and their header row."""
    heading, lines, tables = "", [], {}
    for line in [*path.read_text(encoding="utf-8").splitlines(), ""]:
        if line.startswith("#"):
            heading = line.strip("# ")
        if line.startswith("|---"):  # between the header and the rows
            continue
        if line.startswith("|"):
            lines.append([cell.strip() for cell in line.strip("|").split("|")])
        elif lines:
            tables[f"{heading} / {' | '.join(lines[0])}"] = _by_first_cell(lines)
            lines = []
    return tables


def _by_first_cell(rows: list[list[str]]) -> dict[str, dict[str, str]]:
    """Cells by row and column; rows with the same first cell are numbered."""
    header, cells = rows[0] if rows else [], {}
    for row in rows[1:]:
        key, number = row[0] if row else "", 1
        while (name := f"{key} #{number}") in cells:
            number += 1
        cells[name] = dict(zip(header, row, strict=False))
    return cells


READERS = {
    ".json": lambda path: json.loads(path.read_text(encoding="utf-8")),
    ".parquet": read_parquet,
    ".csv": read_csv,
    ".md": read_tables,
}


def results(root: Path) -> Iterator[str]:
    """Paths below `root` of the files that hold numbers of a run."""
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            place = path.relative_to(root)
            if path.suffix in READERS and not IGNORED_FOLDERS & set(place.parts):
                yield str(place)


def compare_runs(old: Path, new: Path, renames: list[tuple[str, str]]) -> Comparison:
    """Compare all results of two project folders; `renames` turn names of OLD into those of NEW."""
    comparison = Comparison(renames)
    seen = set()
    for place in results(old):
        renamed = comparison.renamed(place)
        seen.add(renamed)
        if not (new / renamed).is_file():
            comparison.only.append(f"{place} (OLD only)")
            continue
        read = READERS[Path(place).suffix]
        comparison.files += 1
        comparison.compare(renamed, read(old / place), read(new / renamed))
    comparison.only += [f"{place} (NEW only)" for place in results(new) if place not in seen]
    return comparison


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("old", type=Path, help="folder of the project before a change")
    parser.add_argument("new", type=Path, help="folder of the project after it")
    parser.add_argument("--rename", action="append", default=[], metavar="PATTERN=REPLACEMENT")
    arguments = parser.parse_args()
    renames = [tuple(rename.split("=", 1)) for rename in arguments.rename]
    comparison = compare_runs(arguments.old, arguments.new, renames)
    for line in comparison.only:
        print(f"only: {line}")
    for line in comparison.differences:
        print(f"differs: {line}")
    counts = f"{comparison.values} values in {comparison.files} files"
    print(f"{counts}, {len(comparison.differences)} differ, {len(comparison.only)} in one run only")
    return 2 if not comparison.files else int(bool(comparison.differences))


if __name__ == "__main__":
    sys.exit(main())
