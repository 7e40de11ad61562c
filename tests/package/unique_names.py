# SPDX-License-Identifier: Apache-2.0
"""Every name defined in a namespace of the headers is defined once: all of them may meet in one source file.

Compiling each header together with every other takes minutes; the clashes there were are constants and types
of the same name in the `detail` of one folder.
"""
import collections
import pathlib
import re
import sys

NAMESPACE = re.compile(r"^namespace ((?:\w|::| )+) \{|^\}  // namespace")
DEFINITION = re.compile(
    r"^(?:inline constexpr [\w:<>, ]+ (\w+)\b *(?:=|\{)|(?:struct|class|enum class) (\w+)(?: final)?(?: : .*)? \{)"
)


def definitions(header):
    """(namespace, name) of the constants and types defined at namespace scope, with line numbers."""
    open_namespaces = []
    for number, line in enumerate(header.read_text().splitlines(), 1):
        if (space := NAMESPACE.match(line)) is not None:
            if space.group(1) is None:
                open_namespaces.pop()
            else:
                open_namespaces.append(space.group(1))
        elif (found := DEFINITION.match(line)) is not None:
            yield "::".join(open_namespaces), found.group(1) or found.group(2), number


def main(include):
    places = collections.defaultdict(list)
    for header in sorted(include.rglob("*.hpp")):
        for namespace, name, number in definitions(header):
            places[namespace, name].append(f"{header.relative_to(include)}:{number}")
    files = {key: {place.split(":")[0] for place in where} for key, where in places.items()}
    repeated = {key: where for key, where in places.items() if len(files[key]) > 1}  # in one file: #if branches
    for (namespace, name), where in repeated.items():
        print(f"{namespace}::{name} is defined {len(where)} times: {', '.join(where)}")
    print(f"{len(places)} names")
    return 1 if repeated or len(places) < 100 else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
