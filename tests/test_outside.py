"""Files and text from outside: no more is read than may be, and no text changes what a terminal or a page shows."""

import os

import pytest

from caregiver_mj.outside import LARGEST_JSON, LONGEST_LINE, MOST_BRACKETS, markdown, parse_json, plain, read_file


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("foresight", "foresight"),
        ("\x1b[31mred\x1b[0m\x07", "?[31mred?[0m?"),
        ("abc\u202edcba\u2066", "abc?dcba?"),
        ("two\nlines\tand\u2028more", "two lines and more"),
        ("house\ud800", "house?"),
        ("Zoë 漢字", "Zoë 漢字"),
        (5, "5"),
    ],
)
def test_what_a_terminal_would_obey_is_a_question_mark(text, shown):
    assert plain(text) == shown


def test_a_line_has_an_end():
    assert len(plain("a" * 10**7)) == LONGEST_LINE + len(" ...")


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("![x](http://a/b.png)", "![x]&#40;http&#58;//a/b.png)"),
        ("[x](javascript:alert(1))", "[x]&#40;javascript:alert(1))"),
        ("<script>", "&lt;script>"),
        ("</td><!-- <?x <javascript:a>", "&lt;/td>&lt;!-- &lt;?x &lt;javascript:a>"),
        ("a | b", "a / b"),
        ("`code`", "'code'"),
        ("# a\n\n# b", "# a # b"),
        ("< 15 % lost, 0.3 [0.1, 0.5]", "< 15 % lost, 0.3 [0.1, 0.5]"),
    ],
)
def test_text_from_outside_means_nothing_in_markdown(text, shown):
    assert markdown(text) == shown


def test_a_file_is_read_if_it_is_one_and_no_larger_than_may_be(tmp_path):
    (tmp_path / "a").write_bytes(b"1234")
    (tmp_path / "link").symlink_to("a")
    assert read_file(tmp_path / "link", 4) == b"1234"
    os.mkfifo(tmp_path / "pipe")  # to open it would wait for a writer
    (tmp_path / "zeros").symlink_to("/dev/zero")
    (tmp_path / "huge").touch()
    os.truncate(tmp_path / "huge", 10**12)
    for name, words in (
        ("pipe", "not a regular file"),
        ("zeros", "not a regular file"),
        ("huge", "at most 4 bytes"),
        (".", "Is a directory"),
    ):
        with pytest.raises(OSError, match=words):
            read_file(tmp_path / name, 4)
    with pytest.raises(OSError, match="at most 3 bytes"):
        read_file("/proc/version", 3)  # which says that it has none


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 100_000, "too deeply nested"),
        ("[" + "[]," * MOST_BRACKETS + "0]", "at most 500,000 lists and objects"),
        *((f"[{one}]", f"must be finite, got {one}") for one in ("NaN", "-Infinity", "1e999", "-1e999")),
        (" " * (LARGEST_JSON + 1), "at most 32,000,000 bytes"),
        (b"\xff", "utf-8"),
        ("1" * 5000, "4300"),
    ],
)
def test_a_json_text_costs_little(text, words):
    with pytest.raises(ValueError, match=words):
        parse_json(text)
