"""`sling fit`: a band's folder, from its recordings to its card, as far as that is not done yet.

Each step writes a temporary name and renames it: killed at any moment the folder is whole, and the
same command goes on. Nothing is kept of a recording that cannot be used.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from tabulate import tabulate

from sling2sim2real.api.arguments import USUAL
from sling2sim2real.api.band_folder import SIZES, BandFile, BandFolder
from sling2sim2real.api.identification import METHOD, Identification
from sling2sim2real.api.identify import identify, starting_model
from sling2sim2real.api.launching import draw_for
from sling2sim2real.api.model import Model, Theta
from sling2sim2real.base.disk import expect_writable
from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.base.files import NotMade, replacing, replacing_folder, write_json
from sling2sim2real.base.fingerprint import fingerprint
from sling2sim2real.base.schema import JsonRecord, read_json
from sling2sim2real.cli.steps import Steps
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.posterior.launches import observed
from sling2sim2real.identification.results.theta import Mounting
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.recording import files as bag
from sling2sim2real.recording.mask_folder import MASK_NAME, masks_beside
from sling2sim2real.settings import Settings

RECORDING, START, DENSITY = "recordings to episodes", "exploration", "density"
POLICY, CARD = "policy", "card"
COSTS = {RECORDING: 9.0, START: 2.0, DENSITY: 2.0, POLICY: 20.0, CARD: 6.0}  # s, quiet machine


class _Start(JsonRecord):
    """What start.json holds."""

    digest: str
    names: list[str]
    point: list[float]
    mounting: Mounting | None


def fit(
    folder: BandFolder,
    recordings: Sequence[Path] = (),
    sizes: Mapping[str, float] | None = None,
    *,
    policy: bool = False,
) -> dict:
    """Make a band's folder, or bring it up to date.

    Args:
        folder: There or to come.
        recordings: MCAP files or bags' folders; those that are there already are passed over.
        sizes: Of SIZES, what is new of them; mass is needed of a new band [kg, m].
        policy: Whether to train one; a band that has one keeps it up to date.

    Returns:
        What card.json says, and where the card lies, under `card`.

    Raises:
        UserError: Something given is wrong, and nothing is changed; or a step fails, and what was
            done stays done.
    """
    recordings = bag.once(recordings)
    file = _file(folder, recordings, sizes or {})
    settings = folder.settings_with(file)
    policy = policy or Stored.of_band(folder.path).network.is_file()
    steps = Steps({name: cost for name, cost in COSTS.items() if policy or name != POLICY})
    if not folder.lab_file.is_file():
        steps.say(f"no {folder.lab_file}: the usual settings hold (`sling setup` writes yours)", 0)
    for name in file.assumed:
        steps.say(f"assumed: {name} {file.sizes[name]:g} m (--{name.replace('_', '-')})", 0)
    steps.begin(RECORDING)
    _bring_in(folder, file, settings, recordings, steps)

    folder = BandFolder(folder.path)  # as it is now
    if not folder.recordings:
        raise UserError(f"{folder.path}: has no recording; give one: sling fit FILE.mcap")
    episodes = [
        episode
        for recording in folder.recordings
        for episode in _episodes(folder, recording, settings, steps)
    ]
    found = _identified(folder, episodes, steps)
    if policy:
        found = _with_policy(folder, found, steps)
    steps.begin(CARD)
    card = _card(folder, found, episodes)
    steps.finish()
    _forget(folder)
    return card | {"card": str(folder.card / "README.md")}


def folder_of(given: Sequence[Path], name: str | None) -> tuple[BandFolder, list[Path]]:
    """The band that a command line is about, and the recordings that it gives.

    Raises UserError where it names none, or several.
    """
    folders = [folder for path in given if (folder := BandFolder.find(path))]
    files = [path for path in given if not BandFolder.find(path)]
    if len(folders) > 1 or (folders and name):
        raise UserError("give one band: its folder, or with new recordings --name NAME")
    if folders:
        return folders[0], files
    if name:
        return BandFolder.named(name), files
    if not files:
        raise UserError("give a recording (FILE.mcap) or a band's folder, such as bands/orange")
    guess = re.sub(r"[^a-z0-9]+", "_", bag.name_of(files[0]).lower()).strip("_")
    try:
        folder = BandFolder.named(guess)
    except UserError:
        raise UserError(
            f"{files[0]}: this file name makes no band name; give one: --name NAME"
        ) from None
    there = {bag.sha256(recording) for recording in folder.recordings}
    if there and any(bag.sha256(file) not in there for file in files):
        raise UserError(f"{folder.path}: is there already; to add to it, --name {guess}")
    return folder, files


def _file(folder: BandFolder, recordings: Sequence[Path], sizes: Mapping[str, float]) -> BandFile:
    """What band.yaml is to hold. Raises UserError."""
    if folder.band_file.is_file():
        return folder.file.with_sizes(sizes)
    if not recordings:
        raise UserError(f"{folder.path}: is no band yet; give its recording: sling fit FILE.mcap")
    if "mass" not in sizes:
        raise UserError(f"{folder.name}: is new; weigh the band and give --mass KG, such as 0.0408")
    assumed = tuple(name for name in SIZES if name not in sizes)
    return BandFile.model_validate({**USUAL, **sizes, "assumed": assumed})


def _bring_in(
    folder: BandFolder,
    file: BandFile,
    settings: Settings,
    recordings: Sequence[Path],
    steps: Steps,
) -> None:
    """Have recordings and band.yaml in the folder, once all are known to be usable."""
    is_new = not folder.path.exists()
    there = {bag.sha256(recording): recording for recording in folder.recordings}
    new: dict[str, Path] = {}
    for recording in recordings:
        digest = bag.sha256(recording)
        if digest in there:
            _copy_masks(recording, there[digest])
        elif digest in new:
            raise UserError(f"{recording} and {new[digest]} are the same recording")
        else:
            new[digest] = recording
    targets = {recording: _target(folder, recording) for recording in new.values()}
    if len({*targets.values()}) < len(targets):
        raise UserError("two of the recordings have one name: rename one")
    expect_writable(folder.path)
    try:
        for recording in new.values():
            _episodes(folder, recording, settings, steps)
    except UserError:
        if is_new:
            shutil.rmtree(folder.path, ignore_errors=True)
        raise
    for recording, target in targets.items():
        _copy_masks(recording, target)
        _link(recording, target)
    if not folder.band_file.is_file() or file != folder.file:
        file.save(folder.band_file)


def _target(folder: BandFolder, recording: Path) -> Path:
    """Where a recording goes: a split bag as a folder. Raises UserError where the name is taken."""
    name = bag.name_of(recording)
    parts = bag.parts_of(recording)
    suffix = parts[0].suffix
    target = folder.path / "recordings" / f"{name.replace('.', '_')}{suffix * (len(parts) == 1)}"
    if target.exists():
        raise UserError(f"{target}: is another recording; give {recording} another name")
    return target


def _link(recording: Path, target: Path) -> None:
    """Have a recording there too: by hard links, or copies where the disk is another one."""
    parts = bag.parts_of(recording)

    def link(source: Path, to: Path) -> None:
        try:
            os.link(source.resolve(), to)
        except OSError:
            shutil.copyfile(source, to)

    if len(parts) == 1:
        with replacing(target) as temporary:
            link(parts[0], temporary)
    else:
        with replacing_folder(target) as temporary:
            for part in parts:
                link(part, temporary / part.name)


def _copy_masks(recording: Path, target: Path) -> None:
    source, goal = masks_beside(recording), masks_beside(target)
    if not source.is_dir() or (goal.exists() and goal.samefile(source)):
        return
    with replacing_folder(goal) as temporary:
        for mask in source.iterdir():
            if MASK_NAME.fullmatch(mask.name) and mask.is_file():
                shutil.copyfile(mask, temporary / mask.name)


def _episodes(
    folder: BandFolder, recording: Path, settings: Settings, steps: Steps
) -> list[Episode]:
    """The episodes of a recording, made where they are not kept; with what a card shows of it."""
    place = folder.episodes(recording, settings)
    try:
        return Episode.load_all(place)
    except NotMade:
        pass
    from sling2sim2real.card.camera import Pictures
    from sling2sim2real.recording.build import build_episodes  # Open3D takes seconds to import

    episodes, refused = build_episodes(recording, folder.name, settings)
    for reason in refused:
        steps.say(printable(f"warning: left out: {reason}"))
    with replacing_folder(place) as temporary:
        for number, episode in enumerate(episodes, 1):
            episode.save(temporary / str(number))
            force = episode.metadata["preprocessing"]["peak_force"]
            steps.say(
                printable(
                    f"{recording.name}, pull {number}: release at {episode.release_time:.3f} s,"
                    f" peak force {force:.2f} N, {len(episode.clouds)} clouds"
                )
            )
            for caution in episode.cautions:
                steps.say(printable(f"- but {caution['what']}"))
        pictures = Pictures.of(recording, episodes[0], settings.setup)
        pictures.around(episodes[0]).save(temporary / "pictures")
    return episodes


def _identified(folder: BandFolder, episodes: Sequence[Episode], steps: Steps) -> Identification:
    """What theta.json says, or is to say."""
    try:
        found = Identification.load(folder.theta)
        if read_json(folder.theta, JsonRecord).model_dump()["digest"] == folder.digest:
            return found
    except (UserError, KeyError):
        pass
    settings, progress = folder.settings, steps.say
    steps.begin(START)
    start = _start(folder, episodes[0], steps)
    steps.begin(DENSITY)
    usual = settings.trials.actuation_error
    launches = observed(folder.launches, usual)
    found = identify(
        episodes, folder.band, launches=launches, settings=settings, start=start, progress=progress
    )
    found.save(folder.theta, folder.digest)
    return found


def _start(folder: BandFolder, episode: Episode, steps: Steps) -> Model:
    """Where the density begins, which no launch changes."""
    settings, band = folder.settings, folder.band
    digest = fingerprint(
        folder.episodes(folder.recordings[0]).name, settings.model_dump_json(), repr(vars(band))
    )
    try:
        file = read_json(folder.start, _Start)
        if file.digest == digest:
            theta = Theta.of(file.names, np.array(file.point))
            return Model(band, theta, file.mounting, settings=settings)
    except NotMade:
        pass
    start = starting_model(episode, band, settings=settings, progress=steps.say)
    content = {
        "digest": digest,
        "names": start.theta.names,
        "point": start.theta.point.tolist(),
        "mounting": start.mounting and start.mounting.model_dump(),
    }
    write_json(folder.start, content)
    return start


def _with_policy(folder: BandFolder, found: Identification, steps: Steps) -> Identification:
    """The band with a policy of its θ, trained where that is not there."""
    from sling2sim2real.settings.provenance import policy_settings_of

    stored, settings, name = Stored.of_band(folder.path), found.settings, folder.name
    content = found.content()
    try:
        card = stored.card()
        made_with = policy_settings_of(settings, name)
        if card["theta"] == content["theta"] and card["made_with"] == made_with:
            return replace(found, policy=stored)
    except NotMade:
        pass
    from sling2sim2real.policy.make import make_policy

    steps.begin(POLICY)
    history, whose = found.launch_setup.history, (settings, name, METHOD, content)
    steps.say(make_policy(stored, found.launches, *whose, history=history))
    return replace(found, policy=stored)


def _card(folder: BandFolder, found: Identification, episodes: Sequence[Episode]) -> dict:
    """What card.json says, of a card that is made where it is not of today."""
    try:
        card = read_json(folder.card / "card.json", JsonRecord).model_dump()
        with_policy = (folder.card / "card.json").stat().st_mtime_ns
        network = Stored.of_band(folder.path).network
        newer = network.is_file() and network.stat().st_mtime_ns > with_policy
        if card.pop("digest", None) == folder.digest and not newer:
            return card
    except NotMade:
        pass
    from sling2sim2real.card.camera import Pictures
    from sling2sim2real.card.inputs import CardInputs, aims_of, checked
    from sling2sim2real.card.write import write

    targets = np.array(found.settings.trials.targets, float)
    draws = np.array([draw_for(found, target) for target in targets])
    inputs = CardInputs(
        found=found,
        method=METHOD,
        episodes=episodes,
        launched=checked(found, folder.launches),
        aims=aims_of(found, targets, draws),
        trained=found.policy and found.policy.card()["training"]["converged"],
        assumed=folder.file.assumed,
    )
    pictures = Pictures.load(folder.episodes(folder.recordings[0]) / "pictures", episodes[0])
    return write(folder.card, inputs, pictures, folder.digest)


def _forget(folder: BandFolder) -> None:
    """Throw away episodes that nothing is made of any more."""
    kept = {folder.episodes(recording) for recording in folder.recordings}
    for place in (folder.path / "episodes").iterdir():
        if place not in kept:
            shutil.rmtree(place, ignore_errors=True)


def shown(card: dict) -> str:
    """What a card says, on one screen: verdict, draws, advice; values stand on the card."""
    draws = [
        {
            "target [m]": f"{row['target_m']:.3f}",
            "draw y, z [m]": f"{row['draw_y_m']:.4f}, {row['draw_z_m']:.4f}",
            "lands at [m]": _number(row["predicted_landing_m"], ".3f", "fails in simulation"),
            "90 % interval": " to ".join(_number(end, ".3f") for end in row["interval_90_m"] or []),
            "force [N]": _number(row["hold_force_n"], ".1f"),
        }
        for row in card["draws"]
    ]
    lines = [f"{card['band']}: {card['verdict']}", *(f"  - {reason}" for reason in card["reasons"])]
    lines += ["", tabulate(draws, "keys", tablefmt="plain", disable_numparse=True)]
    if card["next"]:
        lines += ["", "What would help most:", *(f"  - {step}" for step in card["next"])]
    page = Path(card["card"]).with_name("index.html").resolve()
    return "\n".join([*lines, "", f"Card: {card['card']}", f"Page: {page.as_uri()}"])


def _number(value: float | None, form: str, otherwise: str = "") -> str:
    return otherwise if value is None else format(value, form)
