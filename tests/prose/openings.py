"""Drops lines of grep -n output whose comment continues the line above it."""
import re
import sys

for line in sys.stdin:
    match = re.match(r"([^:]+):(\d+):(.*)", line.rstrip("\n"))
    if not match:
        continue
    name, number, text = match.group(1), int(match.group(2)), match.group(3)
    with open(name, errors="replace") as file:
        above = file.read().split("\n")[number - 2] if number > 1 else ""
    goes_on = re.match(r"\s*//", above) and re.match(r"\s*//", text)
    if goes_on and re.sub(r"^\s*//[/!]?\s*", "", above).strip() and not re.search(r"[.!?:]\s*$", above):
        continue
    print(line.rstrip("\n"))
