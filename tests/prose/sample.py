#!/usr/bin/env python3
"""Draws comments and messages for a reader to explain: sample.py SEED [COMMENTS] [MESSAGES] [--key]

Shows each as a person meets it who reads that file or that code: the file's name, the enclosing declaration, and the
lines around it, the drawn line marked with ">". The reader explains them without opening a file. `--key` prints only
the file and line of each, for the person who checks the answers.
"""
import random
import re
import sys

import extract


def excerpt(name, number, above, below):
    """Lines around a line, after the nearest line above them that starts a type or a function."""
    with open(name, errors="replace") as file:
        lines = file.read().split("\n")
    first, last = max(number - 1 - above, 0), min(number + below, len(lines))
    shown = []
    for index in range(first - 1, -1, -1):
        if re.match(r"\s*((template <.*> )?(class|struct|enum) \w+.*{|\w.*\) (const )?{)$", lines[index]):
            shown = ["    " + lines[index], "      ..."]
            break
        if re.match(r"[}]", lines[index]):
            break
    return "\n".join(shown + [("  > " if i == number - 1 else "    ") + lines[i] for i in range(first, last)])


def main():
    args = [arg for arg in sys.argv[1:] if arg != "--key"]
    seed, comment_count, message_count = (int(arg) for arg in (args + ["40", "20"][len(args) - 1 :])[:3])
    draw = random.Random(seed)
    sources = [name for name in extract.tracked(extract.MODULES)]
    comments = [c for c in extract.comments(sources) if len(c[2].split()) >= 6]
    messages = list(extract.messages(sources))
    chosen = draw.sample(comments, comment_count) + draw.sample(messages, message_count)
    for index, (name, number, text) in enumerate(chosen, 1):
        if "--key" in sys.argv:
            print(f"{index}. {name}:{number}")
            continue
        print(f"--- {index}. {'comment' if index <= comment_count else 'message'} in {name}")
        print(text)
        print(excerpt(name, number, *((4, 7) if index <= comment_count else (4, 3))))


if __name__ == "__main__":
    main()
