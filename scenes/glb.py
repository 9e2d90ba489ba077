"""glTF 2.0 binary out. Equal scenes give equal bytes."""

import json
import struct
from math import pi

import png
from model import Diffuse, Scene, Sphere, SpotLight
from shapes import cross, normalize, sphere, sub

FLOAT, UINT16, UINT32 = 5126, 5123, 5125
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963


def rounded(x: float) -> float:
    """To a micrometre, so that the last bit of a platform's sine does not reach the file."""
    return round(x, 6) + 0.0


def as_f32(x: float) -> float:
    """The nearest single-precision number, so that stated bounds equal stored values."""
    return struct.unpack("<f", struct.pack("<f", x))[0]


def numbers(values) -> list:
    """Integers where they are whole: shorter, and the same on each platform."""
    out = [rounded(v) for v in values]
    return [int(v) if v == int(v) else v for v in out]


class Buffer:
    """The binary chunk with its views and accessors."""

    def __init__(self) -> None:
        self.bytes = bytearray()
        self.views: list[dict] = []
        self.accessors: list[dict] = []

    def push(self, data: bytes, target: int, accessor: dict) -> int:
        self.views.append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data),
                           "target": target})
        self.bytes += data
        self.bytes += bytes(-len(self.bytes) % 4)
        self.accessors.append({"bufferView": len(self.views) - 1, **accessor})
        return len(self.accessors) - 1

    def image(self, data: bytes) -> int:
        """The number of its view."""
        self.views.append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)})
        self.bytes += data
        self.bytes += bytes(-len(self.bytes) % 4)
        return len(self.views) - 1

    def coordinates(self, values) -> int:
        return self.push(b"".join(struct.pack("<2f", *map(rounded, v)) for v in values), ARRAY_BUFFER,
                         {"componentType": FLOAT, "count": len(values), "type": "VEC2"})

    def vectors(self, values, bounds: bool) -> int:
        rows = [tuple(as_f32(rounded(x)) for x in v) for v in values]
        accessor = {"componentType": FLOAT, "count": len(rows), "type": "VEC3"}
        if bounds:
            accessor["min"] = [min(c) for c in zip(*rows)]
            accessor["max"] = [max(c) for c in zip(*rows)]
        return self.push(b"".join(struct.pack("<3f", *r) for r in rows), ARRAY_BUFFER, accessor)

    def indices(self, triangles, vertices: int) -> int:
        flat = [i for t in triangles for i in t]
        code, kind = ("H", UINT16) if vertices < 65535 else ("I", UINT32)
        return self.push(struct.pack(f"<{len(flat)}{code}", *flat), ELEMENT_ARRAY_BUFFER,
                         {"componentType": kind, "count": len(flat), "type": "SCALAR"})


def material_json(material, textures: list) -> dict:
    out = untextured_json(material)
    if material.texture:
        if material.texture not in textures:
            textures.append(material.texture)
        out["pbrMetallicRoughness"]["baseColorTexture"] = {"index": textures.index(material.texture)}
    return out


def untextured_json(material) -> dict:
    if isinstance(material, Diffuse):
        out = {
            "name": material.name,
            "pbrMetallicRoughness": {"baseColorFactor": numbers(material.reflectance) + [1],
                                     "metallicFactor": 0, "roughnessFactor": 1},
            "extensions": {"KHR_materials_specular": {"specularFactor": 0}},
        }
        strength = max(material.emission)
        if strength > 1:
            out["emissiveFactor"] = numbers(e / strength for e in material.emission)
            out["extensions"]["KHR_materials_emissive_strength"] = {
                "emissiveStrength": numbers([strength])[0]}
        elif strength > 0:
            out["emissiveFactor"] = numbers(material.emission)
        return out
    volume = {"thicknessFactor": 1}
    if material.attenuation:
        volume |= {"attenuationDistance": 1, "attenuationColor": numbers(material.attenuation)}
    out = {
        "name": material.name,
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0,
                                 "roughnessFactor": numbers([material.roughness])[0]},
        "extensions": {"KHR_materials_ior": {"ior": numbers([material.ior])[0]},
                       "KHR_materials_transmission": {"transmissionFactor": 1},
                       "KHR_materials_volume": volume},
    }
    if material.abbe:
        out["extensions"]["KHR_materials_dispersion"] = {"dispersion": rounded(20 / material.abbe)}
    if material.exterior != 1.0:
        out["extras"] = {"caustica": {"exterior_ior": rounded(material.exterior)}}
    return out


