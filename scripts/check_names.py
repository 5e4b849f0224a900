#!/usr/bin/env python3
"""Is every type of namespace rugae defined once?

Two types of one name in two files compile and link, and the linker keeps one destructor for both (ISO C++ [basic.def.odr]):
the program then ends in a fault wherever the other one was meant. Anonymous namespaces are each file's own.
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOLDERS = ["apps", "bench", "cameras", "core", "dataset", "python", "recon", "render", "scenes", "studies", "tests",
           "trajectories", "validate"]
# Formatted as this project is, what a namespace holds stands at the start of the line.
DEFINED = re.compile(r"^(?:template .*>\s)?(?:struct|class|union|enum(?: class)?)\s+(\w+)\b(?!::)[^;]*$")


def types_of(path):
    anonymous = False
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if line == "namespace {":
            anonymous = True
        elif line == "}  // namespace":
            anonymous = False
        elif not anonymous and (found := DEFINED.match(line)):
            yield found[1], f"{path.relative_to(ROOT)}:{number}"


def main():
    places = {}
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in (".h", ".cpp"):
                for name, place in types_of(path):
                    places.setdefault(name, []).append(place)
    twice = {name: where for name, where in places.items() if len(where) > 1}
    for name, where in sorted(twice.items()):
        print(f"{name}: defined {len(where)} times: {', '.join(where)}")
    if not places:
        print(f"no types below {ROOT}")
    return 1 if twice or not places else 0


if __name__ == "__main__":
    sys.exit(main())
