#!/bin/sh
# clang-tidy on the sources that changed since the merge base with origin/main, or, on main itself, since the last
# commit: 7 s of CPU a file. A changed header is checked through its .cpp file. tidy_changed.sh BUILD [BASE]
# The build folder is configured only: without unity files, so that each source has its own compile command.
set -eu
build=$1
cd "$(dirname "$0")/.."
base=${2:-$(git merge-base HEAD origin/main 2>/dev/null || true)}
if [ -z "$base" ] || [ "$base" = "$(git rev-parse HEAD)" ]; then
  base=$(git rev-parse --verify --quiet 'HEAD~1') || { echo "clang-tidy: no earlier commit to compare with"; exit 0; }
fi
most=60  # 4 minutes on two cores; `./dev tidy` checks all
changed=$(git diff --name-only --diff-filter=d "$base" -- '*.cpp' '*.h' |
  sed 's/\.h$/.cpp/' | sort -u | while read -r file; do [ ! -f "$file" ] || echo "$file"; done)
if [ -z "$changed" ]; then
  echo "clang-tidy: no changed sources since $base"
  exit 0
fi
cmake -G Ninja -S . -B "$build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_EXPORT_COMPILE_COMMANDS=ON >/dev/null
known=$(sed -n 's/^ *"file": "\(.*\)",*$/\1/p' "$build/compile_commands.json")
sources=$(for file in $changed; do echo "$known" | grep -Fx "$PWD/$file" || true; done)
count=$(echo "$sources" | grep -c . || true)
[ "$count" -le "$most" ] || echo "clang-tidy: the first $most of $count changed sources"
[ "$count" -gt 0 ] || exit 0
echo "$sources" | head -n "$most" | xargs -P 2 -n 4 clang-tidy -p "$build" --quiet --warnings-as-errors='*' 2>/dev/null
