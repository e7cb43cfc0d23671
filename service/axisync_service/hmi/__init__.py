"""The network: Zenoh session, queryables, publications. The only package that imports zenoh."""
