"""``python -m app`` is ``tensatlas``."""

from app.cli import main

main()
