"""`python -m axisync_cli`."""

import sys

from axisync_cli.main import main

sys.exit(main())
