"""The model of safety and danger; numpy and scipy are all that it needs."""