def looking(origin, target, up) -> list[float]:
    """Camera or spot to world, columns; both look along their -z."""
    back = normalize(sub(origin, target))
    right = normalize(cross(up, back))
    up = cross(back, right)
    return numbers([*right, 0, *up, 0, *back, 0, *origin, 1])


def encode(scene: Scene) -> bytes:
    """The file's bytes."""
    buffer, nodes, meshes, materials = Buffer(), [], [], []
    used: set[str] = set()
    for thing in scene.objects:
        shape = thing.shape
        node = {"name": thing.name, "mesh": len(meshes)}
        if isinstance(shape, Sphere):
            node["translation"] = numbers(shape.center)
            node["extras"] = {"caustica": {"sphere": {"radius": rounded(shape.radius)}}}
            # Other readers see this instead.
            shape = sphere((0.0, 0.0, 0.0), shape.radius, 24, 12)
        if thing.material not in materials:
            materials.append(thing.material)
        attributes = {"POSITION": buffer.vectors(shape.positions, True)}
        if shape.normals:
            attributes["NORMAL"] = buffer.vectors(shape.normals, False)
        if shape.coordinates:
            attributes["TEXCOORD_0"] = buffer.coordinates(shape.coordinates)
        meshes.append({"name": thing.name, "primitives": [{
            "attributes": attributes,
            "indices": buffer.indices(shape.triangles, len(shape.positions)),
            "material": materials.index(thing.material), "mode": 4}]})
        nodes.append(node)
    for i, light in enumerate(scene.lights):
        place = ({"matrix": looking(light.position, light.target, (0.0, 1.0, 0.0))}
                 if isinstance(light, SpotLight) else {"translation": numbers(light.position)})
        nodes.append({"name": light.name, **place,
                      "extensions": {"KHR_lights_punctual": {"light": i}}})
    camera = scene.camera
    nodes.append({"name": "camera", "camera": 0,
                  "matrix": looking(camera.origin, camera.target, camera.up)})

    root = {"name": scene.name, "nodes": list(range(len(nodes)))}
    if any(scene.environment):
        extras = {"environment": numbers(scene.environment)}
        if scene.sky:
            extras |= {"environment_image": f"{scene.sky.name}.exr", "environment_rotation": scene.turn}
        root["extras"] = {"caustica": extras}
    textures: list = []
    materials_json = [material_json(m, textures) for m in materials]
    images = [{"bufferView": buffer.image(png.encode(t.rows)), "mimeType": "image/png", "name": t.name} for t in textures]
    document = {
        "asset": {"version": "2.0", "generator": "Caustica scenes/generate.py"},
        "scene": 0,
        "scenes": [root],
        "nodes": nodes,
        "cameras": [{"name": "camera", "type": "perspective", "perspective": {
            "aspectRatio": 1, "yfov": round(scene.camera.yfov * pi / 180, 9), "znear": 0.01}}],
        "meshes": meshes,
        "materials": materials_json,
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.bytes)}],
    }
    if textures:
        document["images"] = images
        document["textures"] = [{"source": i, "sampler": 0} for i in range(len(images))]
        document["samplers"] = [{"magFilter": 9729, "minFilter": 9729, "wrapS": 10497, "wrapT": 10497}]
    for m in document["materials"]:
        used |= set(m["extensions"])
    if scene.lights:
        used.add("KHR_lights_punctual")
        document["extensions"] = {"KHR_lights_punctual": {"lights": [
            intensity_json(light) for light in scene.lights]}}
    document["extensionsUsed"] = sorted(used)

    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data = bytes(buffer.bytes)
    return (struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(data))
            + struct.pack("<II", len(text), 0x4E4F534A) + text
            + struct.pack("<II", len(data), 0x004E4942) + data)


def intensity_json(light) -> dict:
    strength = max(light.intensity)
    out = {"name": light.name, "type": "point", "intensity": numbers([strength])[0],
           "color": numbers(i / strength for i in light.intensity)}
    if isinstance(light, SpotLight):
        out["type"] = "spot"
        out["spot"] = {"innerConeAngle": round(light.inner * pi / 180, 9),
                       "outerConeAngle": round(light.outer * pi / 180, 9)}
    return out
