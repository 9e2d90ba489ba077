"""The scenes. README.md says what each is for; numbers are here only."""

from dataclasses import replace
from math import acos, asin, atan2, cos, exp, pi, sin, sqrt

from model import (Camera, Diffuse, Glass, Image, Object, PointLight, Scene, Sphere, SpotLight, Texture,
                   Vec3)
from shapes import (add, arc, box, cross, disk, dot, hemisphere, icosphere, join, lathe, line,
                    liquid, lumps, normalize, part, rectangle, relief, scale, sphere, square, sub,
                    tube, turned_box, upright, waved_grid)

BLACK = (0.0, 0.0, 0.0)
WHITE = Diffuse("white", (0.75, 0.75, 0.75))
GLASS = Glass("glass", 1.5)


def lamp(radiance, reflectance=BLACK) -> Diffuse:
    """A lamp's surface; `radiance` a number for white light, or three."""
    rgb = radiance if isinstance(radiance, tuple) else (radiance,) * 3
    return Diffuse("lamp", reflectance, rgb)


def cornell() -> Scene:
    """A room of one metre, open to the camera, with two boxes; its lamp also reflects."""
    red = Diffuse("red", (0.61, 0.06, 0.05))
    green = Diffuse("green", (0.12, 0.44, 0.10))
    x, y, z = (0.5, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.5)
    return Scene("cornell", Camera((0.0, 0.5, 1.95), (0.0, 0.5, 0.0), 39.0), [
        Object("floor", rectangle((0.0, 0.0, 0.0), z, x), WHITE),
        Object("ceiling", rectangle((0.0, 1.0, 0.0), x, z), WHITE),
        Object("back wall", rectangle((0.0, 0.5, -0.5), x, y), WHITE),
        Object("left wall", rectangle((-0.5, 0.5, 0.0), y, z), red),
        Object("right wall", rectangle((0.5, 0.5, 0.0), z, y), green),
        Object("tall box", turned_box((-0.17, 0.301, -0.17), (0.15, 0.3, 0.15), 17.0), WHITE),
        Object("short box", turned_box((0.18, 0.151, 0.15), (0.15, 0.15, 0.15), -17.0), WHITE),
        Object("lamp", rectangle((0.0, 0.995, 0.0), (0.13, 0.0, 0.0), (0.0, 0.0, 0.11)),
               lamp((17.0, 12.0, 6.0), (0.75, 0.75, 0.75))),
    ])


# Figures 4a-4c share a stage: a panel up to the left faces a hemisphere at the origin.
FLOOR = rectangle((0.0, 0.0, 0.0), (0.0, 0.0, 1.9), (1.9, 0.0, 0.0))
PANEL_CENTER, PANEL_NORMAL = (-1.3, 1.8, -0.3), normalize((0.8, -1.0, 0.1))
PANEL = Object("panel", square(PANEL_CENTER, PANEL_NORMAL, 0.6), Diffuse("panel", (0.8, 0.8, 0.8)))
STAGE_CAMERA = Camera((0.7, 1.9, 2.9), (0.1, 0.2, 0.0), 34.0)


def leaning_hemisphere(ground: float) -> Object:
    """Leans with its dome towards the panel; the lowest point of its rim is 2 cm above `ground`."""
    radius, lean = 0.45, 40.0 * pi / 180
    toward = normalize((PANEL_CENTER[0], 0.0, PANEL_CENTER[2]))
    axis = add(scale(toward, sin(lean)), (0.0, cos(lean), 0.0))
    base = (0.0, round(ground + 0.02 + radius * sin(lean), 3), 0.0)
    return Object("hemisphere", hemisphere(base, axis, radius), GLASS)


def figure4a(name: str, half: float, distance: float) -> Scene:
    """The lamp, a square parallel to the panel and turned to it, has only the panel before it."""
    center = add(PANEL_CENTER, scale(PANEL_NORMAL, distance))
    # Beside the way from the panel to the hemisphere.
    center = add(center, scale(normalize(cross(PANEL_NORMAL, (0.0, 1.0, 0.0))), 0.35))
    scene = Scene(name, STAGE_CAMERA, [
        Object("floor", FLOOR, WHITE), PANEL, leaning_hemisphere(0.0),
        Object("lamp", square(center, scale(PANEL_NORMAL, -1.0), half),
               lamp(36.0 / (2 * half) ** 2)),
    ])
    for thing in scene.objects:
        if thing.name not in ("panel", "lamp"):
            before = max(dot(sub(center, p), PANEL_NORMAL) for p in thing.shape.positions)
            assert before < 0, f"{name}: the lamp shines on the {thing.name}"
    return scene


