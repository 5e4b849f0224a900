#!/usr/bin/env bash
# Does an older processor make the same frames? compare_processors.sh SAME_BYTES
# The C library and OpenCV choose their code by what the processor can do; here they are told that it can do less. (The ray
# tracer's instruction sets are compared by the tests of render/.)
set -euo pipefail
same_bytes=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for name in loops oil fisheye imported; do
  "$same_bytes" "$name" "$work/newer"
  GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-AVX512F OPENCV_CPU_DISABLE=AVX2,AVX,FP16 \
    "$same_bytes" "$name" "$work/older"
  diff "$work/newer/manifest.sha256" "$work/older/manifest.sha256" || { echo "$name: different bytes"; exit 1; }
  rm -rf "$work/newer" "$work/older"
done
echo "same bytes"
