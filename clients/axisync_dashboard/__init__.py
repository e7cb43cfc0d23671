"""The web page of an axisync daemon: looks by default, moves after taking the lease, stops always."""