def figure4b(name: str, radius: float) -> Scene:
    """The lamp, a sphere, sits in a hollow glass globe; a panel stands behind."""
    center = (-0.9, 1.5, -0.2)
    globe = join(sphere(center, 0.30, 48, 24), sphere(center, 0.27, 48, 24, inward=True))
    return Scene(name, Camera((0.9, 1.9, 3.6), (-0.25, 0.65, 0.0), 42.0), [
        Object("floor", FLOOR, WHITE),
        Object("panel", rectangle((0.0, 0.9, -1.9), (1.9, 0.0, 0.0), (0.0, 0.9, 0.0)),
               Diffuse("panel", (0.35, 0.5, 0.65))),
        leaning_hemisphere(0.0),
        Object("globe", globe, GLASS),
        Object("lamp", Sphere(center, radius), lamp(25.0 / (4 * pi * radius**2))),
    ])


def figure4c(name: str, radius: float) -> Scene:
    """A torch whose front glass is a hemisphere lights the panel; the floor lies under a glass plate.

    The plate reaches past a black curb that stands from the floor up into it, so no light comes
    in under the plate; the torch's tube likewise ends inside its hemisphere.
    """
    black = Diffuse("black", BLACK)
    plate_low, plate_high = 0.02, 0.08
    curb_high, edge = 0.05, 1.9
    curb = [rectangle((sx * edge, curb_high / 2, sz * edge), u, (0.0, curb_high / 2, 0.0))
            for sx, sz, u in ((0, 1, (edge, 0.0, 0.0)), (0, -1, (-edge, 0.0, 0.0)),
                              (1, 0, (0.0, 0.0, -edge)), (-1, 0, (0.0, 0.0, edge)))]
    # The torch hangs above the right edge, out of view, and points at the panel.
    lens_center = (1.6, 2.2, 0.2)
    axis = normalize(sub(PANEL_CENTER, lens_center))
    back = add(lens_center, scale(axis, -0.2))
    return Scene(name, Camera((0.5, 2.2, 2.2), (0.0, 0.1, 0.0), 36.0), [
        Object("floor", FLOOR, WHITE), PANEL, leaning_hemisphere(plate_high),
        Object("plate", box((-2.0, plate_low, -2.0), (2.0, plate_high, 2.0)), GLASS),
        Object("curb", join(*curb), black),
        Object("torch lens", hemisphere(lens_center, axis, 0.2), GLASS),
        Object("torch tube", tube(back, add(lens_center, scale(axis, 0.05)), 0.15), black),
        Object("torch back", disk(back, scale(axis, -1.0), 0.15), black),
        Object("lamp", disk(add(back, scale(axis, 0.01)), axis, radius),
               lamp(80.0 / (pi * radius**2))),
    ])


def glass_sphere() -> Scene:
    """Ball over a floor; the point light's image by the ball lies near the floor."""
    return Scene("glass_sphere", Camera((0.4, 1.6, 2.9), (-0.1, 0.35, 0.0), 36.0), [
        Object("floor", FLOOR, WHITE),
        Object("ball", Sphere((0.0, 0.65, 0.0), 0.4), GLASS),
    ], [PointLight("point", (0.9, 3.0, 0.6), (16.0, 16.0, 16.0))])


def frosted(roughness: float = 0.1) -> Scene:
    """Ball and plate of slightly rough glass over a floor, under a small lamp."""
    glass = Glass("frosted glass", 1.5, roughness)
    return Scene("frosted", Camera((0.4, 1.8, 3.0), (0.0, 0.3, 0.0), 38.0), [
        Object("floor", FLOOR, WHITE),
        Object("ball", Sphere((-0.45, 0.6, 0.0), 0.38), glass),
        Object("plate", turned_box((0.55, 0.5, 0.0), (0.38, 0.05, 0.3), 20.0), glass),
        Object("lamp", rectangle((0.6, 3.0, 0.4), (0.05, 0.0, 0.0), (0.0, 0.0, 0.05)), lamp(1300.0)),
    ])


