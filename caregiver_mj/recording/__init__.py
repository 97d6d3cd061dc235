"""Records of episodes: columns, ledger, contacts and data sets."""
