"""One emulated servo drive: CANopen (CiA 301) below, the drive profile (CiA 402-2) above, a simulated axis behind."""
