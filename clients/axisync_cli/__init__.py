"""The `axisync` command: tables for people, `--json` for programs, one sentence for every error."""
