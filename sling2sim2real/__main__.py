"""`python -m sling2sim2real`: the `sling` command."""

from sling2sim2real.cli.cli import main

if __name__ == "__main__":
    main()
