#!/usr/bin/env python3
"""Draws comments and messages for a reader to explain: sample.py SEED [COMMENTS] [MESSAGES]

Prints each comment with the three lines of code below it, and each message, without file names. The
reader explains them without opening a file. `--key` prints the file and line of each in place of the
text, for the person who checks the answers.
"""
import random
import re
import sys

import extract


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
        print(f"--- {index}. {'comment' if index <= comment_count else 'message'}")
        print(text)
        if index <= comment_count:
            with open(name, errors="replace") as file:
                lines = file.read().split("\n")
            code = [line for line in lines[number - 1 :] if not re.match(r"\s*//", line)]
            print("\n".join("    " + line for line in code[:3]))


if __name__ == "__main__":
    main()
