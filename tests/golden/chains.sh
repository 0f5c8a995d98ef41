#!/bin/bash
# chains.sh [--write] PROGRAM: runs the chains of chains.tsv and compares the SHA-256 of each output file with
# the table. Files depend on the compiler, on Blosc and on zlib too: the table holds for Debian 12 on x86-64.
# --write puts the hashes of PROGRAM into the table.
set -u
export LC_ALL=C
write=false
[ "$1" = --write ] && { write=true; shift; }
program=$(realpath "$1") || exit 2
here=$(cd "$(dirname "$0")" && pwd)
export DOCS=$here/../../docs
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir "$folder/bin"
ln -s "$program" "$folder/bin/levelsmith"
PATH=$folder/bin:$PATH
table=$folder/chains.tsv
failed=0
count=0
while IFS=$'\t' read -r name section chain expected; do
  case $name in \#*) printf '%s\t%s\n' "$name" "$section" | sed 's/\t*$//' >>"$table"; continue ;; esac
  mkdir "$folder/$name"
  cd "$folder/$name" || exit 2
  count=$((count + 1))
  found=
  if sh -ec "$chain" >../stdout 2>../stderr </dev/null; then
    found=$(sha256sum -- *.vdb *.ply *.obj *.exr *.png 2>/dev/null | awk '{ printf "%s%s=%s", sep, $2, substr($1, 1, 16); sep = " " }')
  else
    echo "$name ($section): the chain fails:" && cat ../stderr
  fi
  cd "$folder" || exit 2
  rm -r "${folder:?}/$name"
  printf '%s\t%s\t%s\t%s\n' "$name" "$section" "$chain" "$found" >>"$table"
  if [ -z "$found" ] || { ! $write && [ "$found" != "$expected" ]; }; then
    echo "$name ($section): expected $expected"
    echo "$name ($section): found    $found"
    failed=$((failed + 1))
  fi
done <"$here/chains.tsv"
echo "$count chains, $failed differ from $here/chains.tsv"
[ "$failed" -eq 0 ] && [ "$count" -ge 25 ] || exit 1
if $write; then cp "$table" "$here/chains.tsv"; fi