def slab() -> Scene:
    """Glass plate over a floor, with a bar on the floor that refraction displaces."""
    return Scene("slab", Camera((0.5, 1.7, 2.6), (0.0, 0.2, 0.0), 36.0), [
        Object("floor", FLOOR, WHITE),
        Object("bar", box((-0.9, 0.001, -0.05), (0.9, 0.08, 0.05)), Diffuse("blue", (0.1, 0.2, 0.7))),
        Object("slab", box((-0.5, 0.3, -0.5), (0.5, 0.5, 0.5)), GLASS),
        Object("lamp", rectangle((0.5, 2.2, -0.3), (0.3, 0.0, 0.0), (0.0, 0.0, 0.3)), lamp(32.0)),
    ])


def furnace(name: str, *inside: Object) -> Scene:
    """A closed room whose walls emit what they absorb: radiance 1 everywhere, in each direction."""
    albedo = (0.8, 0.5, 0.2)
    wall = Diffuse("wall", albedo, tuple(1.0 - a for a in albedo))
    return Scene(name, Camera((0.3, 0.2, 0.9), (0.0, 0.0, 0.0), 60.0),
                 [Object("room", box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0), inward=True), wall),
                  *inside])


def furnace_environment() -> Scene:
    """Nothing here absorbs; the environment is 1 everywhere."""
    return Scene("furnace_environment", Camera((0.0, 0.6, 3.2), (0.0, 0.0, 0.0), 40.0), [
        Object("diffuse ball", Sphere((-0.55, 0.0, 0.0), 0.5), Diffuse("snow", (1.0, 1.0, 1.0))),
        Object("glass ball", Sphere((0.55, 0.0, 0.0), 0.5), GLASS),
        Object("glass box", turned_box((0.0, 0.75, -0.2), (0.3, 0.2, 0.2), 30.0), GLASS),
    ], environment=(1.0, 1.0, 1.0))


def rough_glass() -> Scene:
    """A rough ball and a rough slab in the Cornell room."""
    room = cornell()
    kept = [o for o in room.objects if "box" not in o.name]
    return replace(room, name="rough_glass", objects=kept + [
        Object("rough ball", Sphere((-0.19, 0.22, 0.0), 0.2), Glass("rough glass", 1.5, 0.5)),
        Object("rough slab", turned_box((0.22, 0.26, 0.05), (0.18, 0.25, 0.04), -25.0),
               Glass("less rough glass", 1.5, 0.4)),
    ])


def smooth_normals() -> Scene:
    """Shading normals far from the geometric ones: a coarse ball on a flat floor shaded as waves."""
    return Scene("smooth_normals", Camera((0.0, 1.6, 3.0), (0.0, 0.3, 0.0), 34.0), [
        Object("floor", waved_grid(1.5, 10, 0.6), Diffuse("floor", (0.7, 0.6, 0.5))),
        Object("ball", icosphere((0.0, 0.56, 0.0), 0.55, 1), Diffuse("ball", (0.4, 0.6, 0.8))),
        Object("lamp", rectangle((0.9, 2.0, 0.9), (0.4, 0.0, 0.0), (0.0, 0.0, 0.4)), lamp(20.0)),
    ])


def demo() -> Scene:
    """Ball, lens and tinted cube on a cream floor before a blue wall."""
    lens = Glass("lens glass", 1.62)
    tinted = Glass("amber glass", 1.5, attenuation=(0.75, 0.22, 0.03))
    return Scene("demo", Camera((0.1, 1.6, 3.3), (0.05, 0.3, 0.0), 36.0), [
        Object("floor", rectangle((0.0, 0.0, 0.0), (0.0, 0.0, 2.2), (3.0, 0.0, 0.0)),
               Diffuse("cream", (0.80, 0.74, 0.64))),
        Object("wall", rectangle((0.0, 1.3, -1.5), (3.0, 0.0, 0.0), (0.0, 1.3, 0.0)),
               Diffuse("blue wall", (0.16, 0.27, 0.42))),
        Object("ball", Sphere((-0.3, 0.5, -0.3), 0.42), GLASS),
        Object("lens", hemisphere((0.5, 0.2, 0.35), normalize((0.35, 1.0, -0.45)), 0.3), lens),
        Object("cube", turned_box((0.85, 0.27, -0.55), (0.25, 0.25, 0.25), 28.0), tinted),
        Object("clay ball", icosphere((-0.95, 0.2, -0.75), 0.2, 3), Diffuse("clay", (0.7, 0.25, 0.15))),
        Object("lamp", square((0.9, 2.5, -1.1), normalize((-0.8, -2.4, 1.1)), 0.2), lamp(75.0)),
    ])


