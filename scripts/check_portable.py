#!/usr/bin/env python3
"""Fails where a library that makes frames asks the C library for sin, exp or the like: their last bits differ between
processors, and frames are to be the same bytes everywhere. check_portable.py LIBRARY.a...

core/portable_math.h has those functions from + - * / and sqrt.
"""
import re
import subprocess
import sys

FUNCTIONS = re.compile(
    r"(sin|cos|tan|sincos|asin|acos|atan|atan2|sinh|cosh|tanh|asinh|acosh|atanh|exp|exp2|exp10|expm1|log|log2|log10|log1p"
    r"|pow|hypot|cabs|cbrt|erf|erfc|tgamma|lgamma|fma)[fl]?"
)
# Files whose results are in no frame and no exact label.
MAY_ASK = {
    "pose_track.cpp": "poses of an estimate, brought to the times of the truth",
}


def asked(library):
    listing = subprocess.run(["nm", "--undefined-only", library], check=True, capture_output=True, text=True).stdout
    file = ""
    for line in listing.splitlines():
        if line.endswith(".o:"):
            file = re.sub(r"(\.cpp)?\.o:$", ".cpp", line)
            continue
        name = line.split()[-1].split("@")[0] if line.split() else ""
        if FUNCTIONS.fullmatch(name) and file not in MAY_ASK:
            yield f"{file} asks for {name}"


def main():
    found = [line for library in sys.argv[1:] for line in asked(library)]
    for line in found:
        print(line)
    print(f"{len(found)} functions of the C library in what makes frames")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
