"""The supervisor's parts: locks, shared memory and sockets of a run, the child processes and their restarts."""