# The eye looks along z, the vertex of its cornea at the origin. Millimetres.
CORNEA_OUTER, CORNEA_INNER, CORNEA_THICKNESS = 7.8, 6.5, 0.55
EYE_RADIUS, EYE_CENTER = 11.5, -12.57
LIMBUS, PUPIL, IRIS_OUTER = 5.4, 1.9, 5.6


def iris_height(r: float, a: float) -> float:
    """Leans to the front and rolls back into the pupil; fibres, collarette, furrows."""
    base = -3.45 - 0.1 * (r - PUPIL) - 0.6 * exp(-((r - 1.75) / 0.2) ** 2)
    fibres = 0.05 * sin(24 * a + 2.0 * sin(5 * a + 1.5 * r)) + 0.04 * sin(17 * a - 2.2 * r)
    collarette = 0.12 * exp(-((r - 2.9 - 0.15 * sin(9 * a)) / 0.2) ** 2)
    furrows = 0.03 * sin(2 * pi * r / 0.55) if r > 3.6 else 0.0
    rim = 1.0 - exp(-((IRIS_OUTER - r) / 0.4) ** 2)
    return base + rim * (fibres + collarette + furrows)


def iris_zone(p) -> str:
    r, a = 1000 * sqrt(p[0] ** 2 + p[1] ** 2), atan2(p[1], p[0])
    if r < 2.9 + 0.25 * sin(9 * a) + 0.1 * sin(22 * a):
        return "amber"
    return "blue" if sin(24 * a + 2.0 * sin(5 * a + 1.5 * r)) > -0.3 else "dark blue"


def eye(name: str, small: bool) -> Scene:
    """Cornea and aqueous humour end inside the opaque shell of sclera and iris.

    The lamp, a square of 8 cm turned to the wall or a spot close to it, has 5 W.
    """
    mm, origin, axis = 0.001, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)

    def turned(pieces, segments=96):
        pieces = [[(r * mm, h * mm, nr, nh) for r, h, nr, nh in p] for p in pieces]
        return lathe(origin, axis, pieces, segments)

    def capped(center, radius, edge, back):
        start = acos(edge / radius)
        rim = center + radius * sin(start)
        return turned([line(0.0, back, edge, back), line(edge, back, edge, rim),
                       arc(center, radius, start, pi / 2, 24)])

    lip = acos(LIMBUS / EYE_RADIUS)
    shell = turned([arc(EYE_CENTER, EYE_RADIUS, -pi / 2, lip, 48),
                    line(LIMBUS, EYE_CENTER + EYE_RADIUS * sin(lip), LIMBUS, -5.0)])
    iris = relief(origin, axis, 1.75 * mm, IRIS_OUTER * mm, 36, 240,
                  lambda r, a: mm * iris_height(r / mm, a))
    colors = {"amber": (0.62, 0.44, 0.24), "blue": (0.36, 0.5, 0.6), "dark blue": (0.2, 0.3, 0.42)}
    wall_center = (0.4, 0.13, 0.15)
    toward_eye = scale(normalize(wall_center), -1.0)
    objects = [
        Object("cornea", capped(-CORNEA_OUTER, CORNEA_OUTER, 6.15, -4.9), Glass("cornea", 1.376)),
        Object("aqueous", capped(-CORNEA_THICKNESS - CORNEA_INNER, CORNEA_INNER, 5.6, -4.6),
               Glass("aqueous", 1.336, exterior=1.376)),
        Object("sclera", shell, Diffuse("sclera", (0.66, 0.61, 0.57))),
        *(Object(f"iris {color}", part(iris, lambda p: iris_zone(p) == color), Diffuse(color, rgb))
          for color, rgb in colors.items()),
        Object("pupil", disk((0.0, 0.0, -4.0 * mm), axis, PUPIL * mm), Diffuse("pupil", BLACK)),
        Object("wall", square(wall_center, toward_eye, 0.2), Diffuse("wall", (0.8, 0.8, 0.8))),
    ]
    watts, lights = 5.0, []
    if small:
        # A cone of 15 degrees, 11 cm from the wall: 1.7 % of its area.
        place = add(wall_center, scale(toward_eye, 0.11))
        cone = 2 * pi * (1.0 - cos(15.0 * pi / 180))
        lights = [SpotLight("lamp", place, wall_center, (watts / cone,) * 3, 14.9, 15.0)]
    else:
        # Above the way from the wall to the eye.
        up = cross(normalize(cross(toward_eye, (0.0, 1.0, 0.0))), toward_eye)
        place = add(wall_center, add(scale(toward_eye, 0.16), scale(up, 0.16)))
        normal = normalize(sub(wall_center, place))
        objects.append(Object("lamp", square(place, normal, 0.04), lamp(watts / (pi * 0.08**2))))
        for thing in objects:
            if thing.name not in ("wall", "lamp"):
                before = max(dot(sub(p, place), normal) for p in thing.shape.positions)
                assert before < 0, f"{name}: the lamp shines on the {thing.name}"
    return Scene(name, Camera((-0.02, 0.008, 0.09), (0.0, 0.0, -0.003), 10.5), objects, lights)


