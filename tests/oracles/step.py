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

    def file_of(self, shells: dict[str, list[str]], *, product: str = "t", unit: str = "mm") -> str:
        """The file of one product: a solid for each closed shell, from its faces, with its name."""
        solids = [self.solid(shell, name) for name, shell in shells.items()]
        self.part(solids, product=product, context=self.context(unit))
        return self.text()

    def text(self) -> str:
        """The whole file."""
        return HEAD + "\n".join(self.lines) + "\nENDSEC;\nEND-ISO-10303-21;\n"

    def solid(self, shell: list[str], name: str = "", *, hole: list[str] | None = None) -> str:
        """A solid of its faces; `hole`: faces of a void in it, as of a solid."""
        outer = self.add(f"CLOSED_SHELL('',({','.join(shell)}))")
        if hole is None:
            return self.add(f"MANIFOLD_SOLID_BREP('{name}',{outer})")
        inner = self.add(f"CLOSED_SHELL('',({','.join(hole)}))")
        void = self.add(f"ORIENTED_CLOSED_SHELL('',*,{inner},.F.)")
        return self.add(f"BREP_WITH_VOIDS('{name}',{outer},({void}))")

    def context(self, unit: str = "mm") -> str:
        """Units and uncertainty."""
        add = self.add
        length = add(f"(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({'$' if unit == 'm' else '.MILLI.'},.METRE.))")
        if unit == "inch":
            inch = add(f"LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),{length})")
            exponents = add("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)")
            length = add(f"(CONVERSION_BASED_UNIT('INCH',{inch})LENGTH_UNIT()NAMED_UNIT({exponents}))")
        angle = add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
        sphere = add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
        error = add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-7),{length},'d','')")
        return add(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)"
            f"GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({error}))"
            f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{sphere}))REPRESENTATION_CONTEXT('',''))"
        )

    def part(self, items: list[str], *, product: str, context: str) -> tuple[str, str]:
        """A product of solids, or of axes where others stand: its definition and its shape."""
        add = self.add
        kind = "ADVANCED_BREP_SHAPE_REPRESENTATION" if self.has_solid(items) else "SHAPE_REPRESENTATION"
        shape = add(f"{kind}('',({','.join(items)}),{context})")
        application = add("APPLICATION_CONTEXT('automotive design')")
        of_product = add(f"PRODUCT_CONTEXT('',{application},'mechanical')")
        product = add(f"PRODUCT('{product}','{product}','',({of_product}))")
        formation = add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
        view = add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{application},'design')")
        definition = add(f"PRODUCT_DEFINITION('design','',{formation},{view})")
        defined = add(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
        add(f"SHAPE_DEFINITION_REPRESENTATION({defined},{shape})")
        return definition, shape

    def has_solid(self, items: list[str]) -> bool:
        """Whether some of these entities are solids."""
        return any(
            "_BREP" in self.lines[int(item[1:]) - 1] or "BREP_" in self.lines[int(item[1:]) - 1] for item in items
        )

    def axes(self, at: Any, *, z: Any, x: Any) -> str:
        """A frame."""
        return self.add(f"AXIS2_PLACEMENT_3D('',{self.point(*at)},{self.direction(z)},{self.direction(x)})")

    def placed(self, name: str, *, whole: tuple[str, str], part: tuple[str, str], frames: tuple[str, str]) -> None:
        """A part (definition and shape) in a whole: its own frame falls on one of the whole's."""
        use = self.add(f"NEXT_ASSEMBLY_USAGE_OCCURRENCE('{name}','{name}','',{whole[0]},{part[0]},$)")
        defined = self.add(f"PRODUCT_DEFINITION_SHAPE('','',{use})")
        turned = self.add(f"ITEM_DEFINED_TRANSFORMATION('','',{frames[0]},{frames[1]})")
        relation = self.add(
            f"(REPRESENTATION_RELATIONSHIP('','',{part[1]},{whole[1]})"
            f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({turned})SHAPE_REPRESENTATION_RELATIONSHIP())"
        )
        self.add(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION({relation},{defined})")

    def ball(self, radius: float, middle: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> list[str]:
        """One spherical face, whose only bound is a point."""
        centre, z, x = self.point(*middle), self.direction([0, 0, 1]), self.direction([1, 0, 0])
        place = self.add(f"AXIS2_PLACEMENT_3D('',{centre},{z},{x})")
        surface = self.add(f"SPHERICAL_SURFACE('',{place},{radius:.6f})")
        pole = self.point(middle[0], middle[1], middle[2] - radius)
        vertex = self.add(f"VERTEX_POINT('',{pole})")
        loop = self.add(f"VERTEX_LOOP('',{vertex})")
        bound = self.add(f"FACE_BOUND('',{loop},.T.)")
        return [self.add(f"ADVANCED_FACE('',({bound}),{surface},.T.)")]

    def spline_ball(self, radius: float) -> list[str]:
        """The same as one face of a rational B-spline, as programs write it that know no spheres: a half circle, turned."""
        turn = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
        half = [(0, -1), (1, -1), (1, 0), (1, 1), (0, 1)]
        rows = [[self.point(radius * r * x, radius * r * y, radius * z) for r, z in half] for x, y in turn]
        weights = [[0.5 ** ((i % 2 + j % 2) / 2) for j in range(5)] for i in range(9)]
        net, shares = (
            ",".join(f"({','.join(row)})" for row in table)
            for table in (rows, [[f"{weight:.15f}" for weight in row] for row in weights])
        )
        surface = self.add(
            f"(BOUNDED_SURFACE()B_SPLINE_SURFACE(2,2,({net}),.UNSPECIFIED.,.F.,.F.,.F.)"
            "B_SPLINE_SURFACE_WITH_KNOTS((3,2,2,2,3),(3,2,3),(0.,1.,2.,3.,4.),(0.,1.,2.),.UNSPECIFIED.)"
            f"GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_SURFACE(({shares}))REPRESENTATION_ITEM('')SURFACE())"
        )
        vertex = self.add(f"VERTEX_POINT('',{self.point(0.0, 0.0, -radius)})")
        loop = self.add(f"VERTEX_LOOP('',{vertex})")
        bound = self.add(f"FACE_BOUND('',{loop},.T.)")
        return [self.add(f"ADVANCED_FACE('',({bound}),{surface},.T.)")]

    def polyhedron(self, corners: Any, faces: list[tuple[int, ...]]) -> list[str]:
        """Plane faces, counter-clockwise seen from outside."""
        corners = np.asarray(corners, dtype=float)
        points = [self.point(*c) for c in corners]
        vertices = [self.add(f"VERTEX_POINT('',{p})") for p in points]
        edges: dict[tuple[int, int], str] = {}
        shell = []
        for face in faces:
            oriented = []
            for a, b in zip(face, (*face[1:], face[0]), strict=True):
                low, high = sorted((a, b))
                if (low, high) not in edges:
                    course = self.add(f"VECTOR('',{self.direction(corners[high] - corners[low])},1.)")
                    line = self.add(f"LINE('',{points[low]},{course})")
                    edges[low, high] = self.add(f"EDGE_CURVE('',{vertices[low]},{vertices[high]},{line},.T.)")
                oriented.append(self.add(f"ORIENTED_EDGE('',*,*,{edges[low, high]},{'.T.' if a < b else '.F.'})"))
            loop = self.add(f"EDGE_LOOP('',({','.join(oriented)}))")
            p, q, r = corners[list(face[:3])]
            normal, along = self.direction(np.cross(q - p, r - p)), self.direction(q - p)
            place = self.add(f"AXIS2_PLACEMENT_3D('',{points[face[0]]},{normal},{along})")
            plane = self.add(f"PLANE('',{place})")
            bound = self.add(f"FACE_OUTER_BOUND('',{loop},.T.)")
            shell.append(self.add(f"ADVANCED_FACE('',({bound}),{plane},.T.)"))
        return shell

    def half_ball(self, radius: float) -> list[str]:
        """A plano-convex lens: half a sphere over a disk in z = 0, with a sharp rim."""
        centre, z, x = self.point(0, 0, 0), self.direction([0, 0, 1]), self.direction([1, 0, 0])
        place = self.add(f"AXIS2_PLACEMENT_3D('',{centre},{z},{x})")
        vertex = self.add(f"VERTEX_POINT('',{self.point(radius, 0, 0)})")
        circle = self.add(f"CIRCLE('',{place},{radius:.6f})")
        edge = self.add(f"EDGE_CURVE('',{vertex},{vertex},{circle},.T.)")
        shell = []
        for surface, sense, same in (
            (self.add(f"SPHERICAL_SURFACE('',{place},{radius:.6f})"), ".T.", ".T."),
            (self.add(f"PLANE('',{place})"), ".F.", ".F."),
        ):
            oriented = self.add(f"ORIENTED_EDGE('',*,*,{edge},{sense})")
            loop = self.add(f"EDGE_LOOP('',({oriented}))")
            bound = self.add(f"FACE_BOUND('',{loop},.T.)")
            shell.append(self.add(f"ADVANCED_FACE('',({bound}),{surface},{same})"))
        return shell

    def domed_box(self, height: float) -> list[str]:
        """A cube of 1 mm whose top is a B-spline over its straight sides, 16 h u (1 - u) v (1 - v) above it."""
        shell = self.polyhedron(CUBE, CUBE_FACES)
        rows = []
        for i in range(3):
            row = [self.point(i / 2, j / 2, 1.0 + 4.0 * height * (i == 1 and j == 1)) for j in range(3)]
            rows.append(f"({','.join(row)})")
        surface = self.add(
            f"B_SPLINE_SURFACE_WITH_KNOTS('',2,2,({','.join(rows)}),.UNSPECIFIED.,.F.,.F.,.F.,(3,3),(3,3),(0.,1.),(0.,1.),"
            ".UNSPECIFIED.)"
        )
        top = shell[CUBE_FACES.index(TOP)]
        bounds = self.lines[int(top[1:]) - 1].partition("('',(")[2].partition(")")[0]
        shell[CUBE_FACES.index(TOP)] = self.add(f"ADVANCED_FACE('',({bounds}),{surface},.T.)")
        return shell


CUBE = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
CUBE_FACES: list[tuple[int, ...]] = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TOP = (1, 5, 7, 3)
"""The face of the cube at z = 1."""


def sphere(radius: float, *, unit: str = "mm", product: str = "t") -> str:
    """A ball."""
    step = Step()
    return step.file_of({"": step.ball(radius)}, product=product, unit=unit)


def half_ball(radius: float) -> str:
    """Half a ball."""
    step = Step()
    return step.file_of({"": step.half_ball(radius)})


def tetrahedron(leg: float) -> str:
    """Four plane faces, with three legs along the axes."""
    corners = leg * np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    step = Step()
    return step.file_of({"": step.polyhedron(corners, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])})


def optics() -> str:
    """Four bodies in one product: cubes of 2 mm and 1 mm that touch, the smaller one's face within that of the larger one;
    a cube beside the first, with corners in common; and a ball."""
    step = Step()
    shells = {
        "block": step.polyhedron(2 * CUBE, CUBE_FACES),
        "chip": step.polyhedron(CUBE + np.array([0.5, 0.5, 2.0]), CUBE_FACES),
        "twin": step.polyhedron(2 * CUBE + np.array([2.0, 0.0, 0.0]), CUBE_FACES),
        "lens": step.ball(1.5, (20.0, 0.0, 0.0)),
    }
    return step.file_of(shells, product="optics")


def domed_box(height: float) -> str:
    """A cube of 1 mm³ and on it a bump of height h, of 16 h/36 mm³."""
    step = Step()
    return step.file_of({"": step.domed_box(height)})


def hollow(side: float, *, hole: float) -> str:
    """A cube with a cubic void in its middle."""
    step = Step()
    inside = step.polyhedron(hole * CUBE + (side - hole) / 2.0, CUBE_FACES)
    step.part(
        [step.solid(step.polyhedron(side * CUBE, CUBE_FACES), hole=inside)], product="hollow", context=step.context()
    )
    return step.text()


def hollow_ball(radius: float, *, hole: float) -> str:
    """A ball with a void in its middle, both of splines."""
    step = Step()
    solid = step.solid(step.spline_ball(radius), hole=step.spline_ball(hole))
    step.part([solid], product="bubble", context=step.context())
    return step.text()


def board() -> str:
    """Three times one product, a tetrahedron of legs 1, 2, 3 along its x, y, z: as it is, moved by (10, 0, 0), and turned by
    90° about z and moved by (0, 20, 5)."""
    step = Step()
    context = step.context()
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)])
    own = step.axes((0, 0, 0), z=(0, 0, 1), x=(1, 0, 0))
    body = step.solid(step.polyhedron(corners, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]), "wedge")
    part = step.part([own, body], product="wedge", context=context)
    frames = [
        step.axes((0, 0, 0), z=(0, 0, 1), x=(1, 0, 0)),
        step.axes((10, 0, 0), z=(0, 0, 1), x=(1, 0, 0)),
        step.axes((0, 20, 5), z=(0, 0, 1), x=(0, 1, 0)),
    ]
    whole = step.part(frames, product="board", context=context)
    for number, frame in enumerate(frames):
        step.placed(f"at {number}", whole=whole, part=part, frames=(own, frame))
    return step.text()
