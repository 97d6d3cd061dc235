"""Children: who decides their moves, and how they walk."""
