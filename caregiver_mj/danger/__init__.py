"""The model of safety and danger, on NumPy and SciPy alone."""
