"""A family of robots that only a seed tells apart.

Random trees with every joint type, shape and way to give a mass.
"""

import random
from typing import Any

TYPES = ("fixed", "revolute", "continuous", "prismatic", "planar", "floating")
MOVING = ("revolute", "continuous", "prismatic")
LIMIT = {"lower": -3, "upper": 3, "effort": 10, "velocity": 2}


def spec(seed: int, types: tuple[str, ...] = TYPES, links: int = 14) -> dict[str, Any]:
    """Return a robot in which each link but the root hangs on an earlier one.

    By a joint, an edge, or as a frame.
    """
    chance = random.Random(seed)
    robot: dict[str, Any] = {
        "tfcompose": 1,
        "robot": f"family_{seed}",
        "links": {"base_link": {}},
        "joints": {},
    }
    robot |= {"frames": {}, "processes": {"mover": {"external": True}}}
    names, masters = ["base_link"], list[str]()
    for index in range(links):
        # the first ones cover every type; what follows is chance
        kind = types[index] if index < len(types) else chance.choice((*types, "frame", "link"))
        name, placement = f"{kind}_{index}", _pose(chance) | {"parent": chance.choice(names)}
        if kind == "frame":
            robot["frames"][name] = placement
        elif kind == "link":
            robot["links"][name] = placement | _body(chance)
        else:
            robot["links"][name] = _body(chance)
            joint = robot["joints"][f"joint_{index}"] = (
                placement | {"child": name} | _joint(chance, kind, masters)
            )
            masters += [f"joint_{index}"] if kind in MOVING and "mimic" not in joint else []
        names.append(name)
    return robot


def _pose(chance: random.Random) -> dict[str, Any]:
    xyz = [round(chance.uniform(-1, 1), 4) for _ in range(3)]
    return {"xyz": xyz, "rpy": [round(chance.uniform(-3, 3), 4) for _ in range(3)]}


def _joint(chance: random.Random, kind: str, masters: list[str]) -> dict[str, Any]:
    joint: dict[str, Any] = {"type": kind}
    if kind == "fixed":
        return joint
    if kind in {"planar", "floating"}:
        return joint | {"owner": "mover"} | ({"axis": [0, 0, 1]} if kind == "planar" else {})
    joint["axis"] = [round(chance.uniform(0.1, 1), 3) * chance.choice((1, -1)) for _ in range(3)]
    joint |= {} if kind == "continuous" else {"limit": LIMIT}
    joint["offset"] = round(joint["axis"][0] / 4, 4)
    if chance.random() < 0.5:
        joint["dynamics"] = {
            "damping": round(chance.random(), 3),
            "friction": round(chance.random(), 3),
        }
    if kind == "revolute":
        joint["safety_controller"] = {
            "soft_lower_limit": -2,
            "soft_upper_limit": 2,
            "k_position": 1,
            "k_velocity": 5,
        }
        joint["calibration"] = {"rising": 0.1}
    if masters and chance.random() < 0.4:
        joint["mimic"] = {"joint": chance.choice(masters), "multiplier": -0.5, "offset": 0.25}
    return joint


def _body(chance: random.Random) -> dict[str, Any]:
    def size() -> float:
        return round(chance.uniform(0.05, 0.5), 4)

    def shape() -> dict[str, Any]:
        kind = chance.choice(("box", "cylinder", "sphere", "capsule"))
        form: dict[str, Any] = (
            {"radius": size()} if kind == "sphere" else {"radius": size(), "length": size()}
        )
        return _pose(chance) | {kind: [size(), size(), size()] if kind == "box" else form}

    shapes = [shape() for _ in range(chance.randint(1, 3))]
    shapes[0]["material"] = {"rgba": [round(chance.random(), 2), 0.5, 0.25, 1]}
    ways: list[dict[str, Any]] = [
        {"mass": round(chance.uniform(0.1, 9), 3)},
        {"density": round(chance.uniform(100, 3000), 1)},
        # the tensor of a real body, turned: products are not 0, and so is the frame it is given in
        {
            "mass": 3,
            "inertia": {
                "ixx": 0.5,
                "iyy": 0.6,
                "izz": 0.7,
                "ixy": 0.05,
                "ixz": -0.04,
                "iyz": 0.03,
            },
        }
        | _pose(chance),
    ]
    return {"visual": shapes, "collision": "same", "inertial": chance.choice(ways)}
