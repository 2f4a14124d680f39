"""What the library reports: outcomes, energies, sizes."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any


class Outcome(enum.IntEnum):
    """Why a step or a drape ended."""

    CONVERGED = 0
    SUBSTEPPED = 1
    ITERATION_LIMIT = 2
    CANCELLED = 3
    #: No step, however short, led lower.
    STALLED = 4
    #: Nothing holds a part of the garment, and nothing lies on its way.
    FALLING = 5


@dataclass(frozen=True)
class Report:
    """Numbers of a step or a drape."""

    outcome: Outcome
    newton_iterations: int
    linear_iterations: int
    substeps: int
    #: Time advanced [s].
    advanced: float
    #: Largest force on a free vertex [N].
    residual: float
    #: Largest relative stretch of a mesh edge, or of a piece of yarn between two nodes.
    max_edge_strain: float
    #: Smallest distance of a vertex to a body [m]; infinite without bodies.
    min_gap: float
    #: [J]
    kinetic_energy: float
    #: [J]
    potential_energy: float
    #: Largest distance across a seam [m].
    max_seam_gap: float


@dataclass(frozen=True)
class Energies:
    """Energies of the present state [J]."""

    kinetic: float
    gravity: float
    membrane: float
    bending: float
    seam: float
    contact: float
    yarn: float


@dataclass(frozen=True)
class SystemInfo:
    """What was built and what it costs."""

    vertices: int
    triangles: int
    yarn_nodes: int
    unknowns: int
    #: Mesh, terms and matrix.
    bytes: int
    #: Factor and work arrays.
    factor_bytes: int
    #: Smallest triangle angle [rad].
    min_angle: float
    #: Triangles that are simulated; yarns stand for the others.
    active_triangles: int
    #: Nodes of yarns that triangles carry.
    carried_nodes: int


@dataclass(frozen=True)
class YarnChanges:
    """What is not as the yarns were laid: contacts that yarns came out of."""

    #: Grows whenever the others, or the arrays of nodes and passages, change; 1 as laid.
    epoch: int
    #: Passages of yarns through nodes that are gone.
    passages_gone: int
    #: Nodes that came out of others where yarns parted.
    nodes_split: int
    #: Nodes that no yarn passes any more.
    nodes_left: int


#: What the error of triangles is made of, in the order of :attr:`Sim.vertex_criteria`.
CRITERIA = ("wrinkle", "mesh", "curvature", "strain", "stress", "seam")


@dataclass(frozen=True)
class Suggestion:
    """What a suggested region of yarns leaves and costs: nodes and unknowns counted, time and memory predicted."""

    #: The wanted tolerance, or what the budget allows.
    tolerance: float
    #: Error of triangles alone, and of those that are left, rms over their area.
    error: float
    error_left: float
    #: Largest error of a triangle that is left.
    largest_left: float
    #: Triangles that give way to yarns.
    full_triangles: int
    #: Nodes of yarns, and of these such as triangles carry.
    yarn_nodes: int
    carried_nodes: int
    #: Triangles that are simulated.
    active_triangles: int
    unknowns: int
    #: Memory of the simulation [bytes].
    bytes: int
    #: Time of a drape that begins where triangles rest, theirs included, over that of triangles alone.
    time_ratio: float
    #: Nodes with yarns wherever fabrics have them, and the time of that.
    all_yarn_nodes: int
    all_time_ratio: float
    #: Time of a Newton iteration over that of triangles alone.
    iteration_ratio: float


def _fields(value: Any) -> dict[str, Any]:
    skip = ("struct_size", "reserved")
    return {name: getattr(value, name) for name, _ in value._fields_ if name not in skip}


def _report(value: Any) -> Report:
    fields = _fields(value)
    fields["outcome"] = Outcome(fields["outcome"])
    return Report(**fields)
