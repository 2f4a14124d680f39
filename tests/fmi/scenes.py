"""Scenes of the tests: small, quick, with a body, pins, probes and a moving thing each."""

SHEET = {
    "toile_garment": 1,
    "name": "Sheet",
    "fabrics": [
        {
            "name": "cotton lawn",
            "density": 0.1,
            "membrane": {"warp": 300, "weft": 300, "shear": 60},
            "bending": {"warp": 4e-6, "weft": 4e-6},
        }
    ],
    "panels": [
        {
            "name": "sheet",
            "placement": {"translation": [0, 0.5, 0], "rotation_deg": [-90, 0, 0]},
            "vertices": [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]],
            "edges": [[0, 1], [1, 2], [2, 3], [3, 0]],
        }
    ],
    "seams": [],
}


def hung(**changes):
    """A sheet held by two edges, a ball above it."""
    scene = {
        "toile": 1,
        "name": "Hung sheet",
        "edge_length": 0.1,
        "garment": SHEET,
        "bodies": [
            {"name": "ball", "shape": "sphere", "radius": 0.1, "pose": {"position": [0, 0.62, 0]}}
        ],
        "pins": [{"panel": "sheet", "edge": 0}, {"panel": "sheet", "edge": 2}],
        "probes": [
            {"name": "middle", "panel": "sheet", "uv": [0, 0]},
            {"name": "rim", "panel": "sheet", "edge": 1},
        ],
        "run": {"drape": False, "duration": 0.3, "dt": 0.01},
    }
    scene.update(changes)
    return scene


def moving():
    """A sheet that falls onto a capsule which follows keyframes; a pin lets go."""
    return hung(
        name="Moving capsule",
        bodies=[
            {
                "name": "2nd capsule, turned",
                "shape": "capsule",
                "radius": 0.1,
                "half_length": 0.2,
                "motion": {
                    "keyframes": [
                        {"time": 0, "position": [0, 0.38, 0], "rotation_deg": [90, 0, 0]},
                        {"time": 0.2, "position": [0.05, 0.42, 0], "rotation_deg": [90, 20, 0]},
                    ]
                },
            },
            {"name": "floor", "shape": "plane"},
        ],
        pins=[{"panel": "sheet", "uv": [-0.3, -0.3], "until": 0.055}],
    )


def woven():
    """A patch of plain weave, every yarn simulated, that falls onto a drum."""
    size = 0.04
    corners = [[0, 0], [size, 0], [size, size], [0, size]]
    garment = {
        "toile_garment": 1,
        "name": "Patch",
        "edge_length": 0.01,
        "fabrics": [
            {"name": "burlap", "yarns": {"weave": "plain", "warp_pitch": 0.005, "radius": 0.001}}
        ],
        "panels": [
            {
                "name": "patch",
                "fabric": "burlap",
                "placement": {"translation": [0, 0, 0], "rotation_deg": [-90, 0, 0]},
                "vertices": corners,
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]],
            }
        ],
        "blend_regions": [
            {"panel": "patch", "polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}
        ],
    }
    return {
        "toile": 1,
        "name": "Woven patch",
        "garment": garment,
        "bodies": [
            {
                "name": "drum", "shape": "capsule", "radius": 0.02, "half_length": 0.1,
                "pose": {"position": [0.02, -0.024, -0.02], "rotation_deg": [90, 0, 0]},
            }
        ],
        "probes": [{"name": "middle", "panel": "patch", "uv": [0.02, 0.02]}],
        "numbers": {"solver.newton.relative_tolerance": 0.01},
        "run": {"drape": False, "duration": 0.3, "dt": 0.01},
    }


def mixed():
    """A hung sheet of triangles, woven around its middle, with a ball that pushes it."""
    garment = {
        **SHEET,
        "fabrics": [
            {
                **SHEET["fabrics"][0],
                "yarns": {"weave": "plain", "warp_pitch": 0.01, "radius": 0.001},
            }
        ],
        "blend_regions": [
            {"panel": "sheet", "polygon": [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]}
        ],
    }
    numbers = {"solver.newton.relative_tolerance": 0.01, "contact.self.enabled": 0}
    return hung(name="Mixed sheet", garment=garment, edge_length=0.05, numbers=numbers)
