"""Why a launch does not land: the same events and words in the simulator and on the rig.

The projectile is a point midway between the fork's rods, with nothing between them but the foot on
the floor: rods and tips never stand in its way.
"""

SLACK = "too short: the drawn band is slack"
DRAGGED = "hits the floor: still in the pouch"
NEVER_LEFT = "the projectile never left the pouch"
SHORT = "too short: the projectile fell before the fork"
FOOT = "hits the fork: too low where it passes"


def too_strong(force: float, limit: float) -> str:
    """Message that the arm may not hold the drawn band [N]."""
    return f"holding takes {force:.1f} N, more than {limit:g} N"
