"""The console script `sling`, with this project's packages first: a user may have an `app` too."""

import sys
from pathlib import Path


def main() -> None:
    """Entry point."""
    sys.path.insert(0, str(Path(__file__).parent))
    from app.cli import main

    main()
