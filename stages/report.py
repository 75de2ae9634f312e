"""Write reports/README.md, its pictures and metrics from everything that params.run names.

    python -m stages.report

Fails, and says which stage is missing, where an expected input is not there.
"""

from __future__ import annotations

from pipeline.report.report import write
from stages.start import arguments, parameters, run


def main() -> None:
    arguments()
    write(parameters())
    print("wrote reports/README.md")


if __name__ == "__main__":
    run(main)
