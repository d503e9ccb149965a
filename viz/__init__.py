"""Numbers become something to look at. Imports engine, never app."""
