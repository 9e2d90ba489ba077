"""OpenEXR files of one part: half floats, scan lines, no compression."""

import struct


def encode(width: int, rows: list[list[tuple[float, float, float]]]) -> bytes:
    """The file's bytes; `rows` from the top, linear Rec. 709."""
    box = struct.pack("<iiii", 0, 0, width - 1, len(rows) - 1)
    # Half floats, linear, at every pixel, in the order of the names.
    channels = b"".join(name + b"\0" + struct.pack("<iB3xii", 1, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    header = b"".join(
        name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value for name, kind, value in [
            (b"channels", b"chlist", channels),
            (b"compression", b"compression", b"\0"),
            (b"dataWindow", b"box2i", box),
            (b"displayWindow", b"box2i", box),
            (b"lineOrder", b"lineOrder", b"\0"),
            (b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
            (b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0)),
            (b"screenWindowWidth", b"float", struct.pack("<f", 1)),
        ])
    start = struct.pack("<ii", 20000630, 2) + header + b"\0"
    line = 6 * width
    first = len(start) + 8 * len(rows)
    offsets = b"".join(struct.pack("<Q", first + y * (8 + line)) for y in range(len(rows)))
    lines = b"".join(
        struct.pack("<ii", y, line) + b"".join(struct.pack(f"<{width}e", *(p[c] for p in row)) for c in (2, 1, 0))
        for y, row in enumerate(rows))
    return start + offsets + lines
