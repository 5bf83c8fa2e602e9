"""``python -m cell``: the same as the command ``rbam``."""

import sys

from .cli.main import main

sys.exit(main())
