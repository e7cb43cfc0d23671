"""CAN buses behind one port: socketcan (vcan0, can0) and simcan, opened through python-can."""
