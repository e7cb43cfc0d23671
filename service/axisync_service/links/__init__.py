"""Front's edges within the machine: sockets to the controller, the planner and the recorder; shared memory."""
