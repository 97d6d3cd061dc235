"""The paper's world: a batch of episodes on a grid."""
