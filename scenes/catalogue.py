"""The scenes. README.md says what each is for; numbers are here only."""

from dataclasses import replace
from math import cos, pi, sin

from model import Camera, Diffuse, Glass, Object, PointLight, Scene, Sphere
from shapes import (add, box, cross, disk, dot, hemisphere, icosphere, join, normalize, rectangle,
                    scale, sphere, square, sub, tube, turned_box, waved_grid)

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
        rough_glass(), smooth_normals(), demo(),
    ]
