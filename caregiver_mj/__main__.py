"""`python -m caregiver_mj` is the command `caregiver-mj`."""

import sys

from caregiver_mj.cli import main

if __name__ == "__main__":
    sys.exit(main())
