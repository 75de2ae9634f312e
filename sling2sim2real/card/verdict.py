"""Can a band's simulator and policy be trusted? Judged by what is known, and by nothing else.

Every limit is a constant here, with its why. What is beyond one is a reason for care, or against
any use; each says what would mend it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scipy.stats import binom, t

from sling2sim2real.api.launching import FEW_SAMPLES, MISS
from sling2sim2real.base.target import TARGET_AREA
from sling2sim2real.identification.posterior.likelihood import Tolerances
from sling2sim2real.launching.trials.spread import LEVEL

TRUSTED, CARE, NO = "can be trusted", "with care", "no"

# What the density expects of the residuals, and how often it as a root mean square is no fit at
# all: the pictures' expected millimetre stands beside a camera that is known to one or two.
FORCE, HELD, RECOIL = Tolerances().force, 2 * Tolerances().cloud, 5 * Tolerances().cloud
NO_FIT = 5.0
# Recordings of one band differ beyond what each leaves open: intervals are then as much wider.
DISAGREE = 2.0
# Of a launch's stretch over the recorded one: within it the law was seen, and shortly beyond.
FURTHER, MUCH_FURTHER = 1.03, 1.3
NEAR_LIMIT = 0.9  # of the arm's force: its own control needs some
HALF_AREA = (TARGET_AREA[1] - TARGET_AREA[0]) / 2  # m: an interval as wide is the whole target
WIDE = 0.3 * HALF_AREA
# As many launches outside their intervals are bad luck once in twenty. They share what is wrong of
# the law, so that counts alone speak against no use: they must be off by as much as WIDE too.
UNLUCKY = 0.05
# Evidence launches outside what all other evidence predicts of them: they do not confirm it.
UNCONFIRMED = 0.2
# Scores that miss to one side share a cause: said from so many on, where the mean is as sure, and
# as large a share of the intervals' half widths.
SHARED, SURE, SHARE = 5, 0.05, 1 / 3
_LEVEL = f"{100 * LEVEL:.0f} %"
# Of the weight on the hand: bending makes it a fifth heavier on sound recordings.
CARRIED = 1.5
SOLID_RUBBER = 900, 1300  # kg/m^3 of solid natural, silicone and latex rubber
# What is wrong where several of force, hand and recoil are missed.
SIZES = (
    "Weigh and measure the band again. Where force, drawn band and recoil are all off, its mass,"
    " diameter or rest length is probably wrong."
)
# A band that softens when it is drawn returns less than its pull shows.
UNSEEN = (
    "no recording unloads the band before the release. So its softening, and the energy that a"
    " launch gets back, are only assumed from other rubbers. In our tests, virtual rubbers that"
    " soften landed a quarter short."
)
ODD_LAUNCH = 0.05  # of an evidence launch that the density leaves: a draw's error is some 2 %
FAR_LAUNCH = 0.25  # of one: then the density has not taken it up


@dataclass(frozen=True)
class Findings:
    """What is known of a band, in plain numbers; SI units.

    Attributes:
        cautions: Of the recordings, in words, and what would mend them.
        settled: Whether the density's last step was small; None where the method has no density.
        effective: How many even samples its weighted ones are worth; None where that is not said.
        force, held, recoil: Worst root mean squares of all recordings [N], [m], [m].
        recoil_seen: Whether any picture shows the recoil.
        disagreement: Birge's ratio; `odd` names the recording that the others predict worst.
        at_sides: Parameters at a side of their box: label, and which side.
        stretch, recorded_stretch: Of the launches' draws, and of the pulls.
        hold_force, max_force: Of the draws, and of the arm [N].
        failures: Of the launches, in words.
        converged: Whether the policy's training did; `miss` of its landings [m].
        half_width: Widest of the landings' intervals [m]; NaN where none is known.
        sides: How far that one reaches to either side of the landing, in words [cm].
        outside, scores: Launches outside their intervals, of so many within the recorded stretch.
        off: How far those landed from where they were predicted, in the mean [m].
        bias, bias_error: Mean of landing over prediction, less 1, and its standard error.
        bias_of_half: Mean of landing less prediction, over the interval's half width.
        kind: Of those launches: measured or virtual.
        left: Largest share by which an evidence launch is off the density's landing, or speed.
        observed: Launches that are evidence.
        surprising: Of those, how many measured outside the interval that all other evidence gives.
        carried: Vertical force of the hanging band on the hand, measured over simulated; None where
            the simulated one is too small to tell.
        density: Of the band by its mass and size [kg/m^3]; None of the virtual rig's.
        unloaded: Whether a recording shows the drawn band let back.
    """

    cautions: Sequence[tuple[str, str]]
    settled: bool | None
    effective: float | None
    force: float
    held: float
    recoil: float
    recoil_seen: bool
    disagreement: float
    odd: str
    at_sides: Sequence[tuple[str, str]]
    stretch: float
    recorded_stretch: float
    hold_force: float
    max_force: float
    failures: Sequence[str]
    converged: bool
    miss: float
    half_width: float
    sides: str
    outside: int
    scores: int
    off: float
    bias: float
    bias_error: float
    bias_of_half: float
    kind: str
    left: float
    observed: int
    surprising: int
    carried: float | None
    density: float | None
    unloaded: bool

    @property
    def biased(self) -> bool:
        """Whether the scores miss to one side, by more than chance and by a share that matters."""
        if self.scores < SHARED or abs(self.bias_of_half) < SHARE:
            return False
        return bool(abs(self.bias) > t.isf(SURE / 2, self.scores - 1) * self.bias_error)


@dataclass(frozen=True)
class Reason:
    """Why not to trust; `cure` says what would mend it."""

    against: bool  # any use, rather than use without care
    text: str
    cure: str = ""


def judge(findings: Findings) -> tuple[str, list[Reason]]:
    """The verdict and what speaks against, causes before what may follow from them."""
    recorded = [Reason(False, what, cure) for what, cure in findings.cautions]
    reasons = [*recorded, *_identified(findings), *_launches(findings), *_tried(findings)]
    if not reasons:
        return TRUSTED, []
    return (NO if any(reason.against for reason in reasons) else CARE), reasons


def question(findings: Findings) -> str:
    """What to ask of a band whose mass and size are not those of solid rubber; else ""."""
    low, high = SOLID_RUBBER
    if findings.density is None or low <= findings.density <= high:
        return ""
    return (
        f"Is the band hollow? Its mass and size make {findings.density:.0f} kg/m³, and solid rubber"
        f" has {low} to {high}. If it is solid, weigh and measure it again."
    )


def reasons_of(findings: Findings, reasons: list[Reason]) -> list[str]:
    """Sentences: what speaks against; of a trusted band, why it can be trusted."""
    if reasons:
        return [reason.text for reason in sorted(reasons, key=lambda reason: not reason.against)]
    notes = [
        f"The fit settled, and the simulation meets the recording: {_met(findings)}.",
        f"Launches stretch the band to {findings.stretch:.2f} times its length, within the recorded"
        f" {findings.recorded_stretch:.2f}.",
        f"Landings are known to {findings.sides} cm or better.",
    ]
    if findings.scores:
        notes.append(inside(findings))
    if not findings.unloaded:
        notes.append(
            "No recording unloads the band, so softening and flow keep their priors. Measured"
            " launches correct for this."
        )
    if findings.observed == 1:
        notes.append("The fit uses only one measured launch.")
    return notes


def _met(findings: Findings) -> str:
    recoil = f", the recoil within {1000 * findings.recoil:.1f} mm" if findings.recoil_seen else ""
    return (
        f"the force within {findings.force:.2f} N, the drawn band within"
        f" {1000 * findings.held:.1f} mm{recoil}"
    )


def inside(findings: Findings) -> str:
    """How many scored launches landed inside their intervals, and how far off in the mean."""
    if findings.scores == 1:
        side = "inside" if not findings.outside else "outside"
        return f"The only {findings.kind} launch landed {side} its {_LEVEL} interval."
    within = findings.scores - findings.outside
    return (
        f"{within} of {launches_of(findings.scores, findings.kind)} landed inside their {_LEVEL}"
        f" intervals, {100 * findings.bias:+.1f} % from the prediction on average."
    )


def launches_of(count: int, kind: str = "") -> str:
    """Number of launches in words, in the singular for one."""
    return " ".join(filter(None, [str(count), kind, "launch" if count == 1 else "launches"]))


def _identified(findings: Findings):
    if findings.settled is None:
        yield Reason(
            False,
            "This method gives no uncertainty of its values.",
            "Use the method `posterior`, which gives intervals.",
        )
    elif not (findings.settled or findings.at_sides):
        yield Reason(
            False,
            "The fit had not settled when it ended, so values and intervals may still move.",
            "Record another pull: more data makes a fit settle.",
        )
    elif findings.effective is not None and findings.effective < FEW_SAMPLES:
        yield Reason(
            False,
            f"The effective sample size is {findings.effective:.0f}, too small to say where the"
            " intervals end.",
            "Record another pull: more data makes the posterior simpler.",
        )
    misfits = (
        ("force of the pull", findings.force, FORCE, "N", 1, "Check the force sensor and its frame,"
         " and the band's mass, diameter and rest length."),
        ("drawn band", findings.held, HELD, "mm", 1000, "Check the camera's calibration"
         " and where it stands (`/tf_static`, or `setup.camera_to_fork`)."),
        ("recoil", findings.recoil, RECOIL, "mm", 1000, "Check the camera's clock with `sling"
         " check`, and record another pull."),
    )  # fmt: skip
    if findings.carried is not None and not 1 / CARRIED < findings.carried < CARRIED:
        yield Reason(
            False,
            f"Between grasp and pull, the weight on the hand was {findings.carried:.1f} times what"
            " the band's mass gives.",
            "Weigh the band again, and check the unit and the zero of the force.",
        )
    missed = [misfit for misfit in misfits if misfit[1] > misfit[2]]
    for number, (what, size, limit, unit, factor, cure) in enumerate(missed):
        how = "does not match" if size > NO_FIT * limit else "matches only roughly"
        text = (
            f"The simulation {how} the {what}: it is {factor * size:.2g} {unit} off, and at most"
            f" {factor * limit:.2g} {unit} are expected."
        )
        first = number == 0 and len(missed) > 1
        yield Reason(size > NO_FIT * limit, text, SIZES if first else cure)
    if not findings.recoil_seen:
        yield Reason(
            False,
            "No picture shows the recoil, so the damping is only assumed from other rubbers.",
            "Record another pull with the camera on until a second after the release.",
        )
    if findings.disagreement > DISAGREE:
        odd = f" The others predict {findings.odd} worst." if findings.odd else ""
        yield Reason(
            False,
            f"The recordings differ by {findings.disagreement:.1f} times their own uncertainty."
            f"{odd}",
            "Find out what was different in the odd recording (another band, draw, clock or"
            " calibration), and leave it out if it is wrong.",
        )
    for label, side in findings.at_sides:
        yield Reason(
            False,
            f"The fitted {label} is at the {side}. The true value may lie outside.",
            "Check the force sensor's frame, mass, diameter and rest length. If they are right,"
            f" widen the bounds of {label} (`settings`).",
        )


def _launches(findings: Findings):
    for failure in findings.failures:
        yield Reason(
            True, failure, "Aim at other targets, or change the box of draws under `setup`."
        )
    share = findings.stretch / findings.recorded_stretch
    if share > FURTHER:
        yield Reason(
            share > MUCH_FURTHER,
            f"Launches stretch the band to {findings.stretch:.2f} times its length, the recording"
            f" only to {findings.recorded_stretch:.2f}: beyond it the simulator extrapolates.",
            f"Record a pull that stretches the band to {findings.stretch:.2f} times its length.",
        )
    if NEAR_LIMIT < findings.hold_force / findings.max_force <= 1:  # beyond, the launch fails
        yield Reason(
            False,
            f"Holding a draw takes {findings.hold_force:.1f} N, and the arm may hold"
            f" {findings.max_force:g} N.",
            "Aim at nearer targets, or raise `setup.max_force` if the arm can hold more.",
        )
    if findings.miss > MISS:
        yield Reason(
            True,
            f"The draw misses a target by {100 * findings.miss:.0f} cm in the simulator.",
            "Widen the box of draws (`setup.draw_y`, `setup.draw_z`), or aim at other targets.",
        )
    elif not findings.converged:
        yield Reason(
            False,
            "The policy's training did not converge.",
            "Train it longer (`policy.iterations`), or widen the box of draws.",
        )
    if findings.half_width != findings.half_width and not findings.failures:
        yield Reason(False, "The scatter of the landings is not known.")
    elif findings.half_width > WIDE:
        yield Reason(
            findings.half_width > HALF_AREA,
            f"Landings are known to {findings.sides} cm only.",
        )


def _tried(findings: Findings):
    if not (findings.scores or findings.observed):
        yield Reason(
            False, f"No launch was measured{'.' if findings.unloaded else f', and {UNSEEN}'}"
        )
    if findings.scores:
        unlucky = binom.sf(findings.outside - 1, findings.scores, 1 - LEVEL) < UNLUCKY
        if unlucky or (findings.outside and findings.off > WIDE):  # few launches are soon luck
            yield Reason(
                findings.off > (WIDE if unlucky else HALF_AREA),
                f"{findings.outside} of {launches_of(findings.scores, findings.kind)} landed"
                f" outside the {_LEVEL} interval, {100 * findings.off:.0f} cm off"
                f"{' on average' * (findings.scores > 1)}.",
                "Add a measured launch with `sling observe`.",
            )
    if findings.biased:
        side = "short" if findings.bias < 0 else "long"
        yield Reason(
            False,
            f"The {findings.scores} {findings.kind} launches landed"
            f" {abs(100 * findings.bias):.1f} % {side} on average, more than chance explains: they"
            " share a cause.",
            "Add one measured launch with `sling observe`: it removes the error that all share.",
        )
    if (
        findings.surprising
        and binom.sf(findings.surprising - 1, findings.observed, 1 - LEVEL) < UNCONFIRMED
    ):
        yield Reason(
            False,
            f"The measurements of {findings.surprising} of {launches_of(findings.observed)} used"
            f" for the fit lie outside the {_LEVEL} interval that all other data give.",
            "Measure that launch again, and another one at the same draw: a wrong draw or landing"
            " shifts all predictions.",
        )
    if findings.left > ODD_LAUNCH:
        yield Reason(
            findings.left > FAR_LAUNCH,
            f"A launch used for the fit is {100 * findings.left:.0f} % off what all data"
            " together predict.",
            "Measure that launch again: its draw or its landing may be wrong.",
        )
