"""Scenes that comber reads, as Mitsuba 3's: the same geometry, albedos, lamp and camera."""
import re
from xml.etree import ElementTree

import mitsuba as mi
import numpy as np


class Failure(Exception):
    """Something the user should read, without a traceback."""


def load_scene(path, depth):
    """The scene of a file as Mitsuba's, without sensor; `depth` in bounces, as comber counts them."""
    shapes = read_dae(path) if path.suffix == ".dae" else mesh_in_box(path)
    return mi.load_dict({"type": "scene", "integrator": {"type": "path", "max_depth": depth + 1}} | shapes)


def load_sensor(camera, sampler, size):
    """The camera that `comber info --json` tells, as Mitsuba's, with a sampler, a film and a box filter."""
    at, forward, up = (np.array(camera[key]) for key in ("position", "forward", "up"))
    return mi.load_dict({
        "type": "perspective", "fov_axis": "x", "fov": float(np.degrees(2 * np.arctan(camera["tan_half_x"]))),
        "to_world": mi.ScalarTransform4f().look_at(list(at), list(at + forward), list(up)),
        "film": {"type": "hdrfilm", "width": size[0], "height": size[1], "pixel_format": "rgb",
                 "rfilter": {"type": "box"}},
        "sampler": {"type": sampler}})


def diffuse(albedo):
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(albedo)}}}


def mesh(name, positions, triangles, albedo):
    """Triangles shaded with flat normals, which Mitsuba does for meshes that have no vertex normals."""
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(diffuse(albedo))
    made = mi.Mesh(name, len(positions), len(triangles), properties)
    parameters = mi.traverse(made)
    parameters["vertex_positions"] = np.ravel(positions).astype(np.float32)
    parameters["faces"] = np.ravel(triangles).astype(np.uint32)
    parameters.update()
    return made


