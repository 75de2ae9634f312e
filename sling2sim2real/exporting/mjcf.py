"""The chain as one XML file of MuJoCo, which needs nothing of this project."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree as xml

import numpy as np

from sling2sim2real.exporting.chain import SpringChain
from sling2sim2real.simulator.model import GRAVITY

VERSION = "3.7"  # of MuJoCo: the first whose springs may be cubic
HAND_MASS_KG = 1.0  # kg
RIGID_HAND_N_PER_M = 1e6  # N/m: of a hand that does not give way
BALL_RADIUS_M = 0.02  # m: radius of the projectile's picture
AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}


def text(name: str, chain: SpringChain, keys: Mapping[str, Mapping] | None = None) -> str:
    """The model's XML.

    Args:
        name: Of the band.
        keys: Keyframes: by name, `qpos` (3 (edges + 1),) and `ctrl` (3,).
    """
    root = xml.Element("mujoco", model=name)
    gravity = _shown([0, 0, -GRAVITY])
    xml.SubElement(root, "option", timestep=_shown(chain.step), integrator="Euler", gravity=gravity)
    _defaults(root, chain)
    _bodies(xml.SubElement(root, "worldbody"), chain)
    tendons = xml.SubElement(root, "tendon")
    for i in range(chain.edges):
        for kind in ("spring", "further"):
            spring = xml.SubElement(tendons, "spatial", {"name": f"{kind}{i}", "class": kind})
            for node in (i, i + 1):
                xml.SubElement(spring, "site", site=f"node{node}")
    middle = f"node{chain.edges // 2}"
    holds = xml.SubElement(root, "equality")
    for label, other in (("hold", "hand"), ("pouch", "projectile")):
        xml.SubElement(holds, "connect", name=label, site1=other, site2=middle)
    actuators, sensors = xml.SubElement(root, "actuator"), xml.SubElement(root, "sensor")
    stiffness = _shown(chain.arm_stiffness or RIGID_HAND_N_PER_M)
    brake = _shown(2 * np.sqrt(float(stiffness) * HAND_MASS_KG))
    for axis in AXES:
        label = f"hand_{axis}"
        xml.SubElement(actuators, "position", name=label, joint=label, kp=stiffness, kv=brake)
        xml.SubElement(sensors, "actuatorfrc", name=f"hold_force_{axis}", actuator=label)
    if keys:
        frames = xml.SubElement(root, "keyframe")
        for label, key in keys.items():
            shown = {part: _shown(values) for part, values in key.items()}
            xml.SubElement(frames, "key", {"name": label, **shown})
    xml.indent(root)
    return xml.tostring(root, encoding="unicode") + "\n"


def sample(chain: SpringChain) -> dict[str, float | list[float]]:
    """What a sample changes of the file: stiffness of both tendons of a spring, damping, step."""
    first, second, _, _ = chain.cubic_springs()
    return {
        "spring": first.tolist(),
        "further": second.tolist(),
        "damping": chain.damping,
        "time_step_s": chain.step,
    }


def _defaults(root: xml.Element, chain: SpringChain) -> None:
    """Springs pull and never push; what is tied is tied within two steps."""
    defaults = xml.SubElement(root, "default")
    xml.SubElement(defaults, "geom", contype="0", conaffinity="0")
    tied = {"solref": _shown([2 * chain.step, 1]), "solimp": "0.999 0.9999 0.001"}
    xml.SubElement(defaults, "equality", tied)
    first, second, knee, _ = chain.cubic_springs()
    look = {"width": "0.004", "rgba": "0.9 0.5 0.1 1"}
    for kind, stiffness, damping, strain in (
        ("spring", first, chain.damping, 0.0),
        ("further", second, 0.0, knee),
    ):
        springs = xml.SubElement(defaults, "default", {"class": kind})
        slack = _shown([0, chain.spring_length * (1 + strain)])
        numbers = {"stiffness": _shown(stiffness), "damping": _shown(damping)}
        xml.SubElement(springs, "tendon", {"springlength": slack, **numbers, **look})


def _bodies(world: xml.Element, chain: SpringChain) -> None:
    floor = {"type": "plane", "size": "5 5 0.1", "rgba": "0.8 0.8 0.8 1"}
    place = {"name": "floor", "pos": _shown([0, 0, chain.floor])}
    xml.SubElement(world, "geom", place | floor)
    xml.SubElement(world, "light", pos="0 0 3")
    places = chain.hanging()
    for node in (0, chain.edges):
        xml.SubElement(world, "site", name=f"node{node}", pos=_shown(places[node]), size="0.008")
    for node in range(1, chain.edges):
        mass = {"mass": _shown(chain.node_mass), "pos": "0 0 0", "diaginertia": "1e-9 1e-9 1e-9"}
        body = _moving(world, f"node{node}", places[node])
        xml.SubElement(body, "inertial", mass)
    middle = places[chain.edges // 2]
    hand = _moving(world, "hand", [0, 0, 0], gravcomp="1")
    xml.SubElement(hand, "inertial", mass=_shown(HAND_MASS_KG), pos="0 0 0", diaginertia="1 1 1")
    ball = _moving(world, "projectile", middle)
    look = {"size": _shown(BALL_RADIUS_M), "rgba": "0.2 0.4 0.8 1"}
    xml.SubElement(ball, "geom", {"mass": _shown(chain.projectile_mass), **look})


def _moving(world: xml.Element, name: str, place, **options: str) -> xml.Element:
    """A body that moves along the axes, with a site to tie it by."""
    body = xml.SubElement(world, "body", {"name": name, "pos": _shown(place), **options})
    for axis, direction in AXES.items():
        xml.SubElement(body, "joint", name=f"{name}_{axis}", type="slide", axis=direction)
    xml.SubElement(body, "site", name=name, size="0.003")
    return body


def _shown(values) -> str:
    """Numbers as XML has them, to nine digits and 1e-12."""
    return " ".join(f"{value:.9g}" for value in np.round(np.atleast_1d(values), 12) + 0.0)
