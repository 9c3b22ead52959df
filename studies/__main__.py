"""`python -m studies`, the same as `buckler`: list the studies and run them."""

from buckler.studies.kit.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