# Amplitude, wave number along x and z, phase.
WAVES = [(0.0024, 31.0, 14.0, 0.3), (0.0020, -19.0, 38.0, 1.1), (0.0015, 47.0, -22.0, 2.0),
         (0.0011, 12.0, 61.0, 4.4), (0.0007, -66.0, -41.0, 5.2)]


def water(name: str, half: float) -> Scene:
    """A tiled basin; the water ends inside its walls and under its tiles. The lamp has 45 W."""
    level, tile = 0.42, 0.15

    def surface(x, z):
        h, slope_x, slope_z = level, 0.0, 0.0
        for height, kx, kz, phase in WAVES:
            h += height * sin(kx * x + kz * z + phase)
            slope_x += height * kx * cos(kx * x + kz * z + phase)
            slope_z += height * kz * cos(kx * x + kz * z + phase)
        return h, slope_x, slope_z

    tiles = [[], []]
    for i in range(8):
        for j in range(8):
            center = ((i - 3.5) * tile, 0.0, (j - 3.5) * tile)
            tiles[(i + j) % 2].append(rectangle(center, (0.0, 0.0, tile / 2), (tile / 2, 0.0, 0.0)))
    inner, outer, low, high = 0.59, 0.66, -0.05, 0.5
    walls = [box((-outer, low, inner), (outer, high, outer)),
             box((-outer, low, -outer), (outer, high, -inner)),
             box((inner, low, -inner), (outer, high, inner)),
             box((-outer, low, -inner), (-inner, high, inner))]
    center = (0.5, 2.3, 1.1)
    return Scene(name, Camera((-0.1, 1.75, 1.05), (0.0, 0.17, -0.03), 38.0), [
        Object("ground", rectangle((0.0, -0.06, 0.0), (0.0, 0.0, 2.0), (2.0, 0.0, 0.0)),
               Diffuse("ground", (0.4, 0.38, 0.35))),
        Object("light tiles", join(*tiles[0]), Diffuse("light tiles", (0.75, 0.75, 0.7))),
        Object("dark tiles", join(*tiles[1]), Diffuse("dark tiles", (0.2, 0.45, 0.55))),
        Object("basin", join(*walls), Diffuse("basin", (0.6, 0.62, 0.62))),
        Object("water", liquid(0.62, -0.02, 128, surface), Glass("water", 1.33)),
        Object("lamp", square(center, normalize(sub((0.0, level, 0.0), center)), half),
               lamp(45.0 / (pi * (2 * half) ** 2))),
    ])


def water_glass() -> Scene:
    """A tumbler, three quarters full: its walls border air and water, the water borders air."""
    mm, origin, axis = 0.001, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    rim, floor, level = 119.0, 9.5, 85.0

    def inner(h):
        return 27.5 + 5.5 * (h - floor) / (rim - floor)

    def turned(*pieces):
        pieces = [[(r * mm, h * mm, nr, nh) for r, h, nr, nh in p] for p in pieces]
        return lathe(origin, axis, pieces, 128)

    dry = turned(line(0.0, 0.5, 30.0, 0.5), line(30.0, 0.5, 36.0, rim),
                 arc(rim, 1.5, 0.0, pi, 12, middle=34.5), line(33.0, rim, inner(level), level))
    wet = turned(line(inner(level), level, 27.5, floor), line(27.5, floor, 0.0, floor))
    top = turned(line(inner(level), level, 0.0, level))
    center = (-0.22, 0.36, -0.12)
    return Scene("water_glass", Camera((0.06, 0.27, 0.42), (0.015, 0.045, 0.0), 28.0), [
        Object("table", rectangle((0.0, 0.0, 0.0), (0.0, 0.0, 0.6), (0.6, 0.0, 0.0)),
               Diffuse("table", (0.7, 0.6, 0.48))),
        Object("wall", rectangle((0.0, 0.3, -0.4), (0.6, 0.0, 0.0), (0.0, 0.3, 0.0)),
               Diffuse("wall", (0.35, 0.45, 0.5))),
        Object("glass to air", dry, GLASS),
        Object("glass to water", wet, Glass("glass in water", 1.5, exterior=1.33)),
        Object("water to air", top, Glass("water", 1.33)),
        Object("lamp", square(center, normalize(sub((0.0, 0.05, 0.0), center)), 0.005),
               lamp(1.6 / (pi * 0.01**2))),
    ])


