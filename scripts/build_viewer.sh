#!/usr/bin/env bash
# Builds the interactive part of the report, viewer/dist/viewer.js. Needs the network only where viewer/package-lock.json
# has changed since the last run; where nothing has changed it does nothing.
set -euo pipefail
cd "$(dirname "$0")/../viewer"

hash_of() { sha256sum "$@" | sha256sum | cut -d ' ' -f 1; }
same() { [ "$(cat "$1" 2>/dev/null)" = "$2" ]; }

libraries=$(hash_of package.json package-lock.json)
if ! same node_modules/.made-of "$libraries"; then
  echo "viewer: installing its libraries"
  npm ci --ignore-scripts --no-audit --no-fund --loglevel=error
  echo "$libraries" >node_modules/.made-of
fi

mapfile -t sources < <(find src -type f | LC_ALL=C sort)
made_of=$(hash_of package.json package-lock.json build.js "${sources[@]}")
if [ ! -f dist/viewer.js ] || ! same dist/.made-of "$made_of"; then
  node build.js
  echo "$made_of" >dist/.made-of
fi
