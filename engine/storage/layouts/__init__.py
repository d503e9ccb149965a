"""How each format holds a run in its tables.

Read in this order:

- ``tables``: what all formats hold, whatever the columns. ``plain``: formats 1 and 2.
- ``compact``: format 3, whose columns are compressed and whose rows all have digests.
- ``bases``: controllers stored as changes of older ones. ``controllers``, ``trajectories``: these as bytes.
- ``numbers``: whole numbers and bits as bytes.
"""

from engine.storage.layouts.compact import CompactTables
from engine.storage.layouts.plain import PlainTables
from engine.storage.layouts.tables import Query, Tables


def tables_of(query: Query, version: int) -> Tables:
    """Return the tables of a run in some format."""
    return CompactTables(query) if version > 2 else PlainTables(query, version)
