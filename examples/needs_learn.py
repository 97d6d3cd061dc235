"""Says in one line what is missing where the extra `learn` is not installed. Import it first."""

try:
    import sb3_contrib  # noqa: F401
except ImportError as error:
    message = f"this needs the extra 'learn' ({error}): pip install -e '.[learn]' -c constraints.txt"
    raise SystemExit(message) from None
