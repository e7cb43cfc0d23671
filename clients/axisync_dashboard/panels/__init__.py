"""One file a panel: each builds its elements and, where it has controls, shows a `View` of the group chosen."""
