"""STEP files by hand (ISO 10303-21, application protocol 214): solids whose volume is known."""

from __future__ import annotations

from typing import Any

import numpy as np

HEAD = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('','',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));
ENDSEC;
DATA;
"""


class Step:
    """Entities with numbers."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def add(self, text: str) -> str:
        self.lines.append(f"#{len(self.lines) + 1}={text};")
        return f"#{len(self.lines)}"

    def point(self, *at: float) -> str:
        return self.add("CARTESIAN_POINT('',({:.6f},{:.6f},{:.6f}))".format(*at))

    def direction(self, along: Any) -> str:
        unit = np.asarray(along, dtype=float) / np.linalg.norm(along)
        return self.add("DIRECTION('',({:.15f},{:.15f},{:.15f}))".format(*unit))

    def file_of(self, shell: list[str]) -> str:
        """The file of one solid in millimetres, from the faces of its closed shell."""
        add = self.add
        closed = add(f"CLOSED_SHELL('',({','.join(shell)}))")
        solid = add(f"MANIFOLD_SOLID_BREP('',{closed})")
        length = add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
        angle = add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
        sphere = add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
        error = add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-7),{length},'d','')")
        context = add(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)"
            f"GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({error}))"
            f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{sphere}))REPRESENTATION_CONTEXT('',''))"
        )
        shape = add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('',({solid}),{context})")
        application = add("APPLICATION_CONTEXT('automotive design')")
        of_product = add(f"PRODUCT_CONTEXT('',{application},'mechanical')")
        product = add(f"PRODUCT('t','t','',({of_product}))")
        formation = add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
        view = add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{application},'design')")
        definition = add(f"PRODUCT_DEFINITION('design','',{formation},{view})")
        defined = add(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
        add(f"SHAPE_DEFINITION_REPRESENTATION({defined},{shape})")
        return HEAD + "\n".join(self.lines) + "\nENDSEC;\nEND-ISO-10303-21;\n"


def sphere(radius: float) -> str:
    """One spherical face, whose only bound is a point."""
    step = Step()
    centre, z, x = step.point(0, 0, 0), step.direction([0, 0, 1]), step.direction([1, 0, 0])
    place = step.add(f"AXIS2_PLACEMENT_3D('',{centre},{z},{x})")
    surface = step.add(f"SPHERICAL_SURFACE('',{place},{radius:.6f})")
    vertex = step.add(f"VERTEX_POINT('',{step.point(0, 0, -radius)})")
    loop = step.add(f"VERTEX_LOOP('',{vertex})")
    bound = step.add(f"FACE_BOUND('',{loop},.T.)")
    return step.file_of([step.add(f"ADVANCED_FACE('',({bound}),{surface},.T.)")])


def tetrahedron(leg: float) -> str:
    """Four plane faces, with three legs along the axes."""
    corners = leg * np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    step = Step()
    points = [step.point(*c) for c in corners]
    vertices = [step.add(f"VERTEX_POINT('',{p})") for p in points]
    edges: dict[tuple[int, int], str] = {}
    shell = []
    for face in faces:
        oriented = []
        for a, b in zip(face, (*face[1:], face[0]), strict=True):
            low, high = sorted((a, b))
            if (low, high) not in edges:
                course = step.add(f"VECTOR('',{step.direction(corners[high] - corners[low])},1.)")
                line = step.add(f"LINE('',{points[low]},{course})")
                edges[low, high] = step.add(f"EDGE_CURVE('',{vertices[low]},{vertices[high]},{line},.T.)")
            oriented.append(step.add(f"ORIENTED_EDGE('',*,*,{edges[low, high]},{'.T.' if a < b else '.F.'})"))
        loop = step.add(f"EDGE_LOOP('',({','.join(oriented)}))")
        p, q, r = corners[list(face)]
        normal, along = step.direction(np.cross(q - p, r - p)), step.direction(q - p)
        place = step.add(f"AXIS2_PLACEMENT_3D('',{points[face[0]]},{normal},{along})")
        plane = step.add(f"PLANE('',{place})")
        bound = step.add(f"FACE_OUTER_BOUND('',{loop},.T.)")
        shell.append(step.add(f"ADVANCED_FACE('',({bound}),{plane},.T.)"))
    return step.file_of(shell)
