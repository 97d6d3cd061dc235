"""Children: their behaviours and their walk."""
