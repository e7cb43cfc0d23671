"""The motion-control service. Data flows one way: hmi, actioner, planner, mapper, motion_controller, bus."""
