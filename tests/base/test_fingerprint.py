"""The hash of what a result depends on."""

from pathlib import Path

from sling2sim2real.base.fingerprint import fingerprint


def test_it_covers_contents_and_sources(tmp_path: Path) -> None:
    """Sources of a folder at any depth."""
    data, source = tmp_path / "data.parquet", tmp_path / "code" / "deep" / "solver.h"
    source.parent.mkdir(parents=True)
    data.write_text("1"), source.write_text("2")
    parts = (data, tmp_path / "code")
    stamps = [fingerprint("params", *parts), fingerprint("params", *parts)]
    assert stamps[0] == stamps.pop()
    stamps.append(fingerprint("other", *parts))
    for file in (data, source):
        file.write_text(file.read_text() + "3")
        stamps.append(fingerprint("params", *parts))
    assert len(set(stamps)) == 4
