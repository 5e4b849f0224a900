#!/usr/bin/env bash
# Do g++ and clang++ make the same frames? compare_compilers.sh FOLDER [BUILD_FOLDER]
# FOLDER holds the manifests that the build under test made (same_bytes.sh, WHO "reference"); clang++ builds its own
# program in BUILD_FOLDER.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$1
tree=${2:-build/clang}
if ! command -v clang++ >/dev/null; then
  echo "SKIPPED: no clang++ here"
  exit 0
fi
cmake -S . -B "$tree" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=clang++ -DRUGAE_PCH=OFF \
  -DRUGAE_BENCH=OFF -DRUGAE_PYTHON=OFF >/dev/null
cmake --build "$tree" --target same_bytes
scripts/same_bytes.sh "$tree/tests/same_bytes" "$folder" clang
