"""A scrap of plain weave whose third weft is pulled out.

As a program: goes on from a saved state, ``weave.py STATE STEPS``, and writes it anew.
"""

import json
import sys
from pathlib import Path

import numpy as np

import toile

WEAVE = {
    "toile_garment": 1,
    "name": "weave",
    "edge_length": 0.002,
    "panels": [
        {
            "name": "p",
            "fabric": "y",
            "vertices": [[0, 0], [0.005, 0], [0.005, 0.005], [0, 0.005]],
            "edges": [[0, 1], [1, 2], [2, 3], [3, 0]],
        }
    ],
    "fabrics": [
        {"name": "y", "yarns": {"weave": "plain", "warp_pitch": 0.001, "radius": 0.00025}}
    ],
    "blend_regions": [{"panel": "p", "polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}],
}


def weave() -> toile.Sim:
    """Five warp yarns, held at their ends, and five wefts."""
    sim = toile.Sim(toile.Garment.from_json(json.dumps(WEAVE)), gravity=(0, 0, 0))
    sim["solver.newton.relative_tolerance"] = 1e-3
    sim.pin_yarn_nodes([sim.yarn_end(yarn, end) for yarn in range(5) for end in (0, 1)])
    return sim


def pull(sim: toile.Sim, steps: int) -> list:
    """Pulls the third weft by 0.1 mm in each millisecond; what its holder bears [N]."""
    node, forces = sim.yarn_end(7, 1), []
    for _ in range(steps):
        sim.pin_yarn_nodes([node], sim.yarn_nodes[[node]] + [1e-4, 0, 0])
        sim.step(1e-3)
        forces.append(np.linalg.norm(sim.yarn_forces[node]))
    return forces


if __name__ == "__main__":
    state = Path(sys.argv[1])
    with weave() as sim:
        sim.restore(state.read_bytes())
        pull(sim, int(sys.argv[2]))
        state.write_bytes(sim.save())
