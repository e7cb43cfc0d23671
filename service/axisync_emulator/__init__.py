"""Emulated CiA 402 drives and the simcan bus: a program of its own, which shares only the EDS with the service."""
