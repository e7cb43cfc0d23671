"""Fixtures of the planner's tests."""

from support.motion_backends import each_backend

__all__ = ["each_backend"]
