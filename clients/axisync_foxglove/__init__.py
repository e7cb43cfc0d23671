"""The log's topics live, for Foxglove: what the daemon publishes, served over Foxglove's own WebSocket protocol."""
