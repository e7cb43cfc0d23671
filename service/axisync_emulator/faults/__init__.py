"""Faults made on purpose: on the wire of simcan, and in single drives; by script or at run time, seeded."""
