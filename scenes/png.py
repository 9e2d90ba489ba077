"""PNG out, without compression: equal texels give equal bytes on each platform."""

import struct
import zlib


def encode(rows) -> bytes:
    """Rows of (r, g, b), 8 bits each."""
    raw = b"".join(b"\0" + bytes(c for texel in row for c in texel) for row in rows)
    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + b"".join(map(chunk, (b"IHDR", b"IDAT", b"IEND"), (header, stored(raw), b"")))


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def stored(raw: bytes) -> bytes:
    """A zlib stream (RFC 1950) of blocks that are stored as they are."""
    blocks = [raw[i:i + 65535] for i in range(0, len(raw), 65535)]
    last = len(blocks) - 1
    body = b"".join(struct.pack("<BHH", i == last, len(b), len(b) ^ 65535) + b for i, b in enumerate(blocks))
    return b"\x78\x01" + body + struct.pack(">I", zlib.adler32(raw))
