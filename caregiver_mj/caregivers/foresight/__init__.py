"""A caregiver that sees harm coming, and all that it knows beforehand of a house."""
