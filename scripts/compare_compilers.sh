#!/usr/bin/env bash
# Do g++ and clang++ make the same frames? compare_compilers.sh SAME_BYTES [BUILD_FOLDER]
# SAME_BYTES is the program of tests/same_bytes as the build under test made it; clang++ builds its own in BUILD_FOLDER.
set -euo pipefail
cd "$(dirname "$0")/.."
ours=$1
tree=${2:-build/clang}
if ! command -v clang++ >/dev/null; then
  echo "SKIPPED: no clang++ here"
  exit 0
fi
cmake -S . -B "$tree" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=clang++ -DRUGAE_PCH=OFF \
  -DRUGAE_BENCH=OFF -DRUGAE_PYTHON=OFF >/dev/null
cmake --build "$tree" --target same_bytes
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for name in loops oil fisheye imported; do
  "$ours" "$name" "$work/ours"
  "$tree/tests/same_bytes" "$name" "$work/theirs"
  diff "$work/ours/manifest.sha256" "$work/theirs/manifest.sha256" || { echo "$name: different bytes"; exit 1; }
  rm -rf "$work/ours" "$work/theirs"
done
echo "same bytes"
