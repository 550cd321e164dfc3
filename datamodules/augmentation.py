"""Random changes of training scans."""

import math
from collections.abc import Collection
from dataclasses import asdict, dataclass, replace

import numpy as np

from derain.datamodules.user_changes import changed_as_by_users
from derain.files.documents import Entry
from derain.scan import Bools, Float32s, Scan
from derain.views.spherical_grid import ALL_AROUND, FULL_CIRCLE

# How often rain alone is made brighter or darker, by up to e to this power; and how often that is
# then cut to whole numbers, of up to so few.
# Source: modelling choices, as are the rest.
OF_RAIN, STRONGEST, WHOLE = 0.45, 4.0, 0.4
COARSEST = (-2.5, 0.5)

# Levels that intensities are cut to, where they are.
FEW_LEVELS = 7


@dataclass(frozen=True)
class Augmentation:
    """Random changes of a scan: of where its points are, which there are, and how bright.

    The published recipe jitters by 0.1 *after* normalisation, which is 2.6 m in x and 0.16 m in z
    on WADS, and leaves the neighbours' distances those of the still cloud. Here the jitter is in
    metres and comes before the view, so that coordinates and distances agree.

    Scans stay in the network's field of view: they are turned only for a network that sees all
    around, and mirrored about the middle of a smaller field of view.

    Attributes:
        rotation_probability: Share of scans that are turned by an angle of 0 to 360 degrees, where
            the network sees all around.
        jitter_probability: Share of scans whose coordinates are jittered.
        jitter: Standard deviation of the jitter in metres, about a LiDAR's range noise.
        mirror_probability: Share of scans whose left and right are swapped.
        dropping_probability: Share of scans that lose points.
        dropping: The largest share of its points that such a scan loses.
        brightness_probability: Share of scans that are given other intensities, see
            :func:`~derain.datamodules.augmentation.with_other_brightness`.
        user_probability: Share of scans that are changed as users change theirs, see
            :func:`~derain.datamodules.user_changes.changed_as_by_users`.

    Source: sporsho/3D_OutDet, dataset/_point_cloud_dataset.py, for rotation, jitter and their 0.5;
        TiagoCortinhal/SalsaNext for mirroring and dropping.

    Raises:
        InputError: A number that is negative, or a share above 1.
    """

    rotation_probability: float = 0.5
    jitter_probability: float = 0.5
    jitter: float = 0.01
    mirror_probability: float = 0.0
    dropping_probability: float = 0.0
    dropping: float = 0.5
    brightness_probability: float = 0.0
    user_probability: float = 0.0

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            Entry("augmentation", name, value).within(0, math.inf if name == "jitter" else 1)

    @property
    def changes_anything(self) -> bool:
        """True if any scan is changed."""
        drawn = asdict(self).items()
        return any(share for name, share in drawn if name.endswith("_probability"))

    def __call__(
        self,
        scan: Scan,
        generator: np.random.Generator,
        azimuth: tuple[float, float] = ALL_AROUND,
        rain: Collection[int] = (),
    ) -> Scan:
        """Returns a changed copy, in which points that are left keep their labels.

        Args:
            scan: The scan.
            generator: Draws the changes.
            azimuth: The network's field of view: right and left bound, degrees counter-clockwise
                from x.
            rain: Labels of rain, whose intensities may be changed by themselves.
        """
        right, left = azimuth
        sees_all_around = left - right == FULL_CIRCLE
        valid = scan.valid  # rows without a return stay as they are
        moved = scan.xyz[valid]
        if generator.random() < self.rotation_probability and sees_all_around:
            moved = moved @ _turn(generator.uniform(0, 2 * np.pi))
        if generator.random() < self.jitter_probability:
            moved = moved + generator.normal(0, self.jitter, moved.shape).astype(np.float32)
        if generator.random() < self.mirror_probability:
            moved = moved @ _mirror(0.0 if sees_all_around else math.radians(left + right) / 2)
        xyz = scan.xyz.copy()
        xyz[valid] = moved
        changed = replace(scan, xyz=xyz)
        if self.brightness_probability and generator.random() < self.brightness_probability:
            is_rain = np.zeros(len(scan), bool)
            if scan.label is not None:
                is_rain = np.isin(scan.label, list(rain))
            changed = with_other_brightness(changed, is_rain & scan.valid, generator)
        if generator.random() < self.dropping_probability:
            share = generator.uniform(0, self.dropping)
            changed = changed.take(generator.random(len(scan)) >= share)
        if not changed.valid.any():
            return changed
        if self.user_probability and generator.random() < self.user_probability:
            changed = changed_as_by_users(changed.take(changed.valid), generator)
        return changed


def _turn(angle: float) -> Float32s:
    """Turns rows of x, y, z about the vertical axis."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]], np.float32)


def _mirror(azimuth: float) -> Float32s:
    """Mirrors rows of x, y, z in the vertical plane that points to an azimuth, radians."""
    cosine, sine = np.cos(2 * azimuth), np.sin(2 * azimuth)
    return np.array([[cosine, sine, 0], [sine, -cosine, 0], [0, 0, 1]], np.float32)


def with_other_brightness(scan: Scan, rain: Bools, generator: np.random.Generator) -> Scan:
    """A scan whose intensities are made all alike, inverted, cut to a few levels, or other in rain.

    Args:
        scan: The scan; one without intensities stays as it is.
        rain: Its rain, bool (N,).
        generator: Draws the change.
    """
    if scan.intensity is None or not scan.valid.any():
        return scan
    valid, known = scan.valid, scan.intensity[scan.valid]
    if rain.any() and generator.random() < OF_RAIN:
        changed = _with_other_rain(known, rain[valid], generator)
    else:
        changed = _of_all(known, generator)
    intensity = scan.intensity.copy()  # rows without a return stay as they are
    intensity[valid] = changed
    return replace(scan, intensity=intensity)


def _of_all(known: Float32s, generator: np.random.Generator) -> Float32s:
    match generator.integers(3):
        case 0:
            return np.zeros_like(known)
        case 1:
            inverted: Float32s = known.max() - known
            return inverted
        case _:
            levels = np.sort(generator.choice(known, FEW_LEVELS - 1))
            return np.searchsorted(levels, known).astype(np.float32)


def _with_other_rain(intensity: Float32s, rain: Bools, generator: np.random.Generator) -> Float32s:
    largest = intensity.max()
    factor = np.exp(generator.uniform(-STRONGEST, STRONGEST))
    result = np.where(rain, np.minimum(intensity * factor, largest), intensity)
    if generator.random() < WHOLE:
        result = np.floor(result * np.exp(generator.uniform(*COARSEST)))
    return result.astype(np.float32)
