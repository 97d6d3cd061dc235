"""A small house in a file, for the tests of films and viewers."""

import pytest

HOUSE = "########\n#B..S..#\n#......#\n#.C..T.#\n#...B..#\n########"


@pytest.fixture(scope="session")
def house(tmp_path_factory):
    path = tmp_path_factory.mktemp("house") / "small.txt"
    path.write_text(HOUSE)
    return str(path)
