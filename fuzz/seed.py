#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fills corpus/ from the fixtures; run it in fuzz/.

Each .gltf whose one buffer is a data URI also goes in as .glb: there a mutation of a byte is one of a
number, which in base64 it rarely is.
"""

import base64
import glob
import json
import os
import struct

MAX_BYTES = 8000
FIXTURES = os.path.join("..", "fixtures")


def as_glb(text):
    tree = json.loads(text)
    head, data = tree["buffers"][0].pop("uri").split(",")
    if len(tree["buffers"]) != 1 or not head.endswith("base64"):
        raise ValueError("not one data URI")
    data = base64.b64decode(data)
    data += b"\0" * (-len(data) % 4)
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def put(target, name, content):
    if len(content) > MAX_BYTES:
        return
    folder = os.path.join("corpus", target)
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, name), "wb") as file:
        file.write(content)


def main():
    libraries = []
    for path in sorted(glob.glob(os.path.join(FIXTURES, "**", "*"), recursive=True)):
        # With the folders: names come more than once.
        name, ending = os.path.relpath(path, FIXTURES).replace(os.sep, "_"), os.path.splitext(path)[1]
        if ending not in (".gltf", ".glb", ".obj", ".mtl"):
            continue
        with open(path, "rb") as file:
            content = file.read()
        if ending == ".mtl":
            libraries.append(content)
        elif ending == ".obj":
            put("obj", name, content.replace(b"\0", b""))
        else:
            put("gltf", name, content)
        if ending == ".gltf":
            try:
                put("gltf", name + ".glb", as_glb(content))
            except (ValueError, KeyError, AttributeError, IndexError, TypeError, RecursionError):
                pass  # Broken on purpose: it is in as it is.
    for i, library in enumerate(libraries):
        for name in ("index_out_of_range.obj", "mtl_bad.obj"):
            with open(os.path.join(FIXTURES, "malformed", name), "rb") as file:
                put("obj", "with_library_%d_%s" % (i, name), file.read() + b"\0" + library)


main()
