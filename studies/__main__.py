"""`python -m studies`: list the studies and run them."""

from studies.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
