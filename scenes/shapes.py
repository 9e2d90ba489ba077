"""Meshes. All closed ones have outward fronts and outward normals."""

from math import cos, pi, sin, sqrt

from model import Mesh, Vec3


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


def join(*meshes: Mesh) -> Mesh:
    """One mesh of several, which all or none have normals."""
    positions, normals, triangles = [], [], []
    for mesh in meshes:
        first = len(positions)
        positions += mesh.positions
        normals += mesh.normals
        triangles += [(a + first, b + first, c + first) for a, b, c in mesh.triangles]
    return Mesh(positions, triangles, normals)
