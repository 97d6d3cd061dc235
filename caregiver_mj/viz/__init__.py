"""What people look at: pictures, films, figures, the report."""

OVERLAYS = ("danger",)  # that films have
