#!/usr/bin/env python3
"""Prints the prose of the tree, one paragraph a line: extract.py comments|messages|docs [FILE…]

Each line ends with a full stop, so that GNU `style` counts its sentences. Code, numbers and placeholders
become single words. With --where each line begins with its file and line number and a tab.
"""
import re
import subprocess
import sys

SOURCES = re.compile(r"^(levelset|mapping|render|apps|tests)/.*\.(h|cpp|glsl|inc)$")
MODULES = re.compile(r"^(levelset|mapping|render|apps)/.*\.(h|cpp)$")


def tracked(pattern):
    files = subprocess.run(["git", "ls-files"], capture_output=True, text=True, check=True)
    return [name for name in files.stdout.split() if re.search(pattern, name)]


def cleaned(text):
    """The sentence as `style` should see it."""
    text = re.sub(r"`[^`]*`", "code", text)
    text = re.sub(r"\[[A-Z][\w ,.§&–-]*\d\d[a-z]?[^\]]*\]", "", text)  # [Key05 §3]
    text = re.sub(r"\{[^{}]*\}", "X", text)
    text = re.sub(r"https?://\S+", "link", text)
    text = re.sub(r"\b(e\.g|i\.e|cf|etc|fig|sec|eq|vs|resp|approx)\.", r"\1", text)
    text = re.sub(r"(?<=\w)[./](?=\w)", "", text)  # 0.5, a/b, file.h
    text = re.sub(r"…|\.\.\.+", "", text)
    text = re.sub(r"[*_#>|<=≤≥±×−+/\\^~()\"“”'§→←↔≈∇φ°²³µ·]+", " ", text)
    text = re.sub(r"\s+", " ", text).strip(" -–:;,")
    return text + "." if re.search(r"\w", text) and not text.endswith((".", "?", "!")) else text


def comment_blocks(lines):
    """(line, text) of each run of comment lines, and of each comment behind code."""
    block, start = [], 0
    for number, line in enumerate(lines, 1):
        alone = re.match(r"\s*//[/!]?<?\s?(.*)$", line)
        if alone:
            text = alone.group(1)
            if re.match(r"\s*@(param|return|throws|tparam|pre|note)\b", text) or not text.strip():
                if block:
                    yield start, " ".join(block)
                block = []
                text = re.sub(r"^\s*@(param|tparam)\s+[\w,]+|^\s*@\w+", "", text)
            if not block:
                start = number
            if text.strip():
                block.append(text.strip())
            continue
        if block:
            yield start, " ".join(block)
            block = []
        behind = re.search(r"//[/!]?<?\s(.*)$", line)
        if behind and line[: behind.start()].count('"') % 2 == 0:
            yield number, behind.group(1)
    if block:
        yield start, " ".join(block)


def comments(names):
    for name in names or tracked(SOURCES):
        with open(name, errors="replace") as file:
            for number, text in comment_blocks(file.read().split("\n")):
                if re.match(r"\s*(NOLINT|clang-format|namespace\b)", text):
                    continue
                yield name, number, text


LITERAL = r'"((?:\\.|[^"\\\n])*)"'


def messages(names):
    for name in names or tracked(MODULES):
        with open(name, errors="replace") as file:
            source = file.read()
        source = re.sub(r'R"\w*\((?:.|\n)*?\)\w*"', lambda m: '""' + "\n" * m.group(0).count("\n"), source)
        source = re.sub(r"^[ \t]*//.*$|^#include.*$", "", source, flags=re.M)
        for match in re.finditer(LITERAL + r"(?:\s*" + LITERAL + ")*", source):
            text = "".join(re.findall(LITERAL, match.group(0)))
            text = re.sub(r"\\n", ". ", text).replace('\\"', '"')
            if len(re.findall(r"[A-Za-z]{2,}", text)) >= 5 and " " in text:
                yield name, source.count("\n", 0, match.start()) + 1, text


def docs(names):
    for name in names or tracked(r"^(docs/|data/|examples/)?[\w./-]*\.md$"):
        with open(name, errors="replace") as file:
            text = file.read()
        text = re.sub(r"```.*?```", lambda m: "\n" * m.group(0).count("\n"), text, flags=re.S)
        text = re.sub(r"<!--.*?-->", lambda m: "\n" * m.group(0).count("\n"), text, flags=re.S)
        paragraph, start = [], 0
        for number, line in enumerate(text.split("\n") + [""], 1):
            ends = not line.strip() or re.match(r"\s*([-*]|\d+\.)\s|#|\s*\|", line)
            if ends and paragraph:
                yield name, start, " ".join(paragraph)
                paragraph = []
            if re.match(r"\s*\|", line):
                for cell in line.strip().strip("|").split("|"):
                    if len(cell.split()) > 3:
                        yield name, number, cell
                continue
            line = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", line)
            line = re.sub(r"^\s*([-*]|\d+\.)\s+|^#+\s*", "", line)
            if line.strip():
                if not paragraph:
                    start = number
                paragraph.append(line.strip())


def main():
    args = [arg for arg in sys.argv[1:] if arg != "--where"]
    for name, number, text in {"comments": comments, "messages": messages, "docs": docs}[args[0]](args[1:]):
        text = cleaned(text)
        if text:
            print(f"{name}:{number}\t{text}" if "--where" in sys.argv else text)


if __name__ == "__main__":
    main()
