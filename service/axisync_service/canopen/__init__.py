"""CANopen (CiA 301) as pure codecs and state machines, one file for each protocol service. No IO here."""
