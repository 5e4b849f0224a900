#!/usr/bin/env bash
# Builds everything and passes every test: test.sh [--preset release|debug|asan|ci] [ctest arguments].
set -euo pipefail
cd "$(dirname "$0")/.."
preset=release
if [ "${1:-}" = --preset ]; then
  preset=${2:?--preset needs a name}
  shift 2
fi
scripts/build.sh "$preset"
ctest --test-dir "build/$preset" --output-on-failure --parallel "$(nproc)" "$@"
