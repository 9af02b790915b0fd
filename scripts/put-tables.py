#!/usr/bin/env python3
"""Replaces tables of a document by those that a program prints, so that nobody types figures again.

    build/release/bench/error_bench | scripts/put-tables.py docs/performance.md

Standard input has tables in Markdown; other lines are ignored. Each replaces the document's table
with the same first line. Where there is none, the script exits with 1 and leaves the document as it
is.
"""

import pathlib
import sys


def tables(lines):
    """The first line of each table, and the range of lines that it takes."""
    begin = None
    for number, line in enumerate([*lines, ""]):
        if line.startswith("|") and begin is None:
            begin = number
        elif not line.startswith("|") and begin is not None:
            yield lines[begin], range(begin, number)
            begin = None


def main():
    document = pathlib.Path(sys.argv[1])
    lines = document.read_text().splitlines()
    printed = sys.stdin.read().splitlines()
    for head, place in tables(printed):
        found = [own for own_head, own in tables(lines) if own_head == head]
        if len(found) != 1:
            print(f"{document} has {len(found)} tables that begin with {head}", file=sys.stderr)
            return 1
        lines[found[0].start : found[0].stop] = [printed[i] for i in place]
    document.write_text("\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
