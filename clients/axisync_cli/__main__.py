"""`python -m axisync_cli`."""

import sys

from axisync_cli.entry import main

sys.exit(main())
