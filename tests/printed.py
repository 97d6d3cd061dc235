"""What a study prints, as text."""

import io

from rich.console import Console


def printed(report, *arguments):
    """The text that a report prints to a console 120 characters wide."""
    text = io.StringIO()
    report(Console(width=120, file=text), *arguments)
    return text.getvalue()
