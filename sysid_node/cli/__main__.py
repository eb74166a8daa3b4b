"""``python -m sysid_node.cli`` is ``sysid``."""

import sys

from sysid_node.cli.main import main

sys.exit(main())
