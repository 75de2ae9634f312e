"""Identify a band from arrays, as a rig without ROS has them.

    python examples/identify_from_arrays.py

Here the arrays come from a simulated pull with sensor noise, so that the truth is known; put your
own in their place. The last lines aim with the result.
"""

import sling2sim2real as s2s

BAND = s2s.Band(mass=0.023, diameter=0.010, rest_length=0.52)  # kg, m, m
SETTINGS = s2s.Settings.coarse(setup={"fork_width": 0.275})  # for results: Settings.default
TRUE = s2s.Theta(2.2e5, 0.47, 2.4e-3, 0.7, 0.6, mooney_share=0.3, relaxation=0.01)


def main() -> None:
    arrays = s2s.rehearse(s2s.Model(BAND, TRUE, settings=SETTINGS), draw=(-0.40, 0.0))
    episode = s2s.episode_from_arrays(
        time=arrays["time"],  # (S,) s, the hand's and the force's
        position=arrays["position"],  # (S, 3) m, frame O
        force=arrays["force"],  # (S, 3) N, of the band on the gripper, tared
        cloud_time=arrays["cloud_time"],  # (K,) s
        clouds=arrays["clouds"],  # K arrays (P, 3) m, of the band alone
        camera=arrays["camera"],  # (3,) m
        grasp_time=arrays["grasp_time"],
        release_time=arrays["release_time"],
        settings=SETTINGS,
    )
    identification = s2s.identify([episode], BAND, settings=SETTINGS, progress=print)

    print("settled" if identification.settled else "NOT settled")
    for name, interval in identification.intervals.items():
        true = getattr(TRUE, name, None)
        truth = "" if true is None else f", truth {true:.4g}"
        remark = "" if interval.identifiable else " (fixed, or not seen)"
        ends = f"[{interval.low:.4g}, {interval.high:.4g}]"
        print(f"{name}: {interval.value:.4g} {interval.unit} {ends}{remark}{truth}")

    aimed = s2s.aim(identification, target=2.0)
    low, high = aimed.interval_90
    y, z = aimed.draw
    print(f"draw to y {y:.3f} m, z {z:.3f} m, with {aimed.launch.hold_force:.1f} N")
    print(f"it lands at {aimed.launch.landing:.2f} m, nine of ten from {low:.2f} to {high:.2f} m")


if __name__ == "__main__":
    main()
