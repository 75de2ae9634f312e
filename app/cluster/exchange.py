"""What of a stage travels between working copies: its entry of dvc.lock, and its files."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from app.flow import child
from app.flow.disk import expect_room
from pipeline.base.errors import UserError, one_line
from pipeline.base.files import write_text

# What DVC itself reads, whatever the stage, and code of every stage that DVC does not track.
ALWAYS = ("dvc.yaml", "params.yaml", "pipeline/params", "stages/dvc_files.py", "stages/start.py")
ENTRIES = re.compile(r"^(?=  \S)", re.MULTILINE)  # where those of dvc.lock begin


def digests(root: Path, sources: Iterable[str]) -> dict[str, str]:
    """Hash of each source's contents; empty for what is missing."""
    return {source: _digest(root / source) for source in sources}


def _digest(path: Path) -> str:
    if path.is_file():
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    inside = sorted(file for file in path.rglob("*") if file.is_file() and _counts(file))
    listing = "".join(f"{file.relative_to(path)} {_digest(file)}\n" for file in inside)
    return hashlib.sha256(listing.encode()).hexdigest() if path.is_dir() else ""


def _counts(path: Path) -> bool:
    return "__pycache__" not in path.parts and path.suffix not in (".pyc", ".tmp")  # .dvcignore


def differing(copy: Path, expected: Mapping[str, str]) -> str | None:
    """How the sources of a working copy differ from `expected` digests; None if they do not."""
    if not (copy / ".dvc").is_dir():
        return "is no working copy of the project; start the worker in one, or set SLING_COPY"
    present = digests(copy, tuple(expected))
    differ = [source for source, digest in expected.items() if present[source] != digest]
    if not differ:
        return None
    more = f" and {len(differ) - 1} more" if differ[1:] else ""
    verb = "differ" if more else "differs" if present[differ[0]] else "is missing"
    return f"{differ[0]}{more} {verb}; bring it to the head's state (git pull, or copy the files)"


def entries(root: Path, names: tuple[str, ...]) -> dict[str, dict]:
    """What dvc.lock says of these stages, as far as it knows them."""
    from dvc.utils.serialize import parse_yaml

    with locked(root):  # DVC writes it in place
        text = _lock_text(root)
    stages = parse_yaml(text, "dvc.lock").get("stages", {})
    return {name: stages[name] for name in names if name in stages}


def merge(root: Path, new: Mapping[str, dict]) -> None:
    """Put entries into dvc.lock: at once or not at all, and never beside a DVC that writes it."""
    from dvc.utils.serialize import dumps_yaml, parse_yaml_for_update

    with locked(root):
        content = parse_yaml_for_update(_lock_text(root), "dvc.lock")
        content.setdefault("stages", {}).update(new)
        write_text(root / "dvc.lock", dumps_yaml(content))


def drop(root: Path, gone: Callable[[str], bool]) -> None:
    """Take the entries of some stages, by name, out of dvc.lock; as safely as `merge`."""
    path = root / "dvc.lock"
    if not path.is_file():
        return
    with locked(root):
        head, *before = ENTRIES.split(_lock_text(root))
        entries = [entry for entry in before if not gone(entry.strip().partition(":")[0])]
        if not entries:
            path.unlink()
        elif len(entries) < len(before):
            write_text(path, head + "".join(entries))


def _lock_text(root: Path) -> str:
    path = root / "dvc.lock"
    return path.read_text(encoding="utf-8") if path.is_file() else "schema: '2.0'\n"


@contextmanager
def locked(root: Path) -> Iterator[None]:
    """Hold DVC's lock of a working copy; wait for it."""
    from dvc.repo import Repo

    with Repo(str(root), _wait_for_lock=True) as repo, repo.lock:
        yield


def expect_remote(root: Path) -> None:
    """Raises UserError where `dvc push` would not know where to."""
    from dvc.config import Config

    if not Config(str(root / ".dvc"))["core"].get("remote"):
        raise UserError(
            f"{root}: no default DVC remote, by which files could travel; `dvc remote add -d NAME"
            " URL` in each working copy, or let all workers start in one shared folder"
        )


def transfer(
    root: Path, command: str, stages: tuple[str, ...], cancelled: Callable[[], bool]
) -> None:
    """`dvc push` or `dvc pull` what these stages made, by the default remote.

    What lies where a pulled file belongs gives way, as it does when DVC runs a stage.

    Raises:
        UserError: It failed.
        child.Cancelled: `cancelled`, asked several times a second, became true.
    """
    if not stages:
        return
    force = ("--force",) if command == "pull" else ()
    status, output = child.dvc(
        root, (command, *force, *stages), environment=os.environ, cancelled=cancelled
    )
    if status:
        expect_room(root)  # `dvc pull` names the file alone
        text = "\n".join(output)
        why = one_line(text.partition("ERROR: ")[2] or text)
        raise UserError(
            f"{root}: dvc {command} {' '.join(stages)}: {why or f'exit status {status}'}"
        )
