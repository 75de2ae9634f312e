"""`python -m app`: the `sling` command."""

from app.cli import main

if __name__ == "__main__":
    main()
