"""``python -m crescentlab`` is the command line."""

from crescentlab.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
