"""What crosses a process or the wire: one definition of every message, record, key and name."""

SCHEMA_VERSION = 1
"""Version of the request and reply schemas; the only one served today."""