def lumpy() -> Scene:
    """81 920 triangles of glass."""
    lobes = []
    for i in range(22):
        y, a = 1.0 - (2 * i + 1) / 22, 2.4 * i
        around = sqrt(1.0 - y * y)
        lobes.append(((around * cos(a), y, around * sin(a)), 0.17 + 0.11 * sin(2.3 * i), 17.0))
    body = lumps((0.0, 0.0, 0.0), 0.36, 6, lobes)
    lowest = min(p[1] for p in body.positions)
    body = replace(body, positions=[add(p, (0.0, 0.02 - lowest, 0.0)) for p in body.positions])
    center = (-1.0, 2.1, -0.7)
    return Scene("lumpy", Camera((0.5, 1.5, 2.6), (0.12, 0.3, 0.0), 34.0), [
        Object("floor", FLOOR, WHITE),
        Object("wall", rectangle((0.0, 1.2, -1.4), (1.9, 0.0, 0.0), (0.0, 1.2, 0.0)),
               Diffuse("wall", (0.5, 0.4, 0.35))),
        Object("body", body, GLASS),
        Object("lamp", square(center, normalize(sub((0.0, 0.4, 0.0), center)), 0.05),
               lamp(28.0 / (pi * 0.1**2))),
    ])


def window(name: str, half: float) -> Scene:
    """A room behind a pane of 10 mm that reaches into the front wall; lamp (330 W) and camera outside."""
    x, y, z, height, thick = 1.5, 1.2, 3.0, 2.4, 0.2
    left, right, low, high = -0.9, 0.9, 0.6, 1.9
    side, ground, top = x + thick, -thick, height + thick
    front = [box((-side, ground, -thick), (left, top, 0.0)),
             box((right, ground, -thick), (side, top, 0.0)),
             box((left, ground, -thick), (right, low, 0.0)),
             box((left, high, -thick), (right, top, 0.0))]
    start = 0.05 - thick
    middle = start - z / 2
    room = [rectangle((0.0, 0.0, middle), (0.0, 0.0, z / 2), (x, 0.0, 0.0)),
            rectangle((0.0, height, middle), (x, 0.0, 0.0), (0.0, 0.0, z / 2)),
            rectangle((0.0, y, start - z), (x, 0.0, 0.0), (0.0, y, 0.0))]
    center = (-1.3, 2.7, 2.7)
    return Scene(name, Camera((0.5, 1.5, 2.9), (0.0, 1.2, -0.5), 34.0), [
        Object("front wall", join(*front), Diffuse("front wall", (0.26, 0.22, 0.2))),
        Object("room", join(*room), WHITE),
        Object("left wall", rectangle((-x, y, middle), (0.0, y, 0.0), (0.0, 0.0, z / 2)),
               Diffuse("left wall", (0.65, 0.35, 0.25))),
        Object("right wall", rectangle((x, y, middle), (0.0, 0.0, z / 2), (0.0, y, 0.0)),
               Diffuse("right wall", (0.3, 0.5, 0.35))),
        Object("table", turned_box((0.35, 0.36, -1.3), (0.4, 0.35, 0.3), 20.0),
               Diffuse("table", (0.6, 0.45, 0.3))),
        Object("ball", Sphere((0.3, 0.92, -1.3), 0.2), Diffuse("ball", (0.3, 0.4, 0.7))),
        Object("pane", box((left - 0.05, low - 0.05, -0.105), (right + 0.05, high + 0.05, -0.095)),
               GLASS),
        Object("lamp", square(center, normalize(sub((0.0, 1.0, -1.0), center)), half),
               lamp(330.0 / (pi * (2 * half) ** 2))),
    ])


def pane_sphere() -> Scene:
    """A ball over a floor under a point light, all behind a pane that fills the view."""
    return Scene("pane_sphere", Camera((0.2, 1.3, 3.4), (0.0, 0.45, 0.0), 32.0), [
        Object("floor", FLOOR, WHITE),
        Object("wall", rectangle((0.0, 1.2, -1.6), (1.9, 0.0, 0.0), (0.0, 1.2, 0.0)),
               Diffuse("wall", (0.35, 0.45, 0.6))),
        Object("ball", Sphere((0.1, 0.5, 0.0), 0.4), GLASS),
        Object("pane", box((-1.2, 0.02, 1.5), (1.2, 2.0, 1.51)), GLASS),
    ], [PointLight("point", (0.9, 2.4, -0.5), (11.0, 11.0, 11.0))])


