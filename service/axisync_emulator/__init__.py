"""Emulated CiA 402 drives and the simcan bus: a program of its own that shares only the drive's EDS with the service."""
