#!/usr/bin/env bash
# Installs what is missing, configures and builds: build.sh PRESET [TARGET...]. The tree is build/PRESET.
set -euo pipefail
cd "$(dirname "$0")/.."
preset=$1
shift
scripts/setup.sh
if [ ! -f "build/$preset/build.ninja" ]; then
  echo "configuring build/$preset"
  cmake --preset "$preset" >"/tmp/rugae_configure_$$.log" 2>&1 || { cat "/tmp/rugae_configure_$$.log" >&2; exit 1; }
  rm -f "/tmp/rugae_configure_$$.log"
fi
cmake --build "build/$preset" ${1:+--target "$@"}
