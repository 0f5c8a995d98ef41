#!/usr/bin/env bash
# Measures the prose of the tree with GNU style: prose.sh ROOT
# Fails when 20 comments or more open with What, Of or Whether, or when 3 % or more of the sentences of
# the docs, of the comments or of the messages have over 30 words. Prints the offenders.
set -euo pipefail
cd "$1"
command -v style >/dev/null || { echo "GNU style is missing; ./dev setup installs it (package diction)." >&2; exit 1; }
failed=0

openings=$(git ls-files '*.h' '*.cpp' '*.glsl' '*.inc' |
  xargs grep -nE '^[[:space:]]*///? ?(What|Of|Whether)\b|///< ?(what|of|whether)\b' |
  grep -vE '\?$' || true)
# A line that goes on from the one before it is no opening.
openings=$(printf '%s\n' "$openings" | python3 tests/prose/openings.py)
count=$(printf '%s' "$openings" | grep -c . || true)
echo "comments that open with What, Of or Whether: $count (fewer than 20)"
if [ "$count" -ge 20 ]; then printf '%s\n' "$openings" | head -40; failed=1; fi

for kind in docs comments messages; do
  text=$(python3 tests/prose/extract.py $kind)
  sentences=$(printf '%s\n' "$text" | style | awk '/ sentences,/ {print $1; exit}')
  long=$(printf '%s\n' "$text" | style -l 30 | grep -E '^\(stdin\):[0-9]+: ' || true)
  count=$(printf '%s' "$long" | grep -c . || true)
  printf '%s: %d of %d sentences have over 30 words (fewer than 3 %%)\n' $kind "$count" "$sentences"
  if [ $((count * 100)) -ge $((sentences * 3)) ]; then printf '%s\n' "$long" | head -20; failed=1; fi
done
exit $failed
