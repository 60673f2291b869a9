"""A URDF file of a vehicle, written plainly: bodies, joints, nothing that this project has made."""

import math

LINK = """
  <link name="{name}"><inertial><origin xyz="{at}" rpy="{rpy}"/><mass value="{mass}"/>
    <inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial>{solid}</link>"""
JOINT = """
  <joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
    <origin xyz="{at}" rpy="{rpy}"/><axis xyz="{axis}"/><dynamics damping="{damping}" friction="{friction}"/></joint>"""
CYLINDER = '<collision><origin xyz="0 0 0" rpy="{rpy}"/><geometry><cylinder radius="{radius}" length="{length}"/>'
CYLINDER += "</geometry></collision>"

NUMBERS = {
    "wheels": 3, "rollers": 8, "R": 0.12, "r": 0.03, "roller_radius": 0.008, "offset": 0.0, "inward": False,
    "base": (2.0, 0.006, 0.007, 0.011), "hub": (0.15, 8e-5, 5e-5), "roller": (0.004, 1.1e-7, 1.4e-7), "slant": 0.0,
    "solid": True, "more": "", "damping": 0.0, "strut": None, "spread": 0.0, "frictions": (),
}  # fmt: skip


def link(name, mass, inertias, at=(0, 0, 0), rpy=(0, 0, 0), solid=""):
    xx, yy, zz = inertias
    texts = {key: " ".join(map(repr, map(float, value))) for key, value in {"at": at, "rpy": rpy}.items()}
    return LINK.format(name=name, mass=mass, xx=xx, yy=yy, zz=zz, solid=solid, **texts)


def joint(name, parent, child, at, rpy=(0, 0, 0), axis=(1, 0, 0), kind="continuous", damping=0.0, friction=0.0):
    texts = {key: " ".join(map(repr, map(float, v))) for key, v in {"at": at, "rpy": rpy, "axis": axis}.items()}
    return JOINT.format(name=name, kind=kind, parent=parent, child=child, damping=damping, friction=friction, **texts)


def urdf(**changes):
    """The text. Wheels' frames have x along the axle; those of rollers have z along the rim."""
    v = NUMBERS | changes
    mass, xx, yy, zz = v["base"]
    parts = [link("base_link", mass, (xx, yy, zz))]
    for i in range(v["wheels"]):
        alpha = 2 * math.pi * i / v["wheels"] + 0.3
        hub, axial, across = v["hub"]
        parts.append(link(f"wheel{i}", hub, (axial, across, across)))
        at = v["R"] * math.cos(alpha), v["R"] * math.sin(alpha), 0
        turn = (0, 0, alpha + math.pi if v["inward"] else alpha)
        parent = "base_link"
        if v["strut"]:  # a link of the suspension, on a hinge of its own that has its axis across the wheel's
            parent = f"strut{i}"
            parts.append(link(parent, v["strut"], (2e-5, 3e-5, 4e-5)))
            parts.append(joint(f"rocker{i}", "base_link", parent, (0, 0, 0.01), axis=(0, 1, 0)))
            at = at[0], at[1], -0.01
        friction = v["frictions"][i] if v["frictions"] else 0.0
        parts.append(joint(f"axle{i}", parent, f"wheel{i}", at, turn, damping=v["damping"], friction=friction))
        for j in range(v["rollers"]):
            kappa = 2 * math.pi * j / v["rollers"]
            m, along, athwart = v["roller"]
            along *= 1 + v["spread"] * j / (v["rollers"] - 1)
            solid = CYLINDER.format(rpy="0 0 0", radius=v["roller_radius"], length=0.01)
            solid = solid if v["solid"] else ""
            parts.append(link(f"roller{i}_{j}", m, (athwart, athwart, along), solid=solid))
            place = (-1) ** j * v["offset"], v["r"] * math.cos(kappa), v["r"] * math.sin(kappa)
            axis = math.sin(v["slant"]), 0, math.cos(v["slant"])
            parts.append(joint(f"spin{i}_{j}", f"wheel{i}", f"roller{i}_{j}", place, (kappa, 0, 0), axis))
    return '<robot name="test">' + "".join(parts) + v["more"] + "\n</robot>\n"


def plain_urdf(caster=True, limited_arm=True, **changes):
    """Wheels that are one body each, with a cylinder; beside a caster and an arm, whose hinges are none of wheels."""
    v = NUMBERS | {"wheel_radius": 0.038, "collision": True} | changes
    mass, xx, yy, zz = v["base"]
    parts = [link("base_link", mass, (xx, yy, zz))]
    for i in range(v["wheels"]):
        alpha = 2 * math.pi * i / v["wheels"] + 0.3
        hub, axial, across = v["hub"]
        turned = f"0 {math.pi / 2!r} 0"
        solid = CYLINDER.format(rpy=turned, radius=v["wheel_radius"], length=0.02) if v["collision"] else ""
        parts.append(link(f"wheel{i}", hub, (axial, across, across), solid=solid))
        at = v["R"] * math.cos(alpha), v["R"] * math.sin(alpha), -0.02
        parts.append(joint(f"axle{i}", "base_link", f"wheel{i}", at, (0, 0, alpha)))
    if caster:
        parts += [link("fork", 0.02, (1e-5, 1e-5, 1e-5)), link("ball", 0.02, (1e-5, 1e-5, 1e-5))]
        parts += [joint("swivel", "base_link", "fork", (0, 0, -0.02), axis=(0, 0, 1))]
        parts += [joint("trail", "fork", "ball", (0.01, 0, -0.03), axis=(0, 1, 0))]
    if limited_arm:
        parts.append(link("arm", 0.1, (1e-4, 1e-4, 1e-4)))
        elbow = joint("elbow", "base_link", "arm", (0, 0, -0.03), axis=(0, 1, 0), kind="revolute")
        parts.append(elbow.replace("</joint>", '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'))
    return '<robot name="test">' + "".join(parts) + v["more"] + "\n</robot>\n"
