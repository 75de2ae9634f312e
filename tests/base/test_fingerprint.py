"""The hash of what a result depends on."""

from pathlib import Path

from pipeline.base.fingerprint import fingerprint


def test_it_covers_contents_and_sources(tmp_path: Path) -> None:
    data, source = tmp_path / "data.parquet", tmp_path / "code" / "solver.h"
    source.parent.mkdir()
    data.write_text("1"), source.write_text("2")
    parts = (data, source.parent)
    stamps = [fingerprint("params", *parts), fingerprint("params", *parts)]
    assert stamps[0] == stamps.pop()
    stamps.append(fingerprint("other", *parts))
    for file in (data, source):
        file.write_text(file.read_text() + "3")
        stamps.append(fingerprint("params", *parts))
    assert len(set(stamps)) == 4
