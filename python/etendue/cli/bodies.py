"""The bodies of a STEP file, as ``etendue info`` tells them."""

from __future__ import annotations

from typing import Any

from etendue.cli.terminal import say
from etendue.scene.step_files import StepBody


def describe_bodies(bodies: list[StepBody]) -> dict[str, Any]:
    """Names, sides of the box around each body [mm], volumes [mm³], triangles and chord errors [mm], as plain data."""
    return {
        "bodies": [
            {
                "name": body.name,
                "size": body.size.tolist(),
                "volume": abs(body.volume) if body.closed else None,
                "closed": body.closed,
                "triangles": len(body.triangles),
                "chord_error": body.chord_error,
            }
            for body in bodies
        ]
    }


def print_bodies(bodies: list[StepBody]) -> None:
    """A line for each body."""
    for facts in describe_bodies(bodies)["bodies"]:
        size = " × ".join(f"{side:.5g}" for side in facts["size"])
        inside = f"volume {facts['volume']:.4g} mm³" if facts["closed"] else "open"
        error = f"chord error {facts['chord_error']:.2g} mm" if facts["chord_error"] else "all faces plane"
        say(f"  {facts['name']:<22} {size} mm, {inside}, {facts['triangles']:,} triangles, {error}")
    if len(bodies) > 1:
        say('  A solid of a scene takes one of them by its name: shape = { kind = "mesh", file = …, body = … }')
