#!/usr/bin/env bash
# Makes the small datasets of tests/same_bytes: same_bytes.sh PROGRAM FOLDER WHO. Their manifests stay in FOLDER as
# WHO-<case>.sha256; those of WHO "reference" are what everybody else's must be the same as.
set -euo pipefail
program=$1
folder=$2
who=$3
mkdir -p "$folder"
rm -f "$folder/$who"-*.sha256
for name in loops oil fisheye imported; do
  rm -rf "$folder/dataset"  # in one place for all: the place of input files beside it is part of a dataset
  "$program" "$name" "$folder/dataset"
  cp "$folder/dataset/manifest.sha256" "$folder/$who-$name.sha256"
  if [ "$who" != reference ]; then
    diff "$folder/reference-$name.sha256" "$folder/$who-$name.sha256" || { echo "$name: different bytes"; exit 1; }
  fi
done
rm -rf "$folder/dataset"
[ "$who" = reference ] || echo "same bytes"
