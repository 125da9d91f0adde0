"""Bodies: shapes, colours, mesh files, and the inertia derived from shapes."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from tfcompose.compiler.resolve.poses import pose_of, rotation_of
from tfcompose.compiler.urdf.inertia import (
    Moments,
    UnmeasurableError,
    inertial,
    join_moments,
    of_primitive,
    trace,
    traces,
)
from tfcompose.compiler.urdf.packages import Packages
from tfcompose.foundation.findings import Finding, finding
from tfcompose.foundation.geometry import Pose
from tfcompose.model.robot import Inertial, Link, Material, Shape, colour_name, materials
from tfcompose.spec.language.values import COLOURS

if TYPE_CHECKING:
    from tfcompose.foundation.findings import Span
    from tfcompose.spec.language import bodies as specs
    from tfcompose.spec.language.robot import RobotSpec
    from tfcompose.spec.load import Path

FORMS = ("box", "cylinder", "sphere", "capsule", "mesh")


@dataclass(slots=True)
class Bodies:
    """Builds links from the spec."""

    spec: RobotSpec
    packages: Packages = field(default_factory=Packages)
    #: Findings about mesh and texture files.
    findings: list[Finding] = field(default_factory=list)
    _parts_by_id: dict[int, tuple[tuple[Shape, ...], tuple[Shape, ...], Inertial | None]] = field(
        default_factory=dict
    )

    def link(self, name: str, body: specs.LinkSpec) -> Link:
        """Return the link with its shapes and, if it has a mass, its inertia."""
        span = self.spec.key_span(("links", name))
        if (
            id(body) not in self._parts_by_id
        ):  # aliases of an anchor are the same object and have the same shapes
            self._parts_by_id[id(body)] = self._parts(body, ("links", name))
        visuals, collisions, inertial = self._parts_by_id[id(body)]
        if inertial and inertial.span:
            inertial = replace(inertial, span=span)
        return Link(name, span, visuals, collisions, inertial, has_mass=body.inertial is not None)

    def _parts(
        self, body: specs.LinkSpec, path: Path
    ) -> tuple[tuple[Shape, ...], tuple[Shape, ...], Inertial | None]:
        visuals = self._shapes(body.visual, (*path, "visual"))
        collisions = (
            visuals
            if body.collision == "same"
            else self._shapes(body.collision, (*path, "collision"))
        )
        inertial = None
        if body.inertial:
            inertial = self._inertial(body.inertial, visuals, collisions, (*path, "inertial"))
        if inertial and body.inertial:
            key = "mass" if body.inertial.mass else "density"
            inertial = replace(inertial, mass_at=self.spec.span_of((*path, "inertial", key)))
        return visuals, collisions, inertial

    def shape(self, shape: specs.ShapeSpec, path: Path) -> Shape:
        """Return the shape.

        Raises:
            ValueError: if the spec names no shape, such as box or mesh.
        """
        material = None
        if shape.material:
            material = self._material(shape.material, (*path, "material"))
        elif shape.color:
            material = Material(
                colour_name(shape.color), shape.color, span=self.spec.span_of((*path, "color"))
            )
        pose = pose_of(shape)
        if shape.box:
            return Shape("box", shape.box, pose, material)
        if shape.cylinder:
            return Shape(
                "cylinder", (shape.cylinder.radius, shape.cylinder.length), pose, material
            )
        if shape.sphere:
            return Shape("sphere", (shape.sphere.radius,), pose, material)
        if shape.capsule:
            return Shape("capsule", (shape.capsule.radius, shape.capsule.length), pose, material)
        if shape.mesh:
            span = self.spec.span_of((*path, "mesh", "uri"))
            mesh, wrong = self.packages.asset(shape.mesh.uri, span)
            self.findings += [wrong] if wrong else []
            return Shape("mesh", shape.mesh.scale, pose, material, mesh)
        raise ValueError("a shape without a form")

    def _shapes(self, shapes: tuple[specs.ShapeSpec, ...], path: Path) -> tuple[Shape, ...]:
        made = []
        for index, shape in enumerate(shapes):
            if any(getattr(shape, form) for form in FORMS):
                in_list = (*path, index)
                made.append(self.shape(shape, in_list if self.spec.spans.has(in_list) else path))
        return tuple(made)

    def _material(self, declared: specs.MaterialSpec, path: Path) -> Material:
        """Return the material.

        A material without a name is named after its colour and texture, so that URDF keeps
        different materials apart.
        """
        texture = None
        if declared.texture is not None:
            texture, wrong = self.packages.asset(
                declared.texture, self.spec.span_of((*path, "texture"))
            )
            self.findings += [wrong] if wrong else []
        name, rgba = declared.name, declared.rgba
        if name is None:
            rgba = rgba if rgba or texture else (0.5, 0.5, 0.5, 1.0)
            name = colour_name(rgba or ())
            name = name if texture is None else f"{name}_{_word(texture.uri)}"
        return Material(name, rgba, texture, self.spec.span_of(path))

    def _inertial(
        self,
        declared: specs.InertialSpec,
        visuals: tuple[Shape, ...],
        collisions: tuple[Shape, ...],
        path: Path,
    ) -> Inertial | None:
        shapes, span = collisions or visuals, self.spec.key_span(path[:2])
        pose = Pose(declared.xyz or (0.0, 0.0, 0.0), rotation_of(declared) or Pose().quat_xyzw)
        if declared.inertia and declared.mass:
            i = declared.inertia
            tensor = (i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz)
            return Inertial(
                declared.mass, pose, tensor, traces(declared.mass, visuals, collisions), span
            )
        moments = self.moments(shapes, self.spec.key_span(path)) if shapes else None
        if moments is None:
            return None
        density = declared.density or (declared.mass or 0.0) / moments.volume
        if declared.inertia:
            i = declared.inertia
            tensor = (i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz)
            return Inertial(
                density * moments.volume, pose, tensor, (density * trace(moments.tensor),), span
            )
        computed = inertial(moments, density, declared.mass)
        return replace(computed, pose=Pose(declared.xyz)) if declared.xyz else computed

    def moments(self, shapes: tuple[Shape, ...], span: Span) -> Moments | None:
        """Return the moments of the shapes at density 1 in the link's axes, None if unknown.

        If the moments are unknown, add a finding with the reason.
        """
        parts: list[Moments] = []
        for shape in shapes:
            if shape.mesh is None:
                parts.append(of_primitive(shape))
                continue
            measure = self.packages.disk.moments if self.packages.disk else None
            if measure is None or (
                shape.mesh.path and self._is_missing(shape.mesh.path)
            ):  # already reported
                return None
            if not shape.mesh.path:
                message = f"{shape.mesh.uri}: it is not found here, and has no volume"
                advice = "say where it is, give a collision shape, or give mass and inertia"
                self.findings.append(finding("TF725", message, span, help=advice))
                return None
            try:
                x, y, z = shape.size
                parts.append(measure(shape.mesh.path, (x, y, z)).moved(shape.pose))
            except UnmeasurableError as error:
                self.findings.append(
                    finding(error.code, f"{shape.mesh.uri}: {error}", span, help=error.advice)
                )
                return None
        return join_moments(parts)

    def _is_missing(self, path: str) -> bool:
        return self.packages.disk is not None and not self.packages.disk.is_file(path)


def with_colours(links: dict[str, Link]) -> dict[str, Link]:
    """Return the links with a colour for each material that has only a name.

    Such a material gets the colour of another material with its name. If there is none, its name
    may be the name of a colour.
    """
    by_name: dict[str, Material] = {}
    for material in materials(links):
        if material.rgba or material.texture:
            by_name.setdefault(material.name, material)
    for material in materials(links):
        if material.name in COLOURS:
            by_name.setdefault(
                material.name, replace(material, rgba=(*COLOURS[material.name], 1.0))
            )
    bare = {
        material.name
        for material in materials(links)
        if not (material.rgba or material.texture) and material.name in by_name
    }
    return (
        {name: _colour_link(link, by_name, bare) for name, link in links.items()}
        if bare
        else links
    )


def _colour_link(link: Link, materials: dict[str, Material], bare: set[str]) -> Link:
    def shape(visual: Shape) -> Shape:
        is_bare = (
            visual.material
            and visual.material.name in bare
            and not (visual.material.rgba or visual.material.texture)
        )
        return (
            replace(visual, material=materials[visual.material.name])
            if visual.material and is_bare
            else visual
        )

    return replace(
        link,
        visuals=tuple(map(shape, link.visuals)),
        collisions=tuple(map(shape, link.collisions)),
    )


def _word(uri: str) -> str:
    return re.sub(r"[^A-Za-z0-9]", "_", uri)
