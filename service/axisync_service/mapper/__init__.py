"""Maps joints to drive counts and back; the only place where both units meet."""
