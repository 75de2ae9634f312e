"""The paper's own results (Sling2Sim2Real, tables 1 to 4), measured by its authors on a robot.

They stand beside ours as what they are: another rubber, another rig and real launches.
"""

from __future__ import annotations

METHOD = "paper"  # its own

# Landing error [cm] by our names of band and method: mean and deviation for each of TARGETS [m] and
# over all of them; None where the paper prints N/A.
LANDING = {
    ("band1", "paper"): ((11.0, 2.0), (1.0, 1.22), (9.5, 4.3), (7.17, 2.68)),
    ("band1", "package_si"): ((13.0, 1.87), (1.5, 1.22), (9.5, 2.5), (8.0, 1.94)),
    ("band1", "real2sim2real"): (None, None, None, None),
    ("band1", "de"): ((19.0, 1.22), (11.5, 1.22), (3.0, 1.87), (11.17, 0.85)),
    ("band1", "bo"): ((16.5, 1.22), (3.0, 1.87), (8.0, 6.0), (9.17, 2.12)),
    ("band1", "adam"): ((11.0, 2.0), (20.0, 3.16), (34.5, 5.79), (21.83, 2.31)),
    ("band1", "no_covariance_no_multistart"): (
        (15.0, 1.58),
        (6.0, 1.22),
        (0.5, 2.45),
        (7.83, 5.39),
    ),
    ("band1", "no_multistart"): ((29.5, 2.92), (15.0, 3.87), (16.5, 2.0), (20.33, 7.18)),
    ("band1", "no_covariance"): ((22.5, 3.87), (1.0, 1.22), (6.5, 5.39), (10.0, 9.91)),
    ("band1", "no_work"): ((33.0, 1.0), (30.0, 1.58), (20.5, 2.45), (27.83, 5.62)),
    ("band2", "paper"): ((15.5, 1.87), (3.5, 2.0), (23.5, 2.55), (14.17, 2.16)),
    ("band2", "package_si"): ((60.0, 2.74), (34.5, 3.32), (11.0, 6.44), (35.17, 4.58)),
    ("band2", "real2sim2real"): (None, None, None, None),
    ("band3", "paper"): ((35.5, 1.87), (18.0, 1.87), (3.5, 3.39), (19.0, 2.47)),
    ("band3", "package_si"): (None, None, None, None),
    ("band3", "real2sim2real"): (None, None, None, None),
}
TARGETS = (1.725, 1.925, 2.125)
REPEATS = 5  # launches a cell
BANDS = {  # as it calls those that ours imitate
    "band1": "Band 1 (soft)",
    "band2": "Band 2 (medium)",
    "band3": "Band 3 (stiff)",
}
# Rows of its tables, in its order; the method itself comes last in each.
BENCHMARK = ("real2sim2real", "package_si", "paper")  # tables 1 and 2
OPTIMISERS = ("de", "bo", "adam", "paper")  # table 3
ABLATIONS = (  # table 4
    "no_covariance_no_multistart",
    "no_multistart",
    "no_covariance",
    "no_work",
    "paper",
)

# Identified E [Pa], nu, damping [s], friction, damping scale, and the loss.
THETA = {
    ("band1", "paper"): (9.29e5, 0.46, 1.11e-2, 0.80, 0.79, 1.9785),
    ("band1", "package_si"): (7.06e5, 0.45, 1.30e-2, 0.25, 1.00, 2.4718),
    ("band1", "real2sim2real"): (8.52e6, 0.45, 5.12e-3, 0.94, 1.00, 4.1798),
    ("band2", "paper"): (5.01e6, 0.38, 1.01e-2, 0.28, 0.77, 2.1749),
    ("band2", "package_si"): (2.23e6, 0.45, 9.38e-3, 0.25, 1.00, 2.3267),
    ("band2", "real2sim2real"): (1.63e5, 0.45, 5.13e-3, 0.61, 1.00, 4.2244),
    ("band3", "paper"): (3.33e6, 0.40, 7.89e-3, 0.40, 0.71, 0.9416),
    ("band3", "package_si"): (9.56e5, 0.45, 2.43e-2, 0.25, 1.00, 3.4290),
    ("band3", "real2sim2real"): (1.27e5, 0.45, 5.13e-3, 0.98, 1.00, 3.7900),
}
