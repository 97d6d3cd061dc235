"""The characters of a floor plan."""

WALL, FREE, STAIRWELL, CANDLE, TABLE, BIN = "#.SCTB"

LEGEND = {
    WALL: "wall",
    FREE: "free cell",
    STAIRWELL: "stairwell",
    CANDLE: "table with a candle",
    TABLE: "bare table",
    BIN: "toy bin",
}