def area_light(frame, radiance):
    """A lamp that emits to one side and reflects nothing; `frame` maps the unit square around 0 to it, −z forward."""
    to_world = frame @ np.diag([0.5, 0.5, -1, 1])
    return {"type": "rectangle", "to_world": mi.ScalarTransform4f(to_world), "bsdf": diffuse([0, 0, 0]),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": list(radiance)}}}


def mesh_in_box(path):
    """What `comber --stage cornell` makes: the room of the course's CBbunny, the mesh 1.2 large on its floor."""
    bare = {"type": path.suffix[1:], "filename": str(path), "face_normals": True}
    box = mi.load_dict(bare).bbox()
    low, high = np.array(box.min, float), np.array(box.max, float)
    scale = 1.2 / (high - low).max()
    foot = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    to_world = np.diag([scale, scale, scale, 1.0])
    to_world[:3, 3] = [0, 0.001, 0] - scale * foot
    x, y, z = np.array([1, 0, 0]), np.array([0, 1.5, 0]), np.array([0, 0, 1])
    walls = {"floor": (-x - z, 2 * x, 2 * z, 0.6), "ceiling": (y - x - z, 2 * x, 2 * z, 0.6),
             "back": (z - x, 2 * x, y, 0.6),
             "left": (x - z, 2 * z, y, (0.6, 0.2, 0.2)), "right": (-x - z, 2 * z, y, (0.2, 0.2, 0.6))}
    lamp = np.array([[0.6, 0, 0, 0], [0, 0, 1, 1.49], [0, 0.8, 0, 0], [0, 0, 0, 1]])
    return {"model": bare | {"to_world": mi.ScalarTransform4f(to_world), "bsdf": diffuse([0.5] * 3)},
            "lamp": area_light(lamp, [10] * 3)} | {
            name: mesh(name, [at, at + u, at + u + v, at + v], [[0, 1, 2], [0, 2, 3]], np.broadcast_to(albedo, 3))
            for name, (at, u, v, albedo) in walls.items()}


def read_dae(path):
    """Diffuse triangles and spheres, and the area light, of a COLLADA file with the course's extensions."""
    try:
        text = re.sub(r'\sxmlns="[^"]*"', "", path.read_text(encoding="utf-8"), count=1)
        document = ElementTree.fromstring(text)
    except (OSError, ValueError, ElementTree.ParseError) as error:
        raise Failure(f"{path}: {error}") from error
    named = {"#" + e.get("id"): e for e in document.iter() if e.get("id")}
    z_up = np.array([[-1, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
    base = z_up if document.findtext(".//up_axis", "").strip() == "Z_UP" else np.eye(4)
    shapes, lights = {}, {}

    def numbers(element, kind=float):
        return np.array(element.text.split(), kind)

    def surface(instance):
        """Albedo, and whether it emits: then it is the picture of the area light, which stands for it."""
        bound = instance.find(".//instance_material")
        if bound is None:
            return [0.5] * 3, False
        effect = named[named[bound.get("target")].find("instance_effect").get("url")]
        extra = {e.tag for e in effect.findall(".//extra/technique/*")}
        if extra - {"emission"}:
            raise Failure(f"{path}: {bound.get('target')} is {', '.join(extra)}; only diffuse surfaces are compared")
        return numbers(effect.find(".//diffuse/color"))[:3], "emission" in extra

    def add_geometry(name, instance, frame):
        albedo, emits = surface(instance)
        geometry = named[instance.get("url")]
        radius = geometry.find(".//sphere/radius")
        if emits:
            return
        if radius is not None:
            size = float(radius.text) * np.cbrt(abs(np.linalg.det(frame[:3, :3])))
            shapes[name] = {"type": "sphere", "center": list(frame[:3, 3]), "radius": size, "bsdf": diffuse(albedo)}
            return
        for part in geometry.findall("mesh/polylist") + geometry.findall("mesh/triangles"):
            inputs = {e.get("semantic"): e for e in part.findall("input")}
            vertices = named[inputs["VERTEX"].get("source")]
            source = named[vertices.find("input[@semantic='POSITION']").get("source")]
            points = numbers(source.find("float_array")).reshape(-1, 3)
            stride = 1 + max(int(e.get("offset")) for e in inputs.values())
            corners = numbers(part.find("p"), int)[int(inputs["VERTEX"].get("offset"))::stride]
            sides = numbers(part.find("vcount"), int) if part.tag == "polylist" else np.full(len(corners) // 3, 3)
            starts = np.cumsum(sides) - sides
            fans = [[at, at + k, at + k + 1] for at, n in zip(starts, sides) for k in range(1, n - 1)]
            key = f"{name}_{len(shapes)}"
            shapes[key] = mesh(key, points @ frame[:3, :3].T + frame[:3, 3], corners[np.array(fans)], albedo)

    def walk(node, frame):
        for step in node:
            if step.tag == "matrix":
                frame = frame @ numbers(step).reshape(4, 4)
            elif step.tag in ("translate", "scale", "rotate"):
                v = numbers(step)
                made = getattr(mi.ScalarTransform4f(), step.tag)(*([v[:3], v[3]] if step.tag == "rotate" else [v]))
                frame = frame @ np.array(made.matrix)
            elif step.tag == "instance_geometry":
                add_geometry(f"g{len(shapes)}", step, frame)
            elif step.tag == "instance_light":
                colour = named[step.get("url")].find(".//extra/technique/area/color")
                if colour is None:
                    raise Failure(f"{path}: light {step.get('url')} is no area light; others are not compared")
                lights[f"l{len(lights)}"] = area_light(frame, numbers(colour)[:3])
            elif step.tag == "node":
                walk(step, frame)

    try:
        for node in named[document.find("scene/instance_visual_scene").get("url")].findall("node"):
            walk(node, base)
    except (AttributeError, KeyError, IndexError, TypeError, ValueError) as error:
        raise Failure(f"{path}: not a scene this script can convert: {error!r}") from error
    if len(lights) != 1:
        raise Failure(f"{path}: {len(lights)} area lights, expected one")
    return shapes | lights
