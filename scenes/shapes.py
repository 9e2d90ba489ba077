"""Meshes. All closed ones have outward fronts and outward normals."""

from collections.abc import Callable
from math import cos, exp, pi, sin, sqrt

from model import Mesh, Vec3

# Radius, height, and the same two of the normal.
Profile = tuple[float, float, float, float]


def add(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a: Vec3, s: float) -> Vec3:
    return (a[0] * s, a[1] * s, a[2] * s)


def dot(a: Vec3, b: Vec3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vec3, b: Vec3) -> Vec3:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def normalize(a: Vec3) -> Vec3:
    return scale(a, 1.0 / sqrt(dot(a, a)))


def frame(axis: Vec3) -> tuple[Vec3, Vec3, Vec3]:
    """Right-handed orthonormal (u, v, w) with w along `axis`."""
    w = normalize(axis)
    helper = (1.0, 0.0, 0.0) if abs(w[0]) < 0.9 else (0.0, 1.0, 0.0)
    v = normalize(cross(w, helper))
    return cross(v, w), v, w


def rectangle(center: Vec3, half_u: Vec3, half_v: Vec3) -> Mesh:
    """Front along half_u x half_v."""
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    positions = [add(center, add(scale(half_u, s), scale(half_v, t))) for s, t in corners]
    return Mesh(positions, [(0, 1, 2), (0, 2, 3)])


def square(center: Vec3, normal: Vec3, half: float) -> Mesh:
    """A square of half width `half` that faces `normal`."""
    u, v, _ = frame(normal)
    return rectangle(center, scale(u, half), scale(v, half))


def disk(center: Vec3, normal: Vec3, radius: float, segments: int = 32) -> Mesh:
    """A regular polygon that faces `normal`."""
    u, v, _ = frame(normal)
    rim = [add(center, add(scale(u, radius * cos(2 * pi * i / segments)),
                           scale(v, radius * sin(2 * pi * i / segments))))
           for i in range(segments)]
    return Mesh([center] + rim, [(0, 1 + i, 1 + (i + 1) % segments) for i in range(segments)])


def parallelepiped(center: Vec3, a: Vec3, b: Vec3, c: Vec3, inward: bool = False) -> Mesh:
    """Half edges a, b, c with (a x b) . c > 0."""
    signs = [(s, t, r) for r in (-1, 1) for t in (-1, 1) for s in (-1, 1)]
    positions = [add(center, add(scale(a, s), add(scale(b, t), scale(c, r)))) for s, t, r in signs]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for p, q, r, s in faces for t in ((p, q, r), (p, r, s))]
    if inward:
        triangles = [(p, r, q) for p, q, r in triangles]
    return Mesh(positions, triangles)


def box(low: Vec3, high: Vec3, inward: bool = False) -> Mesh:
    """Along the axes."""
    half = scale(sub(high, low), 0.5)
    return parallelepiped(add(low, half), (half[0], 0.0, 0.0), (0.0, half[1], 0.0),
                          (0.0, 0.0, half[2]), inward)


def upright(corners: list[tuple[float, float]], low: float, high: float) -> Mesh:
    """A convex polygon of (z, x), counter-clockwise seen from above, between two heights."""
    n = len(corners)
    rings = [[(x, y, z) for z, x in corners] for y in (low, high)]
    caps = [t for i in range(1, n - 1) for t in ((0, i + 1, i), (n, n + i, n + i + 1))]
    sides = [t for i in range(n) for j in [(i + 1) % n] for t in ((i, j, n + j), (i, n + j, n + i))]
    return Mesh(rings[0] + rings[1], caps + sides)


def turned_box(center: Vec3, half: Vec3, degrees: float) -> Mesh:
    """Turned about y."""
    c, s = cos(degrees * pi / 180), sin(degrees * pi / 180)
    return parallelepiped(center, (half[0] * c, 0.0, -half[0] * s), (0.0, half[1], 0.0),
                          (half[2] * s, 0.0, half[2] * c))


