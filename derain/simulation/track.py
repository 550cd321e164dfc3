"""A test track of triangles, and its returns through clear air."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from derain.scan import Array, Float32s, Floats, Ints
from derain.simulation.arrays import Columns
from derain.simulation.classes import TrackClass
from derain.simulation.objects import Surface
from derain.simulation.sensor import Returns, Sensor
from derain.system.open3d_import import import_open3d


@dataclass(frozen=True, eq=False)
class Track(Columns):
    """Everything on the track.

    Attributes:
        triangles: Corners, float32 (T, 3, 3), metres; x forward, y left, z up, with the origin on
            the road under the sensor.
        reflectivity: Reflectivity of each triangle, float64 (T,), in 0..1.
        label: TrackClass of each triangle, int64 (T,).
        roughness: Roughness of each triangle, float64 (T,), radians, see :func:`backscatter`.
    """

    triangles: Float32s
    reflectivity: Floats
    label: Ints
    roughness: Floats

    @classmethod
    def of(cls, surfaces: Iterable[Surface]) -> "Track":
        """Joins surfaces, at least one, into a track."""
        parts = list(surfaces)
        counts = [len(part.triangles) for part in parts]
        spread = zip(parts, counts, strict=True)
        return cls(
            np.concatenate([part.triangles for part in parts]).astype(np.float32),
            np.concatenate([np.broadcast_to(part.reflectivity, count) for part, count in spread]),
            np.repeat(np.array([part.label for part in parts], np.int64), counts),
            np.repeat([part.roughness for part in parts], counts),
        )

    def with_surfaces(self, surfaces: Iterable[Surface]) -> "Track":
        """The track with surfaces added; every surface is then smooth."""
        added = list(surfaces)
        if not added:
            return self
        track = Track.joined([self, Track.of(added)])
        return replace(track, roughness=np.zeros(len(track.label)))

    def cast(self, sensor: Sensor, pose: Floats | None = None) -> Returns:
        """The return of every beam of a sensor through clear air to a perfect detector.

        A beam is one ray. Smooth surfaces scatter like Lambert's: their apparent reflectivity falls
        with the cosine of the angle of incidence. That of rough ones falls less, see
        :func:`backscatter`.

        Args:
            sensor: The sensor.
            pose: Takes points from its frame into the track's, float64 (4, 4), metres, or (N, 4, 4)
                where every beam has a pose of its own; None stands upright at the origin, at its
                mounting height.

        Raises:
            InputError: Open3D cannot be imported.
        """
        beams, place = sensor.beams(), np.array([0, 0, sensor.mounting_height])
        if pose is not None:
            beams, place = (pose[..., :3, :3] @ beams[..., None])[..., 0], pose[..., :3, 3]
        origin = np.broadcast_to(place, beams.shape)
        hits = self._hits(np.concatenate([origin, beams], axis=1).astype(np.float32))
        hit = hits["t_hit"] <= sensor.maximum_range
        triangle = hits["primitive_ids"][hit]
        cosine = np.abs((hits["primitive_normals"][hit] * beams[hit]).sum(axis=1))
        distance = np.full(len(beams), float(sensor.maximum_range))
        reflectivity = np.zeros(len(beams))
        label = np.full(len(beams), TrackClass.BACKGROUND, dtype=np.int64)
        distance[hit] = hits["t_hit"][hit]
        facing = backscatter(cosine, self.roughness[triangle])
        reflectivity[hit] = self.reflectivity[triangle] * facing
        label[hit] = self.label[triangle]
        return Returns(distance, reflectivity, label, np.arange(len(beams)))

    def _hits(self, rays: Float32s) -> dict[str, Array]:
        """The first triangle on each ray as Open3D finds it; float32 (N, 6): origin, direction."""
        tensor = import_open3d().core.Tensor
        return {name: hit.numpy() for name, hit in self._scene.cast_rays(tensor(rays)).items()}

    @cached_property
    def _scene(self) -> Any:
        """Open3D's ray-casting scene, made once for the LiDAR and the radar that see one track."""
        open3d = import_open3d()
        tensor = open3d.core.Tensor
        scene = open3d.t.geometry.RaycastingScene()
        corners = np.arange(3 * len(self.triangles), dtype=np.uint32).reshape(-1, 3)
        scene.add_triangles(tensor(self.triangles.reshape(-1, 3)), tensor(corners))
        return scene


def backscatter(cosine: Floats, roughness: Floats) -> Floats:
    """Apparent reflectivity of surfaces over their reflectivity, float64 (N,).

    A smooth matt surface returns as Lambert's: in proportion to the cosine of the angle of
    incidence, so that a road that is lit at a grazing angle is nearly black. The facets of a rough
    one partly face the light, and it returns a share B of what it does not lose, however flat the
    light comes in.

    It is Oren and Nayar's qualitative model where light and eye are at one place:
    A cos θ + B sin² θ, with A = 1 - 0.5 σ² / (σ² + 0.33) and B = 0.45 σ² / (σ² + 0.09).

    Args:
        cosine: Cosine of the angle of incidence θ, float64 (N,), in 0..1.
        roughness: Standard deviation σ of the slopes of the facets, float64 (N,), radians; 0 is
            Lambert's surface.

    Source: Oren and Nayar 1994, "Generalization of Lambert's reflectance model". That it corrects
        intensities of laser scanners: "Terrestrial Laser Scanning Intensity Correction by Piecewise
        Fitting and Overlap-Driven Adjustment", Remote Sensing 9(11), 1090, 2017.
    """
    variance = roughness**2
    facing = 1 - 0.5 * variance / (variance + 0.33)
    grazing = 0.45 * variance / (variance + 0.09)
    return facing * cosine + grazing * (1 - cosine**2)
