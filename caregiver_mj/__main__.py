"""`python -m caregiver_mj` is the command `caregiver-mj`."""

import sys

from caregiver_mj.cli import main

if __name__ == "__main__":
    status = main()
    # If Ctrl-C came while Python ran source text, as for a named tuple, it would end as interrupted whatever our status
    # (CPython's `_Py_UnhandledKeyboardInterrupt`); running another text makes it forget that.
    eval("0")
    sys.exit(status)
