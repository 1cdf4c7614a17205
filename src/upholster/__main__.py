"""``python -m upholster``."""

from upholster.cli import main

main()
