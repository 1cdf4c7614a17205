"""``python -m upholster``."""

from upholster.apps.cli import main

if __name__ == "__main__":  # processes that draw load this, too
    main()
