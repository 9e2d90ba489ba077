"""What a scene is made of. Plain data, read by the glTF writer and by the reference renderer.

Metres, y up, right-handed. Radiance in W/(m² sr), intensity in W/sr, linear Rec. 709.
"""

from dataclasses import dataclass, field
from typing import Optional

Vec3 = tuple[float, float, float]


@dataclass(frozen=True)
class Texture:
    """Rows of texels from the top, sRGB codes of 8 bits; repeated."""

    name: str
    rows: tuple[tuple[tuple[int, int, int], ...], ...]


@dataclass(frozen=True)
class Diffuse:
    """Lambertian on both sides; emits `emission` from the front. `texture` multiplies `reflectance`."""

    name: str
    reflectance: Vec3
    emission: Vec3 = (0.0, 0.0, 0.0)
    texture: Optional[Texture] = None


@dataclass(frozen=True)
class Glass:
    """Boundary of a solid: index `ior` behind the surface, `exterior` before it.

    `roughness` is perceptual (GGX alpha is its square). `attenuation` is the colour that white
    becomes after one metre of glass, or None for clear glass. `texture` colours what crosses the boundary. `abbe` says how
    little the index varies over the spectrum, None that it does not.
    """

    name: str
    ior: float = 1.5
    roughness: float = 0.0
    attenuation: Optional[Vec3] = None
    exterior: float = 1.0
    texture: Optional[Texture] = None
    abbe: Optional[float] = None


@dataclass(frozen=True)
class Mesh:
    """Triangles in world space, counter-clockwise seen from the front; `normals` empty for flat. `coordinates` of
    textures: (0, 0) is the upper left corner of an image."""

    positions: list[Vec3]
    triangles: list[tuple[int, int, int]]
    normals: list[Vec3] = field(default_factory=list)
    coordinates: list[tuple[float, float]] = field(default_factory=list)


@dataclass(frozen=True)
class Sphere:
    """Analytic sphere, front outward."""

    center: Vec3
    radius: float


@dataclass(frozen=True)
class Object:
    """A shape with its material."""

    name: str
    shape: object
    material: object


@dataclass(frozen=True)
class PointLight:
    """The same intensity in all directions."""

    name: str
    position: Vec3
    intensity: Vec3


@dataclass(frozen=True)
class SpotLight:
    """Points at `target`: full intensity within `inner` degrees of the axis, none beyond `outer`."""

    name: str
    position: Vec3
    target: Vec3
    intensity: Vec3
    inner: float
    outer: float


@dataclass(frozen=True)
class Camera:
    """Pinhole, square image; `yfov` in degrees."""

    origin: Vec3
    target: Vec3
    yfov: float
    up: Vec3 = (0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Image:
    """Rows of pixels from the top, beside the scene in NAME.exr."""

    name: str
    rows: list[list[Vec3]]


@dataclass(frozen=True)
class Scene:
    """One file. `environment` is radiance from infinity, the same from everywhere, or what the image `sky` of it is
    multiplied by, which is turned about +y by `turn` degrees."""

    name: str
    camera: Camera
    objects: list[Object]
    lights: list[PointLight | SpotLight] = field(default_factory=list)
    environment: Vec3 = (0.0, 0.0, 0.0)
    sky: Image | None = None
    turn: float = 0.0
