"""Where solids and what is written on them become a picture: VTK's renderer, off screen, without a display."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules import vtkRenderingOpenGL2
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersCore import vtkPolyDataNormals
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkLight,
    vtkPolyDataMapper,
    vtkRenderer,
    vtkRenderWindow,
    vtkWindowToImageFilter,
)

from darboux import files
from darboux.errors import InvalidInput
from darboux.view.camera import Camera
from darboux.view.space.overlay import Overlay, polydata
from darboux.view.space.solids import Solid
from darboux.view.tube import LIGHT

Array = NDArray[np.float64]

EDGE = 40.0  # degrees between faces, beyond which an edge is sharp
SAMPLES = 4  # of each pixel, against steps in slanting lines


@dataclass(frozen=True, eq=False)
class Stage:
    """Solids and what is written on them, seen by a camera; ``frame`` (n, 3) are the points that must be in the picture."""

    solids: list[Solid]
    overlay: Overlay
    camera: Camera
    frame: Array

    def fill(self, renderer: Any, size: tuple[int, int]) -> None:
        """Put all into a renderer of this size in pixels, and the camera where it sees the frame."""
        renderer.SetBackground(1.0, 1.0, 1.0)
        for light in _lamps():
            renderer.AddLight(light)
        self.place(renderer, size)
        for actor in self.actors():
            renderer.AddActor(actor)
        self.overlay.attach(renderer)

    def actors(self) -> Iterator[Any]:
        """Return VTK's actors: one for all that is solid, one for each solid that is seen through."""
        opaque = [solid for solid in self.solids if solid.opacity == 1.0]
        if opaque:
            yield _actor(_joined(opaque))
        for solid in self.solids:
            if solid.opacity < 1.0:
                yield _actor(solid)

    def place(self, renderer: Any, size: tuple[int, int]) -> None:
        """Place the camera: the frame fills the picture up to the overlay's margins, to one scale in all directions."""
        width, height = size
        left, right, bottom, top = self.overlay.margins(width, height)
        frame = self.camera.project(self.frame)
        low, high = frame.min(axis=0), frame.max(axis=0)
        room = np.maximum([width - left - right, height - bottom - top], 0.25 * np.array(size))
        pixel = float(np.max((high - low) / room))
        for _ in range(4):  # labels keep their size on the page, so that the scale is found step by step
            both = np.concatenate([frame, self.overlay.boxes(self.camera.A, pixel, self.overlay.letter(width, height))])
            low, high = both.min(axis=0), both.max(axis=0)
            pixel = float(np.max((high - low) / room))
        shift = 0.5 * pixel * np.array([right - left, top - bottom])
        middle = 0.5 * (low + high) + shift
        right_hand, up, towards = self.camera.A
        depth = self.camera.depth(self.frame)
        reach = float(np.ptp(depth)) + pixel * max(size)
        focus = middle[0] * right_hand + middle[1] * up + float(np.mean(depth)) * towards
        camera = renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        camera.SetFocalPoint(*focus)
        camera.SetPosition(*(focus + 2.0 * reach * towards))
        camera.SetViewUp(*up)
        camera.SetParallelScale(0.5 * height * pixel)
        camera.SetClippingRange(0.5 * reach, 3.5 * reach)

    def pixels(self, size: tuple[int, int]) -> NDArray[np.uint8]:
        """Return the picture (height, width, 3), from its upper left corner.

        Raises ``InvalidInput`` where nothing on this machine can draw.
        """
        for kind in _windows():
            window = kind()
            window.SetOffScreenRendering(1)
            window.SetSize(*size)
            window.SetMultiSamples(SAMPLES)
            renderer = vtkRenderer()
            window.AddRenderer(renderer)
            self.fill(renderer, size)
            window.Render()
            grab = vtkWindowToImageFilter()
            grab.SetInput(window)
            grab.ReadFrontBufferOff()
            grab.ShouldRerenderOff()
            grab.Update()
            scalars = grab.GetOutput().GetPointData().GetScalars()
            found = vtk_to_numpy(scalars) if scalars is not None else np.zeros((0, 3), np.uint8)
            if len(found) == size[0] * size[1] and np.any(found):
                return np.ascontiguousarray(found.reshape(size[1], size[0], -1)[::-1, :, :3])
        raise InvalidInput(
            "no picture can be drawn: VTK finds neither a display nor a way to draw without one. Install Mesa's libegl1 and "
            "libgl1-mesa-dri, or libosmesa6; darboux plot needs neither."
        )

    def write(self, path: Path, size: tuple[int, int]) -> None:
        """Write the picture as a PNG file, whole or not at all."""
        from vtkmodules.util.numpy_support import numpy_to_vtk
        from vtkmodules.vtkCommonDataModel import vtkImageData

        pixels = self.pixels(size)
        image = vtkImageData()
        image.SetDimensions(size[0], size[1], 1)
        image.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(pixels[::-1]).reshape(-1, 3), deep=True))
        with files.replacing(path) as temporary:
            writer = vtkPNGWriter()
            writer.SetFileName(str(temporary))
            writer.SetInputData(image)
            writer.Write()


def _windows() -> list[Any]:
    """Return the kinds of windows that can draw off screen, the surest first."""
    if sys.platform != "linux":
        return [vtkRenderWindow]
    named = [getattr(vtkRenderingOpenGL2, "vtkEGLRenderWindow", None)]
    if os.environ.get("DISPLAY") or named[0] is None:
        named.append(vtkRenderWindow)
    return [kind for kind in named if kind is not None]


def _lamps() -> Iterator[Any]:
    """Return a lamp over the viewer's left shoulder, and a weaker one at the viewer."""
    for place, strength in ((LIGHT, 0.72), (np.array([0.3, -0.2, 1.0]), 0.38)):
        lamp = vtkLight()
        lamp.SetLightTypeToCameraLight()
        lamp.SetPosition(*place)
        lamp.SetFocalPoint(0.0, 0.0, 0.0)
        lamp.SetIntensity(strength)
        yield lamp


def _joined(solids: list[Solid]) -> Solid:
    first = np.cumsum([0, *(len(solid.points) for solid in solids)])
    return Solid(
        np.concatenate([solid.points for solid in solids]),
        np.concatenate([solid.faces + n for solid, n in zip(solids, first, strict=False)]),
        np.concatenate([solid.colours for solid in solids]),
    )


def _actor(solid: Solid) -> Any:
    normals = vtkPolyDataNormals()
    normals.SetInputData(polydata(solid.points, solid.faces, solid.colours))
    normals.SetFeatureAngle(EDGE)
    normals.ConsistencyOff()
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(normals.GetOutputPort())
    actor = vtkActor()
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    look.SetAmbient(0.22)
    look.SetDiffuse(0.82)
    look.SetSpecular(0.12)
    look.SetSpecularPower(18.0)
    if solid.opacity < 1.0:
        look.SetOpacity(solid.opacity)
        look.BackfaceCullingOn()
    return actor
