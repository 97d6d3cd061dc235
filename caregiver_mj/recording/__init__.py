"""What is known of an episode afterwards."""
