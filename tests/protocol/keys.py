"""Small protocols around single keys of the reference."""

import copy

import yaml

BARE = {"protocol": 1, "gravity": "9.81 m/s^2", "chains": {"A": {"rods": 8, "length": "350 mm"}}}


def value(example: str) -> object:
    return yaml.safe_load(example)


def around(path: str) -> dict:
    """A protocol in which the key at a path makes sense, without the key itself."""
    data = copy.deepcopy(BARE)
    chain = data["chains"]["A"]
    chain |= {"diameter": "12.7 mm", "rod_length": "100 mm"}
    if path.startswith(("surface", "contact", "gates.impact", "plan.incline")):
        data["surface"] = {"restitution": 0.5}
    if path.startswith("track"):
        data["chains"] = {"A": {"rods": 1}}
        data["track"] = {"incline": "3 deg"}
    if path.startswith("surface.pile"):
        data["surface"]["pile"] = {"below": "30 deg", "restitution": -0.37}
    if path.startswith("plan.order") or path.endswith(".like"):
        data["surface"] = {"restitution": 0.5}
        data["chains"]["B"] = {} if path.endswith(".like") else {"like": "A"}
    if path.startswith("drag"):
        chain["mass"] = "14 g"
        data["drag"] = {} if "terminal" in path else {"coefficient": 1.1}
    if path.startswith("gates"):
        data |= {"drop": "100 mm", "gates": {}}
        sides = ["impact"] if "surface" in data else ["free"]
        data["gates"] = {side: [{"channel": 0, "height": "40 mm"}] for side in sides}
    if "surface" in data:
        data["drop"] = "100 mm"
    if path.startswith(("gravity", "site")):
        del data["gravity"]
        site = {"latitude": "50 deg", "height": "0 m"}
        data |= {"site": site} if path.startswith("site") else {}
    if ".rods.[]" in path:
        chain["rods"] = [{"count": 8, "mass": "3 g"}]
        if path.endswith("diameter"):
            del chain["diameter"]
    if ".exponential" in path:
        chain["masses"] = {"exponential": {"bottom": "12 g", "top": "3 g"}}
    if ".table" in path:
        chain["masses"] = {"table": [{"height": f"{z} mm", "mass": "3 g"} for z in (0, 350)]}
    return data


def put(data: dict, path: str, what: object) -> None:
    *way, last = path.split(".")
    here: object = data
    for part in way:
        if part == "*":
            here = here["B" if last == "like" else "A"]
        elif part == "[]":
            here = here[0]
        else:
            here = here.setdefault(part, {})
    here[last] = what
