"""`python -m axisync_dashboard`."""

from axisync_dashboard.main import main

main()
