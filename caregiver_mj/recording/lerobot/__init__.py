"""Episodes as a LeRobot data set, version 3 of its format, written without its package.

Many episodes share a file: rows in Parquet, one for each step; frames in MP4, one for each row; and tables that say
which rows and which seconds of film are whose.
"""
