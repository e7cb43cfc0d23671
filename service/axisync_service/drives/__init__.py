"""CiA 402 drives as the controller sees them: state machine, configuration, bring-up, supervision. No IO here."""
