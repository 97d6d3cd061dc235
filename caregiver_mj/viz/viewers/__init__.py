"""Live viewers of an episode, in a browser or in MuJoCo's window, which also let a person play."""
