"""What people look at: pictures, films, figures, the report."""