def prism() -> Scene:
    """A prism of dense flint (SF11) and a ball of the same on a floor; a spot light that shines through the prism at the angle
    of least deviation, and another one on the ball."""
    flint = Glass("flint", 1.7847, abbe=25.76)
    center, side = (-0.35, -0.35), 0.3
    # Within it, light goes parallel to its base, turned by half the deviation.
    turn = asin(1.7847 / 2) - pi / 6
    along, across = (cos(turn), sin(turn)), (-sin(turn), cos(turn))
    height = side * sqrt(3) / 2

    def corner(u: float, v: float) -> tuple[float, float]:
        """Of (z, x)."""
        return (center[1] + along[1] * u + across[1] * v, center[0] + along[0] * u + across[0] * v)

    corners = [corner(0.0, -height * 2 / 3), corner(side / 2, height / 3), corner(-side / 2, height / 3)]
    # The middle of the side where light enters.
    z, x = corner(-side / 4, -height / 6)
    return Scene("prism", Camera((0.15, 1.3, 1.6), (0.12, 0.05, -0.08), 34.0), [
        Object("floor", FLOOR, WHITE),
        Object("prism", upright(corners[::-1], 0.002, 0.25), flint),
        Object("ball", icosphere((0.55, 0.162, -0.3), 0.16, 5), flint),
    ], [SpotLight("beam", (-2.2, 0.75, z), (x, 0.13, z), (140.0, 140.0, 140.0), 0.7, 0.9),
        SpotLight("lamp", (1.6, 1.4, -1.1), (0.55, 0.16, -0.3), (5.0, 5.0, 5.0), 9.0, 10.0)],
        environment=(0.04, 0.04, 0.05))


def sky_image(width: int, height: int) -> Image:
    """A clear sky over dark ground, with a hazy sun of a few degrees at 45 degrees above +x and +z. Halves hold it exactly
    to 11 bits."""
    sun = normalize((0.6, 0.8, 0.5))

    def pixel(column: int, row: int) -> Vec3:
        longitude, latitude = pi * (1 - (2 * column + 1) / width), pi * (0.5 - (row + 0.5) / height)
        d = (cos(latitude) * sin(longitude), sin(latitude), cos(latitude) * cos(longitude))
        if d[1] < 0:
            return (0.12, 0.1, 0.08)
        angle = acos(min(1.0, dot(d, sun)))
        glow = 150.0 * exp(-((angle / 0.06) ** 2)) + 0.6 * exp(-angle / 0.3)
        zenith = d[1]
        return (0.55 - 0.4 * zenith + glow, 0.65 - 0.35 * zenith + 0.9 * glow, 0.8 - 0.15 * zenith + 0.7 * glow)

    return Image("sky", [[pixel(column, row) for column in range(width)] for row in range(height)])


def sky() -> Scene:
    """Two balls of glass and one of clay on a floor, under a sky with a sun."""
    return Scene("sky", Camera((0.3, 1.0, 3.7), (0.0, 0.6, 0.0), 36.0), [
        Object("floor", FLOOR, WHITE),
        Object("ball", Sphere((-0.55, 0.5, 0.1), 0.42), GLASS),
        Object("lens", Sphere((0.5, 0.3, -0.35), 0.26), Glass("lens glass", 1.62)),
        Object("clay", Sphere((0.75, 0.25, 0.55), 0.25), Diffuse("clay", (0.7, 0.25, 0.15))),
    ], [], (1.0, 1.0, 1.0), sky_image(128, 64), 20.0)


def water_glass_sky() -> Scene:
    """The tumbler under that sky, in place of its lamp."""
    lit = water_glass()
    return replace(lit, name="water_glass_sky", objects=[o for o in lit.objects if o.name != "lamp"],
                   environment=(1.0, 1.0, 1.0), sky=sky_image(128, 64), turn=20.0)


