"""Files as accident or malice leaves them: a few changes of a good one, the same for the same seed."""

import numpy as np

TOKENS = (
    *(b"nan", b"inf", b"-inf", b"1e999", b"1e-320", b"1e99", b"-1", b"0", b"1_000", "٣".encode(), b"9" * 400),
    *(b"[", b"]", b"[[", b"{", b"}", b'"', b"'", b"'''", b",", b".", b"=", b"#", b"\n", b"\r", b"\t", b" "),
    *(b"\x00", b"\xff", b"\xef\xbb\xbf", "é".encode(), "e\u0301".encode(), b"\\u0000", b"true", b"null", b"../../x"),
    *(b"[" * 300, b"a." * 300 + b"a = 1\n", b"x" * 300, b"$\\frac$", b"2024-02-30", b"module:thing", b"%", b";"),
)


def mutated(content: bytes, random: np.random.Generator) -> bytes:
    """A file's bytes with one to four changes."""
    for _ in range(int(random.integers(1, 5))):
        content = CHANGES[int(random.integers(len(CHANGES)))](content, random)
    return content


def _span(content: bytes, random: np.random.Generator) -> slice:
    at = int(random.integers(len(content) + 1))
    return slice(at, at + int(random.integers(1, 1 + min(60, 1 + len(content) // 4))))


def _flip(content: bytes, random: np.random.Generator) -> bytes:
    if not content:
        return content
    at = int(random.integers(len(content)))
    return content[:at] + bytes([content[at] ^ (1 << int(random.integers(8)))]) + content[at + 1 :]


def _leave_out(content: bytes, random: np.random.Generator) -> bytes:
    span = _span(content, random)
    return content[: span.start] + content[span.stop :]


def _repeat(content: bytes, random: np.random.Generator) -> bytes:
    span = _span(content, random)
    return content[: span.stop] + content[span] + content[span.stop :]


def _insert(content: bytes, random: np.random.Generator) -> bytes:
    at = int(random.integers(len(content) + 1))
    return content[:at] + TOKENS[int(random.integers(len(TOKENS)))] + content[at:]


def _replace_value(content: bytes, random: np.random.Generator) -> bytes:
    """Put a token in the place of what stands between two separators, where most readers look."""
    edges = [at for at, letter in enumerate(content) if letter in b' =,\n"[]']
    if len(edges) < 2:
        return _insert(content, random)
    at = int(random.integers(len(edges) - 1))
    return content[: edges[at] + 1] + TOKENS[int(random.integers(len(TOKENS)))] + content[edges[at + 1] :]


def _swap_lines(content: bytes, random: np.random.Generator) -> bytes:
    lines = content.split(b"\n")
    one, other = random.integers(len(lines), size=2)
    lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


def _cut(content: bytes, random: np.random.Generator) -> bytes:
    return content[: int(random.integers(len(content) + 1))]


CHANGES = (_flip, _leave_out, _repeat, _insert, _insert, _replace_value, _replace_value, _swap_lines, _cut)
