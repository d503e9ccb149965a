"""What equal runs share."""

from engine.storage.reader import RunReader


def hash_of(path):
    """Return a run file's hash."""
    with RunReader(path) as reader:
        return reader.canonical_hash()