def tiles() -> Texture:
    """Two by two tiles of two colours, with joints, each a little uneven."""
    colors, joint = [(196, 176, 150), (122, 132, 140)], (86, 80, 76)

    def texel(x: int, y: int) -> tuple[int, int, int]:
        if x % 16 == 0 or y % 16 == 0:
            return joint
        color = colors[(x // 16 + y // 16) % 2]
        grain = (x * 7 + y * 13 + x * y * 5) % 11 - 5
        return tuple(c + grain for c in color)

    return Texture("tiles", tuple(tuple(texel(x, y) for x in range(32)) for y in range(32)))


def rose() -> Texture:
    """A rose window: petals around a disk, in a frame of panes, with lead between them."""
    lead = (4, 4, 4)
    petals = [(225, 40, 45), (250, 190, 40), (40, 110, 225), (70, 190, 95), (190, 70, 200), (250, 120, 40)]
    panes = [(170, 205, 240), (240, 235, 200), (185, 225, 195)]
    side = 64

    def texel(column: int, row: int) -> tuple[int, int, int]:
        x, y = (2 * column + 1) / side - 1, (2 * row + 1) / side - 1
        radius, turn = (x * x + y * y) ** 0.5, atan2(y, x) / (2 * pi) % 1.0
        if max(abs(x), abs(y)) > 0.95:
            return lead
        if radius < 0.24:
            return lead if radius > 0.2 else (255, 235, 160)
        if radius < 0.88:
            sector = turn * 12
            near = abs(sector - round(sector)) * radius * 2 * pi / 12
            return lead if near < 0.02 or radius > 0.82 or abs(radius - 0.52) < 0.02 else \
                petals[(int(sector) + (3 if radius > 0.52 else 0)) % 6]
        if abs(abs(x) - abs(y)) < 0.04:
            return lead
        return panes[(int(x > 0) + 2 * int(y > 0)) % 3]

    return Texture("rose", tuple(tuple(texel(x, y) for x in range(side)) for y in range(side)))


def stained_glass(name: str, lamp_size: float) -> Scene:
    """Light of a lamp through a pane of stained glass onto tiles, and a clear ball in it."""
    floor = rectangle((0.0, 0.0, 0.0), (0.0, 0.0, 2.0), (2.0, 0.0, 0.0))
    floor = replace(floor, coordinates=[(2.5 * x, 2.5 * z) for x, _, z in floor.positions])
    low, high = (-0.6, 0.12, -0.41), (0.6, 1.32, -0.39)
    pane = box(low, high)
    pane = replace(pane, coordinates=[((x - low[0]) / 1.2, (high[1] - y) / 1.2) for x, y, _ in pane.positions])
    return Scene(name, Camera((0.55, 1.15, 3.3), (0.0, 0.5, 0.0), 36.0), [
        Object("floor", floor, Diffuse("tiles", (0.9, 0.9, 0.9), texture=tiles())),
        Object("wall", rectangle((0.0, 1.5, -1.9), (2.0, 0.0, 0.0), (0.0, 1.5, 0.0)), Diffuse("wall", (0.6, 0.58, 0.55))),
        Object("pane", pane, Glass("stained glass", 1.52, texture=rose())),
        Object("ball", Sphere((0.62, 0.25, 0.75), 0.25), GLASS),
        Object("lamp", square((0.0, 1.9, -1.55), normalize((0.0, -0.6, 0.8)), lamp_size / 2),
               lamp(tuple(c / lamp_size**2 for c in (9.0, 8.5, 7.8)))),
    ])


def scenes() -> list[Scene]:
    """All, in the order of the README."""
    ball = Sphere((0.1, -0.1, -0.2), 0.45)
    return [
        cornell(),
        figure4a("figure4a", 0.1, 0.35), figure4a("figure4a_small", 0.01, 0.35),
        figure4a("figure4a_large", 0.3, 0.6),
        figure4b("figure4b", 0.1), figure4b("figure4b_small", 0.01),
        figure4c("figure4c", 0.1), figure4c("figure4c_small", 0.01),
        glass_sphere(), slab(),
        furnace("furnace"),
        furnace("furnace_dielectric", Object("ball", ball, GLASS)),
        furnace("furnace_rough", Object("ball", ball, Glass("rough glass", 1.5, 0.1))),
        furnace_environment(),
        rough_glass(), frosted(), smooth_normals(), demo(),
        eye("eye", False), eye("eye_small", True),
        water("water", 0.3), water("water_small", 0.005), water_glass(), lumpy(),
        window("window", 0.3), window("window_small", 0.005), pane_sphere(), prism(), sky(), water_glass_sky(), stained_glass("stained_glass", 0.1),
        stained_glass("stained_glass_large", 0.8),
    ]