def sphere(center: Vec3, radius: float, segments: int = 32, rings: int = 16,
           inward: bool = False) -> Mesh:
    """Latitude-longitude mesh with smooth normals."""
    normals: list[Vec3] = [(0.0, 1.0, 0.0)]
    for r in range(1, rings):
        y, rho = cos(pi * r / rings), sin(pi * r / rings)
        normals += [(rho * sin(2 * pi * i / segments), y, rho * cos(2 * pi * i / segments))
                    for i in range(segments)]
    normals.append((0.0, -1.0, 0.0))
    last = len(normals) - 1
    triangles = []
    for i in range(segments):
        j = (i + 1) % segments
        triangles.append((0, 1 + i, 1 + j))
        for r in range(rings - 2):
            p, q = 1 + r * segments, 1 + (r + 1) * segments
            triangles += [(p + i, q + i, q + j), (p + i, q + j, p + j)]
        triangles.append((last - segments + i, last, last - segments + j))
    positions = [add(center, scale(n, radius)) for n in normals]
    if inward:
        triangles = [(p, r, q) for p, q, r in triangles]
        normals = [scale(n, -1.0) for n in normals]
    return Mesh(positions, triangles, normals)


def icosphere(center: Vec3, radius: float, subdivisions: int) -> Mesh:
    """Subdivided icosahedron with smooth normals."""
    g = (1 + sqrt(5)) / 2
    vertices = [normalize(v) for v in [
        (-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
        (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]]
    # Three vertices at edge distance from each other make a face; the triple product orients it.
    edge2 = 4 / (1 + g * g)
    near = [[abs(dot(sub(a, b), sub(a, b)) - edge2) < 1e-9 for b in vertices] for a in vertices]
    triangles = []
    for i in range(12):
        for j in range(i + 1, 12):
            for k in range(j + 1, 12):
                if near[i][j] and near[j][k] and near[i][k]:
                    outward = dot(cross(vertices[i], vertices[j]), vertices[k]) > 0
                    triangles.append((i, j, k) if outward else (i, k, j))
    for _ in range(subdivisions):
        midpoints: dict[tuple[int, int], int] = {}

        def midpoint(a: int, b: int) -> int:
            key = (min(a, b), max(a, b))
            if key not in midpoints:
                midpoints[key] = len(vertices)
                vertices.append(normalize(add(vertices[a], vertices[b])))
            return midpoints[key]

        finer = []
        for a, b, c in triangles:
            ab, bc, ca = midpoint(a, b), midpoint(b, c), midpoint(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        triangles = finer
    return Mesh([add(center, scale(n, radius)) for n in vertices], triangles, list(vertices))


def hemisphere(base: Vec3, axis: Vec3, radius: float, segments: int = 64, rings: int = 16) -> Mesh:
    """Solid hemisphere: smooth dome about `axis`, flat base around `base` with a sharp rim."""
    u, v, w = frame(axis)

    def direction(ring: int, segment: int) -> Vec3:
        theta, phi = 0.5 * pi * ring / rings, 2 * pi * segment / segments
        return add(scale(w, cos(theta)),
                   add(scale(u, sin(theta) * cos(phi)), scale(v, sin(theta) * sin(phi))))

    normals: list[Vec3] = [w]
    for r in range(1, rings + 1):
        normals += [direction(r, i) for i in range(segments)]
    positions = [add(base, scale(n, radius)) for n in normals]
    triangles = []
    for i in range(segments):
        j = (i + 1) % segments
        triangles.append((0, 1 + i, 1 + j))
        for r in range(rings - 1):
            p, q = 1 + r * segments, 1 + (r + 1) * segments
            triangles += [(p + i, q + i, q + j), (p + i, q + j, p + j)]
    rim, middle = 1 + (rings - 1) * segments, len(positions)
    positions = positions + [base] + positions[rim:]
    normals = normals + [scale(w, -1.0)] * (segments + 1)
    triangles += [(middle, middle + 1 + (i + 1) % segments, middle + 1 + i)
                  for i in range(segments)]
    return Mesh(positions, triangles, normals)


def tube(start: Vec3, end: Vec3, radius: float, segments: int = 32) -> Mesh:
    """Open cylinder, flat-shaded, front outward."""
    u, v, _ = frame(sub(end, start))
    ring = [add(scale(u, radius * cos(2 * pi * i / segments)),
                scale(v, radius * sin(2 * pi * i / segments))) for i in range(segments)]
    positions = [add(start, r) for r in ring] + [add(end, r) for r in ring]
    triangles = []
    for i in range(segments):
        j = (i + 1) % segments
        triangles += [(i, j, segments + j), (i, segments + j, segments + i)]
    return Mesh(positions, triangles)


def waved_grid(half: float, cells: int, tilt: float) -> Mesh:
    """Flat square in the plane y = 0, front up, whose vertex normals lean by up to about `tilt`."""
    positions, normals, triangles = [], [], []
    for j in range(cells + 1):
        for i in range(cells + 1):
            positions.append((half * (2 * i / cells - 1), 0.0, half * (2 * j / cells - 1)))
            normals.append(normalize((tilt * sin(2.1 * i + 0.7), 1.0, tilt * cos(1.7 * j + 0.9 * i))))
    for j in range(cells):
        for i in range(cells):
            p = j * (cells + 1) + i
            q = p + cells + 1
            triangles += [(p, q, q + 1), (p, q + 1, p + 1)]
    return Mesh(positions, triangles, normals)


def arc(center: float, radius: float, start: float, end: float, steps: int,
        middle: float = 0.0) -> list[Profile]:
    """Part of a circle about (`middle`, `center`), angles from the horizontal; the back is its inside."""
    side = 1.0 if end > start else -1.0
    angles = [start + (end - start) * i / steps for i in range(steps + 1)]
    return [(middle + radius * cos(a), center + radius * sin(a), side * cos(a), side * sin(a))
            for a in angles]


def line(r0: float, h0: float, r1: float, h1: float) -> list[Profile]:
    """From one point to another; the front is on the right."""
    length = sqrt((r1 - r0) ** 2 + (h1 - h0) ** 2)
    nr, nh = (h1 - h0) / length, (r0 - r1) / length
    return [(r0, h0, nr, nh), (r1, h1, nr, nh)]


def lathe(origin: Vec3, axis: Vec3, pieces: list[list[Profile]], segments: int) -> Mesh:
    """Surface of revolution; each piece of the profile is smooth within itself."""
    u, v, w = frame(axis)
    around = [add(scale(u, cos(2 * pi * i / segments)), scale(v, sin(2 * pi * i / segments)))
              for i in range(segments)]
    positions, normals, triangles = [], [], []
    for piece in pieces:
        rings = []
        for r, h, nr, nh in piece:
            pole = abs(r) < 1e-9
            rings.append([len(positions) + (0 if pole else i) for i in range(segments)])
            for d in around[:1] if pole else around:
                positions.append(add(origin, add(scale(d, 0.0 if pole else r), scale(w, h))))
                normals.append(w if pole and nh > 0 else scale(w, -1.0) if pole
                               else add(scale(d, nr), scale(w, nh)))
        for p, q in zip(rings, rings[1:]):
            for i in range(segments):
                j = (i + 1) % segments
                triangles += [t for t in ((p[i], p[j], q[j]), (p[i], q[j], q[i]))
                              if len(set(t)) == 3]
    return Mesh(positions, triangles, normals)


def relief(origin: Vec3, axis: Vec3, inner: float, outer: float, rings: int, segments: int,
           height: Callable[[float, float], float]) -> Mesh:
    """Annulus that faces `axis`, raised by height(radius, angle); smooth normals."""
    u, v, w = frame(axis)
    positions = []
    for k in range(rings + 1):
        r = inner + (outer - inner) * k / rings
        for i in range(segments):
            a = 2 * pi * i / segments
            flat = add(scale(u, r * cos(a)), scale(v, r * sin(a)))
            positions.append(add(origin, add(flat, scale(w, height(r, a)))))
    triangles = []
    for k in range(rings):
        for i in range(segments):
            j = (i + 1) % segments
            p, q = k * segments, (k + 1) * segments
            triangles += [(p + i, q + i, q + j), (p + i, q + j, p + j)]
    normals = [(0.0, 0.0, 0.0)] * len(positions)
    for t in triangles:
        a, b, c = (positions[i] for i in t)
        area = cross(sub(b, a), sub(c, a))
        for i in t:
            normals[i] = add(normals[i], area)
    return Mesh(positions, triangles, [normalize(n) for n in normals])


def part(mesh: Mesh, wanted: Callable[[Vec3], bool]) -> Mesh:
    """The triangles whose centre is wanted."""
    triangles = [t for t in mesh.triangles
                 if wanted(scale(add(add(*(mesh.positions[i] for i in t[:2])),
                                     mesh.positions[t[2]]), 1 / 3))]
    kept = sorted({i for t in triangles for i in t})
    number = {old: new for new, old in enumerate(kept)}
    return Mesh([mesh.positions[i] for i in kept],
                [(number[a], number[b], number[c]) for a, b, c in triangles],
                [mesh.normals[i] for i in kept])


def liquid(half: float, bottom: float, cells: int,
           surface: Callable[[float, float], Vec3]) -> Mesh:
    """A square block whose top is (height, slope along x, slope along z) = surface(x, z)."""
    count = cells + 1
    top = waved_grid(half, cells, 0.0)
    positions, normals = [], []
    for x, _, z in top.positions:
        h, slope_x, slope_z = surface(x, z)
        positions.append((x, h, z))
        normals.append(normalize((-slope_x, 1.0, -slope_z)))
    parts = [Mesh(positions, top.triangles, normals)]
    # Sides, each a fan from a lower corner, so that no vertex lies on another's edge.
    last = count * count - 1
    edges = [range(last, cells - 1, -count), range(0, last, count),
             range(last - cells, last + 1), range(cells, -1, -1)]
    for edge, out in zip(edges, [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]):
        upper = [positions[i] for i in edge]
        lower = [(p[0], bottom, p[2]) for p in (upper[0], upper[-1])]
        fan = [(0, i + 1, i) for i in range(2, count + 1)] + [(0, 1, count + 1)]
        parts.append(Mesh(lower + upper, fan, [out] * (count + 2)))
    ground = rectangle((0.0, bottom, 0.0), (half, 0.0, 0.0), (0.0, 0.0, half))
    parts.append(Mesh(ground.positions, ground.triangles, [(0.0, -1.0, 0.0)] * 4))
    return join(*parts)


def lumps(center: Vec3, radius: float, subdivisions: int,
          lobes: list[tuple[Vec3, float, float]]) -> Mesh:
    """A ball with lobes: (direction, height in radii, sharpness) each; exact normals."""
    ball = icosphere((0.0, 0.0, 0.0), 1.0, subdivisions)
    lobes = [(normalize(d), height, sharpness) for d, height, sharpness in lobes]
    positions, normals = [], []
    for d in ball.positions:
        size, gradient = 1.0, (0.0, 0.0, 0.0)
        for axis, height, sharpness in lobes:
            value = height * exp(sharpness * (dot(axis, d) - 1.0))
            size += value
            gradient = add(gradient, scale(axis, sharpness * value))
        along = sub(gradient, scale(d, dot(gradient, d)))
        positions.append(add(center, scale(d, radius * size)))
        normals.append(normalize(sub(scale(d, size), along)))
    return Mesh(positions, ball.triangles, normals)


def join(*meshes: Mesh) -> Mesh:
    """One mesh of several, which all or none have normals."""
    positions, normals, triangles = [], [], []
    for mesh in meshes:
        first = len(positions)
        positions += mesh.positions
        normals += mesh.normals
        triangles += [(a + first, b + first, c + first) for a, b, c in mesh.triangles]
    return Mesh(positions, triangles, normals)
