"""glTF 2.0, for Blender, web pages and office programs: one mesh in metres, y upwards, with a colour at each point.

Source: The Khronos Group, glTF 2.0 Specification, ISO/IEC 12113:2022.
"""

from __future__ import annotations

import base64
import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FLOAT, WHOLE, VERTICES, FACES = 5126, 5125, 34962, 34963
Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # a turn: what was z points along y


def text(points: Array, normals: Array, colours: Array, triangles: NDArray[np.int64], name: str) -> bytes:
    """Return a .gltf file with its numbers inside; ``points``, ``normals``, ``colours`` (n, 3), ``triangles`` (m, 3)."""
    content, data = _content(points, normals, colours, triangles, name)
    content["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return json.dumps(content).encode()


def binary(points: Array, normals: Array, colours: Array, triangles: NDArray[np.int64], name: str) -> bytes:
    """Return a .glb file; arguments as in ``text``."""
    content, data = _content(points, normals, colours, triangles, name)
    words = json.dumps(content).encode()
    words += b" " * (-len(words) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(words) + 8 + len(data))
    return head + struct.pack("<I4s", len(words), b"JSON") + words + struct.pack("<I4s", len(data), b"BIN\0") + data


def _content(
    points: Array, normals: Array, colours: Array, triangles: NDArray[np.int64], name: str
) -> tuple[dict[str, Any], bytes]:
    linear = np.where(
        colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4
    )  # glTF's colours are not sRGB
    places = (points @ Y_UP.T).astype("<f4")
    parts = [places, (normals @ Y_UP.T).astype("<f4"), linear.astype("<f4"), triangles.astype("<u4").ravel()]
    first = np.cumsum([0, *(part.nbytes for part in parts)]).tolist()
    views = [
        {"buffer": 0, "byteOffset": start, "byteLength": part.nbytes, "target": FACES if part.ndim == 1 else VERTICES}
        for part, start in zip(parts, first, strict=False)
    ]
    accessors: list[dict[str, Any]] = [
        {"bufferView": i, "componentType": FLOAT, "count": len(points), "type": "VEC3"} for i in range(3)
    ]
    accessors[0] |= {"min": places.min(axis=0).tolist(), "max": places.max(axis=0).tolist()}
    accessors.append({"bufferView": 3, "componentType": WHOLE, "count": triangles.size, "type": "SCALAR"})
    attributes = {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2}
    content = {
        "asset": {"version": "2.0", "generator": "darboux"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": name}],
        "meshes": [{"name": name, "primitives": [{"attributes": attributes, "indices": 3, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.6}}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": first[-1]}],
    }
    return content, b"".join(part.tobytes() for part in parts)
