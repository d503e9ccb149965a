"""``python -m app`` is ``tensatlas``."""

from app.cli.main import main

if __name__ == "__main__":  # worker processes import it too
    main()
